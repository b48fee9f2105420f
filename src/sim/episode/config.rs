//! Settings of an episode: its duration and time steps, the thresholds of its judge, and the disturbances.

use crate::plant::Clock;
use crate::{Engine, Push, SensorErrors, Variation};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::Units;

/// Thresholds by which an episode is judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Judge {
    /// For recovered: largest tilt of the trunk from upright.
    pub standing_tilt_deg: f64,
    /// For recovered: largest COM speed.
    pub standing_com_speed_m_s: f64,
    /// For recovered: the time for which the conditions must hold without a break.
    pub standing_time_s: f64,
    /// For fell: the tilt of the trunk is larger than this.
    pub fallen_tilt_deg: f64,
    /// For fell: the COM height is below this share of its height at home.
    pub fallen_com_height_ratio: f64,
    /// Which outcomes count as won.
    #[serde(default)]
    pub counts: Counts,
    /// For broke: the [load](crate::loads) of a sole is more than this many weights of the robot as designed. None if no
    /// load breaks it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_sole_force_weights: Option<f64>,
    /// For being home: largest horizontal distance of the COM from the point midway between the soles' centres.
    pub home_radius_m: f64,
}

impl Judge {
    /// The usual thresholds, for a robot with these units.
    pub fn of(units: &Units) -> Self {
        Self {
            standing_tilt_deg: 10.0,
            standing_com_speed_m_s: 0.01147 * units.speed_m_s(),
            standing_time_s: 2.813 * units.time_s(),
            fallen_tilt_deg: 60.0,
            fallen_com_height_ratio: 0.6,
            counts: Counts::Recovered,
            max_sole_force_weights: None,
            home_radius_m: 0.01613 * units.length_m,
        }
    }
}

/// Which outcomes count as won.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Counts {
    /// Trials in which the robot recovers: it comes to stand still.
    #[default]
    Recovered,
    /// Also trials in which the robot has not fallen at the horizon: walkers never stand still.
    Survived,
}

/// The usual period of a controller (s). It depends on a robot's electronics, not on its size.
pub const CONTROL_PERIOD_S: f64 = 0.002;

/// The usual step of the physics, in either engine (s).
const PHYSICS_STEP_S: f64 = 0.002;

/// Most control ticks of an episode that is written or drawn.
const MOST_TICKS: f64 = 200_000.0;

/// Settings that all episodes of a campaign share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeConfig {
    /// The physics engine that simulates the robot.
    pub engine: Engine,
    pub horizon_s: f64,
    pub physics_step_s: f64,
    pub control_period_s: f64,
    /// Whether an episode ends as soon as the robot is settled. If false, only a fall ends it before the horizon;
    /// [`Record::home_at_s`](super::Record::home_at_s) then has a meaning, and "recovered" is standing at the horizon.
    pub end_early: bool,
    pub judge: Judge,
}

impl EpisodeConfig {
    /// The usual settings, for a robot with these units.
    pub fn of(units: &Units) -> Self {
        Self {
            engine: Engine::default(),
            horizon_s: 33.76 * units.time_s(),
            physics_step_s: PHYSICS_STEP_S,
            control_period_s: CONTROL_PERIOD_S,
            end_early: true,
            judge: Judge::of(units),
        }
    }

    /// Engine and time steps of the simulation.
    pub fn clock(&self) -> Clock {
        Clock {
            engine: self.engine,
            physics_step_s: self.physics_step_s,
            control_period_s: self.control_period_s,
        }
    }

    /// Fails if an episode can become so long that its ticks fill the memory.
    pub fn check_length(&self) -> Result<()> {
        let most_s = MOST_TICKS * self.control_period_s;
        if self.horizon_s <= most_s {
            return Ok(());
        }
        let problem = "is too long to be kept tick by tick, for a trace, plot, film or replay";
        Err(Error::value(
            "episode",
            "horizon_s",
            self.horizon_s,
            problem,
            format!("up to {most_s}"),
        ))
    }

    /// The condition that ends an episode of a campaign.
    pub fn until(&self) -> Until {
        if self.end_early {
            Until::Decided
        } else {
            Until::Fallen
        }
    }
}

/// The disturbances of one episode, which the controller does not know.
#[derive(Clone, Default)]
pub struct Disturbance {
    pub pushes: Vec<Push>,
    /// Noise and bias of the sensors. None means ideal sensors; the robot's delay remains.
    pub sensor_errors: Option<SensorErrors>,
    /// Differences of the simulated robot and ground from those for which the controller is designed.
    pub variation: Variation,
    /// Seed of the random numbers of a controller.
    pub seed: u64,
}

/// When an episode ends before its horizon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// When the robot has fallen or broke, or is settled after the last push.
    Decided,
    /// When the robot has fallen or broke.
    Fallen,
    /// Never: the episode runs to the horizon.
    Horizon,
}
