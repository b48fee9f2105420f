//! The controller alone, for a robot or another simulator: no engine, no files, no program.
//!
//! [`lipm`] is the COG-ZMP inverted pendulum of the paper with its feedback gains and maximal CPI sets, [`robot`] the robot
//! as numbers, [`socket`] what every controller is to those who drive it, and [`control`] our own controller. [`geometry`] has
//! the polygons and polytopes of all of them.
//!
//! Quantities are in SI units and f64, and in the world frame unless a type says otherwise: x forward, y left, z up.
//! Heading 0 pushes forward, and 90 degrees to the left.

#![forbid(unsafe_code)]

pub mod arrays;
pub mod control;
pub mod error;
pub mod geometry;
pub mod lipm;
pub mod robot;
pub mod socket;

pub use error::{Error, Result};
