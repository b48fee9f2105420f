//! The study of the paper: simulations and measurements of its authors, done again with the controller of
//! [`standfast`].
//!
//! A [`scenario`] is a disturbance with a name. The paper's pushes are simulated as any push is; the ZMP errors that
//! the paper gives to its controller are [`imposed`] on the ideal pendulum, without physics. [`response`] measures how
//! well the ZMP of the simulated robot follows the desired ZMP, which the paper takes for granted, and [`foretold`] how
//! well the CPI sets foretell whether the robot recovers. [`published`] sets the pendulum bounds beside pushes of others.
//! [`commands`] has a file for each command of the program, and [`render`] draws and tells what the commands found.
//!
//! This crate sees the controller only through [`account`], and the robot through the closed loop of standfast.

#![forbid(unsafe_code)]

use standfast::core::Result;
use standfast::core::lipm::GainSet;
use standfast::files::assets::{self, InputKind};

pub mod account;
pub mod commands;
pub mod foretold;
pub mod imposed;
pub mod published;
pub mod render;
pub mod response;
pub mod scenario;

/// Reads a built-in gain set by its name, or a file. Fails for a controller of another kind.
pub fn gain_set(name: &str) -> Result<GainSet> {
    standfast::controllers::parse_gain_set(&assets::open(InputKind::Controller, name)?)
}
