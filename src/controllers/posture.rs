//! Stiff joints: the servos hold the posture of the start, with the torques that carry the weight there, and nothing is
//! measured. Every controller must beat this one. It is also the shortest example of a kind of controllers.

use super::spec::{ControllerSpec, check_name};
use serde::{Deserialize, Serialize};
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_core::socket::{Command, Controller, PreparedController, Report, Sensed, TickError};
use toml::Table;

/// The content of the controller's file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldPosture {
    kind: String,
    name: String,
    #[serde(default)]
    description: String,
}

impl ControllerSpec for HeldPosture {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        check_name(file, &self.name)
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    fn prepare(&self, robot: &Robot, _period_s: f64) -> Result<PreparedController> {
        let home = robot.home_command();
        let mut factory =
            PreparedController::new(&self.name, "which keeps its posture", move |_seed| {
                StiffController { home: home.clone() }
            });
        factory.takes_footsteps = false;
        Ok(factory)
    }
}

/// Stiff joints in an episode.
#[derive(Clone)]
struct StiffController {
    home: Command,
}

impl Controller for StiffController {
    fn tick(&mut self, _sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        command.clone_from(&self.home);
        Ok(())
    }

    fn report(&self) -> Report<'_> {
        Report::of_phase("posture")
    }

    fn fork(&self) -> Option<Box<dyn Controller>> {
        Some(Box::new(self.clone()))
    }
}
