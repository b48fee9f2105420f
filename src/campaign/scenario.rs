//! Scenarios: single disturbances that are worth a name, those of the paper's Sect. V and VI first. A file under
//! `assets/scenarios/` says what disturbs the robot; everything else is as in `push`.

use crate::assets::{self, DEFAULT_ROBOT, Kind, Source, parse_toml};
use crate::episode::imposed::Start;
use crate::error::{Error, Result};
use crate::sim::Push;
use serde::{Deserialize, Serialize};

/// A scenario as its file has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    #[serde(default = "default_robot")]
    pub robot: String,
    pub gains: String,
    pub horizon_s: f64,
    /// A push in the simulated physics, with ideal sensors,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub push: Option<Push>,
    /// or a ZMP error that is imposed on the ideal pendulum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imposed: Option<Imposed>,
}

/// A ZMP error and what goes with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imposed {
    /// Control frame: x forward, y left.
    pub zmp_error_m: [f64; 2],
    #[serde(default)]
    pub start: Start,
}

/// What disturbs the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    Push(Push),
    Imposed(Imposed),
}

fn default_robot() -> String {
    DEFAULT_ROBOT.into()
}

impl Scenario {
    /// Loads a scenario that is compiled in, or a file.
    pub fn load(name_or_path: &str) -> Result<Self> {
        Self::parse(&assets::open(Kind::Scenario, name_or_path)?)
    }

    /// All that are compiled in.
    pub fn builtin() -> Result<Vec<Self>> {
        Kind::Scenario.names().into_iter().map(Self::load).collect()
    }

    /// Reads a scenario. Errors name file, field, value and what would be accepted.
    pub fn parse(source: &Source) -> Result<Self> {
        let scenario: Self = parse_toml(source)?;
        if !(scenario.horizon_s > 0.0 && scenario.horizon_s <= 100.0) {
            return Err(Error::value(&source.file, "horizon_s", scenario.horizon_s, "out of range", "0 to 100"));
        }
        scenario.cause_in(&source.file)?;
        Ok(scenario)
    }

    /// What disturbs the robot.
    pub fn cause(&self) -> Result<Cause> {
        self.cause_in(&self.name)
    }

    fn cause_in(&self, file: &str) -> Result<Cause> {
        match (self.push, self.imposed) {
            (Some(push), None) => Ok(Cause::Push(push)),
            (None, Some(imposed)) => Ok(Cause::Imposed(imposed)),
            (push, _) => {
                let value = if push.is_some() { "both" } else { "neither" };
                let accepted = "one of the tables [push] and [imposed]";
                Err(Error::value(file, "push, imposed", value, "one thing disturbs the robot", accepted))
            }
        }
    }
}
