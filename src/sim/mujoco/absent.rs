//! Stands in for MuJoCo in a program that was built without it.

use super::physics::Physics;
use super::{Ground, Pairs};
use crate::error::{Error, Result};
use crate::robot::{Posture, Robot};

pub fn version() -> &'static str {
    "(not in this program)"
}

/// Always fails, and says how to get MuJoCo.
pub fn check(_: &Robot) -> Result<()> {
    let problem = "this program was built without MuJoCo";
    let accepted =
        "rapier; for mujoco, build with `eval \"$(.ci/mujoco)\"` and `cargo build --release --features mujoco`";
    Err(Error::value("engine", "--engine", "mujoco", problem, accepted))
}

/// Cannot be called after [`check`] has failed.
pub fn start(_: &Robot, _: &Ground, _: &Pairs, _: &Posture, _: f64) -> Box<dyn Physics> {
    unreachable!("the engine was not checked")
}
