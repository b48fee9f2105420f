//! Scenarios: single disturbances that are worth a name, those of the paper's Sect. V and VI first. A file under
//! `assets/scenarios/` says what disturbs the robot; everything else is as in `push`.

use crate::assets::{self, Kind, Source, parse_toml};
use crate::campaign::ask::bounds::{PushBounds, check_episode, positive};
use crate::campaign::ask::spec::default_robot;
use crate::episode::EpisodeConfig;
use crate::episode::imposed::Start;
use crate::error::{Error, Result};
use crate::sim::Push;
use serde::{Deserialize, Serialize};

/// An error longer than this is none that a robot on feet could make good (m).
const MOST_ERROR_M: f64 = 1.0;

/// Longer than any fall or recovery lasts (s).
const MOST_HORIZON_S: f64 = 100.0;

/// A scenario as its file has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// By which it is called.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// Name or URDF file, from the working folder.
    #[serde(default = "default_robot")]
    pub robot: String,
    /// Name or file, from the working folder.
    pub gains: String,
    /// Length of the episode.
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
        positive(&source.file, "horizon_s", scenario.horizon_s, MOST_HORIZON_S)?;
        check_episode(&source.file, &scenario.episode())?;
        match scenario.cause_in(&source.file)? {
            Cause::Push(push) => PushBounds::new(scenario.horizon_s).check(&source.file, &push)?,
            Cause::Imposed(Imposed { zmp_error_m: [x, y], .. }) => {
                if !(x.hypot(y) > 0.0 && x.hypot(y) <= MOST_ERROR_M) {
                    let accepted = format!("an error of at most {MOST_ERROR_M} m, and not zero");
                    let value = format!("[{x}, {y}]");
                    return Err(Error::value(&source.file, "imposed.zmp_error_m", value, "out of range", accepted));
                }
            }
        }
        Ok(scenario)
    }

    /// How long it lasts, and by what it is judged.
    pub fn episode(&self) -> EpisodeConfig {
        EpisodeConfig { horizon_s: self.horizon_s, ..EpisodeConfig::default() }
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
