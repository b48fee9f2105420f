//! Scenarios: single disturbances with a name, above all the disturbances of the paper's Sect. V and VI. A file under
//! `scenarios/` states the disturbance; everything else is as in the command `push` of standfast.

use crate::imposed::Start;
use serde::{Deserialize, Serialize};
use standfast::core::arrays::exactly;
use standfast::core::error::{Error, Result};
use standfast::core::robot::{Robot, Units};
use standfast::files::assets::{self, DEFAULT_ROBOT, Source, parse_toml};
use standfast::sim::Push;
use standfast::sim::episode::EpisodeConfig;
use standfast::study::ask::bounds::{PushBounds, check_episode, in_range, positive};
use standfast::study::ask::pendulum::{check_bob, check_strike};

/// Largest accepted ZMP error (m); no robot could recover from a larger one.
const MOST_ERROR_M: f64 = 1.0;

/// Largest accepted horizon (s), which is longer than any fall or recovery.
const MOST_HORIZON_S: f64 = 100.0;

/// Lists files of the folder `scenarios` by their names without the extension.
macro_rules! texts {
    ($($name:literal)*) => { [$(($name, include_str!(concat!("../scenarios/", $name, ".toml")))),*] };
}

/// Names and texts of the scenarios that are compiled in, in the order in which they are listed.
pub const BUILTIN: [(&str, &str); 10] = texts! {
    "error-backward" "error-diagonal" "push-behind" "push-diagonal"
    "moving-backward" "moving-diagonal" "push-error-backward" "push-error-diagonal"
    "gauge-behind" "gauge-diagonal"
};

/// A scenario as its file states it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name by which the scenario is called.
    pub name: String,
    /// A sentence about what the scenario shows.
    pub description: String,
    /// Name of a built-in robot, or path of a URDF, relative to the working folder.
    #[serde(default = "ut_mu2")]
    pub robot: String,
    /// Name of a built-in gain set, or path, relative to the working folder.
    pub gains: String,
    /// Duration of the episode (s).
    pub horizon_s: f64,
    /// A push in the simulated physics, with ideal sensors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub push: Option<Push>,
    /// How far the bob of the push is drawn back (m), which a scenario states if and only if there is one; the impulse of the
    /// push follows from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draw_m: Option<f64>,
    /// A ZMP error imposed on the ideal pendulum. A scenario has either this or a push.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imposed: Option<Imposed>,
}

/// An imposed ZMP error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imposed {
    /// The error in the control frame: x forward, y left.
    #[serde(deserialize_with = "exactly")]
    pub zmp_error_m: [f64; 2],
    #[serde(default)]
    pub start: Start,
}

/// The disturbance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    Push(Push),
    Imposed(Imposed),
}

/// The robot of a scenario that names none.
fn ut_mu2() -> String {
    DEFAULT_ROBOT.into()
}

impl Scenario {
    /// Loads a built-in scenario or a file.
    pub fn load(name_or_path: &str) -> Result<Self> {
        Self::parse(&assets::open_among("scenario", &BUILTIN, name_or_path)?)
    }

    /// All built-in scenarios.
    pub fn builtin() -> Result<Vec<Self>> {
        BUILTIN.iter().map(|(name, _)| Self::load(name)).collect()
    }

    /// Reads a scenario. Errors name the file, the field, its value and what is accepted.
    pub fn parse(source: &Source) -> Result<Self> {
        let scenario: Self = parse_toml(source)?;
        positive(
            &source.file,
            "horizon_s",
            scenario.horizon_s,
            MOST_HORIZON_S,
        )?;
        let robot = standfast::robots::load(&scenario.robot)?;
        check_episode(&source.file, &scenario.episode(&robot))?;
        match scenario.cause_in(&source.file)? {
            Cause::Push(push) => {
                PushBounds::new(scenario.horizon_s).check(&source.file, &push)?;
                if let Some(bob) = &push.bob {
                    check_strike(&source.file, &robot, &push, bob)?;
                }
            }
            Cause::Imposed(Imposed {
                zmp_error_m: [x, y],
                ..
            }) => {
                if !(x.hypot(y) > 0.0 && x.hypot(y) <= MOST_ERROR_M) {
                    let accepted = format!("a non-zero error of at most {MOST_ERROR_M} m");
                    let value = format!("[{x}, {y}]");
                    return Err(Error::value(
                        &source.file,
                        "imposed.zmp_error_m",
                        value,
                        "out of range",
                        accepted,
                    ));
                }
            }
        }
        Ok(scenario)
    }

    /// Settings of the episode, with its horizon and the judge of `robot`.
    pub fn episode(&self, robot: &Robot) -> EpisodeConfig {
        EpisodeConfig {
            horizon_s: self.horizon_s,
            ..EpisodeConfig::of(&Units::of(robot))
        }
    }

    /// The disturbance. It fails unless the scenario has exactly one.
    pub fn cause(&self) -> Result<Cause> {
        self.cause_in(&self.name)
    }

    /// The push with the momentum of its bob, if it has one. Fails unless bob and drawback go together, and are in range.
    fn swung(&self, file: &str, push: Push) -> Result<Push> {
        let (bob, draw_m) = match (push.bob, self.draw_m) {
            (None, None) => return Ok(push),
            (Some(bob), Some(draw_m)) => (bob, draw_m),
            (bob, _) => {
                let value = if bob.is_some() { "none" } else { "no bob" };
                return Err(Error::value(
                    file,
                    "draw_m",
                    value,
                    "a bob needs a drawback, and a drawback a bob",
                    "draw_m and the table [push.bob], or neither",
                ));
            }
        };
        check_bob(file, "push.bob", &bob)?;
        in_range(file, "draw_m", draw_m, [0.0, bob.rope_m])?;
        let impulse_n_s = bob.momentum_n_s(draw_m);
        Ok(Push {
            impulse_n_s,
            ..push
        })
    }

    fn cause_in(&self, file: &str) -> Result<Cause> {
        match (self.push, self.imposed) {
            (Some(push), None) => Ok(Cause::Push(self.swung(file, push)?)),
            (None, Some(imposed)) => Ok(Cause::Imposed(imposed)),
            (push, _) => {
                let value = if push.is_some() { "both" } else { "neither" };
                let accepted = "one of the tables [push] and [imposed]";
                Err(Error::value(
                    file,
                    "push, imposed",
                    value,
                    "there must be exactly one disturbance",
                    accepted,
                ))
            }
        }
    }
}
