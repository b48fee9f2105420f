//! The physics engines that can simulate the robot. Everything but the physics is the same with each engine: robot,
//! servos, delay, sensors, noise, ground, pushes and judge.

use super::physics::Physics;
use super::{Ground, Pairs, rapier};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Posture, Robot};
use std::sync::OnceLock;

/// The version of MuJoCo's library for which this program is made.
pub const MUJOCO_VERSION: &str = "3.17.0";

/// What a crate brings that has an engine.
#[derive(Debug, Clone, Copy)]
pub struct EngineParts {
    /// Version of the library that is loaded.
    pub version: fn() -> &'static str,
    /// Checks that the engine can simulate a robot.
    pub check: fn(&Robot) -> Result<()>,
    /// A checked robot at rest in a posture, on ground that is still level, with a physics step (s). The pairs state which of
    /// its links collide with each other.
    pub start: fn(&Robot, &Ground, &Pairs, &Posture, f64) -> Box<dyn Physics>,
}

/// MuJoCo, in a program that has it.
static MUJOCO: OnceLock<EngineParts> = OnceLock::new();

/// Adds MuJoCo to the engines of this program. A second call changes nothing.
pub fn add_mujoco(parts: EngineParts) {
    MUJOCO.get_or_init(|| parts);
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    #[default]
    Rapier,
    Mujoco,
}

impl Engine {
    pub const ALL: [Engine; 2] = [Engine::Rapier, Engine::Mujoco];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Engine::Rapier => "rapier",
            Engine::Mujoco => "mujoco",
        }
    }

    /// The engine of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|engine| engine.name() == name)
    }

    /// Name in sentences.
    pub fn title(self) -> &'static str {
        match self {
            Engine::Rapier => "Rapier",
            Engine::Mujoco => "MuJoCo",
        }
    }

    /// Name and version, such as "Rapier 0.36.1". The version is that of the library in use.
    pub fn with_version(self) -> String {
        let version = match self {
            Engine::Rapier => rapier::VERSION,
            Engine::Mujoco => MUJOCO
                .get()
                .map_or("(not in this program)", |mujoco| (mujoco.version)()),
        };
        format!("{} {version}", self.title())
    }

    /// Checks that this program has the engine, and that the engine can simulate the robot.
    pub fn check(self, robot: &Robot) -> Result<()> {
        match self {
            Engine::Rapier => Ok(()),
            Engine::Mujoco => (MUJOCO.get().ok_or(Error::NoMujoco)?.check)(robot),
        }
    }

    /// The robot at rest in `posture`, on ground that is still level. `pairs` states which of its links collide with
    /// each other. The engine must be able to simulate the robot ([`check`](Self::check)).
    pub(super) fn start(
        self,
        robot: &Robot,
        ground: &Ground,
        pairs: &Pairs,
        posture: &Posture,
        step_s: f64,
    ) -> Box<dyn Physics> {
        match self {
            Engine::Rapier => rapier::start(robot, ground, pairs, posture, step_s),
            Engine::Mujoco => {
                let mujoco = MUJOCO.get().expect("the engine was checked");
                (mujoco.start)(robot, ground, pairs, posture, step_s)
            }
        }
    }
}
