//! Replaces MuJoCo in a program that was built without it.

use super::physics::Physics;
use super::{Ground, Pairs};
use crate::error::{Error, Result};
use crate::robot::{Posture, Robot};

pub fn version() -> &'static str {
    "(not in this program)"
}

/// Always fails.
pub fn check(_: &Robot) -> Result<()> {
    Err(Error::NoMujoco)
}

/// Cannot be called after [`check`] has failed.
pub fn start(_: &Robot, _: &Ground, _: &Pairs, _: &Posture, _: f64) -> Box<dyn Physics> {
    unreachable!("the engine was not checked")
}
