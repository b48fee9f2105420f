//! How hard can a humanoid be pushed before it falls, and which controller makes it stand better?
//!
//! A URDF becomes a Rapier multibody with PD servos ([`sim`]). The controller ([`control`]) implements the switching
//! control of the COG-ZMP inverted pendulum by maximal CPI sets of Yamamoto and Nakamura ([`lipm`]). An [`episode`]
//! closes the loop between the two. A [`campaign`] draws random pushes and counts the trials from which the robot
//! recovers.
//!
//! The [`guide`] says how to use it and what has been measured.
//!
//! Quantities are in SI units and f64, and in the world frame unless a type says otherwise: x forward, y left, z up.
//! Heading 0 pushes forward, and 90 degrees to the left.

#![forbid(unsafe_code)]

pub mod assets;
#[cfg(feature = "program")]
pub mod campaign;
#[cfg(feature = "program")]
pub mod columns;
#[cfg(feature = "program")]
pub mod commands;
#[cfg(feature = "program")]
pub mod contest;
pub mod control;
#[cfg(feature = "program")]
pub mod episode;
pub mod error;
#[cfg(feature = "program")]
pub mod files;
#[cfg(feature = "program")]
pub mod foreign;
pub mod geometry;
pub mod guide;
pub mod lipm;
#[cfg(feature = "program")]
pub mod render;
pub mod robot;
#[cfg(feature = "program")]
pub mod sim;
#[cfg(feature = "program")]
pub mod stats;
#[cfg(feature = "program")]
pub mod view;

pub use error::{Error, Result};
