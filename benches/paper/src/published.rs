//! Pushes that others published: robot, push and outcome of each, beside what the pendulum bounds say of it. The bounds
//! know how long a push lasts and, as a second figure, how far above the COM it acts.

use nalgebra::Point2;
use serde::Deserialize;
use standfast::core::error::{Error, Result};
use standfast::core::lipm::capture::{
    Bounds, SteppingPendulum, SwingRegion, rectangular_push_factor,
};
use standfast::core::robot::GRAVITY;
use standfast::files::assets::{Source, parse_toml};

/// The cases that are compiled in.
const BUILTIN: &str = include_str!("../published.toml");

/// Robots, and pushes of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    pub robots: Vec<Figures>,
    pub cases: Vec<Case>,
}

/// A robot as a pendulum on two equal soles.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    pub name: String,
    /// Address of the page that states its figures.
    pub figures: String,
    pub mass_kg: f64,
    pub com_height_m: f64,
    /// Length and width of a sole.
    pub sole_m: [f64; 2],
    /// Distance between the soles' centres.
    pub stance_width_m: f64,
    /// Where a foot can land; none if nobody says so.
    #[serde(default)]
    pub reach: Vec<Landing>,
}

/// Where a foot can land, as offsets from sole to sole, and the time of the footstep.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landing {
    pub x_m: [f64; 2],
    pub y_m: [f64; 2],
    pub time_s: f64,
}

/// How hard a push is, as its source states it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strength {
    ForceN(f64),
    /// A force in weights of the robot.
    ForceWeights(f64),
    /// An instantaneous change of the COM's velocity.
    SpeedMS(f64),
}

/// What was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seen {
    Stood,
    /// Held, and footsteps were allowed.
    Stepped,
    /// Fell, and footsteps were not allowed.
    Fell,
    FellStepping,
}

/// A push and its outcome.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Name of the robot.
    pub robot: String,
    /// Address of the page that states push and outcome.
    pub source: String,
    /// What was special about it; may be empty.
    #[serde(default)]
    pub what: String,
    /// Whether the robot stands on one foot.
    #[serde(default)]
    pub one_foot: bool,
    pub strength: Strength,
    /// 0 is forward, 90 to the left.
    #[serde(default)]
    pub heading_deg: f64,
    /// 0 for an instantaneous push.
    #[serde(default)]
    pub duration_s: f64,
    #[serde(default)]
    pub above_com_m: f64,
    pub seen: Seen,
}

/// What the bounds say of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    pub impulse_n_s: f64,
    /// For the duration of the push. The two with footsteps are None where no landing places are known.
    pub none_n_s: f64,
    pub one_n_s: Option<f64>,
    pub any_n_s: Option<f64>,
    /// What is left of a bound if the ground has to take the moment of the push about the COM at once.
    pub height_factor: f64,
    /// Impulse over the bound that counts: without footsteps where none were allowed, else with any number.
    pub share: f64,
}

impl Figures {
    fn pendulum(&self, one_foot: bool) -> SteppingPendulum {
        let [x_m, y_m] = self.sole_m.map(|side_m| [-0.5 * side_m, 0.5 * side_m]);
        let regions = self.reach.iter().map(|landing| SwingRegion {
            x_m: landing.x_m,
            y_m: landing.y_m,
            swing_time_s: landing.time_s,
        });
        SteppingPendulum {
            mass_kg: self.mass_kg,
            omega: (GRAVITY / self.com_height_m).sqrt(),
            com: Point2::origin(),
            sole_x_m: x_m,
            sole_y_m: y_m,
            both_x_m: x_m,
            both_y_m: y_m,
            // Two soles at one place are one sole.
            stance_width_m: if one_foot { 0.0 } else { self.stance_width_m },
            regions: regions.collect(),
        }
    }
}

impl Published {
    /// The cases that are compiled in.
    ///
    /// # Errors
    /// The file cannot be read, or a case names no robot of the file.
    pub fn builtin() -> Result<Self> {
        let file = "published.toml";
        let published: Self = parse_toml(&Source {
            text: BUILTIN.into(),
            file: file.into(),
        })?;
        for case in &published.cases {
            if published.robot(case).is_none() {
                let (problem, accepted) = ("no such robot", "the name of one of [[robots]]");
                return Err(Error::value(
                    file,
                    "cases.robot",
                    &case.robot,
                    problem,
                    accepted,
                ));
            }
        }
        Ok(published)
    }

    /// The robot of a case.
    pub fn robot(&self, case: &Case) -> Option<&Figures> {
        self.robots.iter().find(|robot| robot.name == case.robot)
    }
}

impl Case {
    /// What the bounds say of this push of `robot`.
    pub fn answer(&self, robot: &Figures) -> Answer {
        let impulse_n_s = match self.strength {
            Strength::ForceN(force_n) => force_n * self.duration_s,
            Strength::ForceWeights(weights) => weights * robot.mass_kg * GRAVITY * self.duration_s,
            Strength::SpeedMS(speed_m_s) => speed_m_s * robot.mass_kg,
        };
        let pendulum = robot.pendulum(self.one_foot);
        let factor = rectangular_push_factor(pendulum.omega, self.duration_s);
        let Bounds {
            no_step_n_s,
            one_step_n_s,
            n_step_n_s,
        } = pendulum.bounds(self.heading_deg);
        let none_n_s = factor * no_step_n_s;
        let [one_n_s, any_n_s] = [one_step_n_s, n_step_n_s]
            .map(|bound| (!robot.reach.is_empty()).then_some(factor * bound));
        let bound = match self.seen {
            Seen::Stood | Seen::Fell => none_n_s,
            Seen::Stepped | Seen::FellStepping => any_n_s.unwrap_or(none_n_s),
        };
        Answer {
            impulse_n_s,
            none_n_s,
            one_n_s,
            any_n_s,
            height_factor: 1.0 / (1.0 + self.above_com_m.max(0.0) / robot.com_height_m),
            share: impulse_n_s / bound,
        }
    }

    /// Whether the robot held the push.
    pub fn held(&self) -> bool {
        matches!(self.seen, Seen::Stood | Seen::Stepped)
    }
}

impl Answer {
    /// The share of the bound at the height of the push.
    pub fn share_at_height(&self) -> f64 {
        self.share / self.height_factor
    }
}
