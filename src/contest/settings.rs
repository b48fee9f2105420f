//! What every kind of controllers provides: settings that are read from a file, and make a [`Factory`] for a robot.

use crate::error::Result;
use crate::robot::{Factory, Robot};
use std::any::Any;
use std::fmt::Debug;
use toml::Table;

/// The settings of a controller, read and checked, for any robot.
pub trait Settings: Any + Debug + Send + Sync {
    /// Name of the controller in tables and results.
    fn name(&self) -> &str;

    /// Checks the values. Errors name `file`, the field, its value and what is accepted.
    fn check(&self, file: &str) -> Result<()>;

    /// The file with all defaults filled in, in which a [variant](super::variant) changes a value.
    fn tree(&self) -> Table;

    /// Names of the totals that its reports have, which become columns of a result.
    fn totals(&self) -> &'static [&'static str] {
        &[]
    }

    /// Prepares the controller for a robot and a control period (s). Fails if the settings do not suit the robot.
    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<Factory>;
}
