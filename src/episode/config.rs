//! What an episode is: how long, in what steps, how it is judged, and what disturbs the robot.

use crate::sim::{Push, SensorErrors, Variation};
use serde::{Deserialize, Serialize};

/// Thresholds of the judge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Judge {
    /// Recovered: the trunk is within this angle of upright.
    pub standing_tilt_deg: f64,
    /// Recovered: the COM is slower than this.
    pub standing_com_speed_m_s: f64,
    /// Recovered: for how long all this must hold.
    pub standing_time_s: f64,
    /// Fell: the trunk is tilted by more.
    pub fallen_tilt_deg: f64,
    /// Fell: the COM is lower than this share of its height at home.
    pub fallen_com_height_ratio: f64,
    /// Home: the COM over the ground is this near to the middle of the soles' centres.
    pub home_radius_m: f64,
}

impl Default for Judge {
    fn default() -> Self {
        Self {
            standing_tilt_deg: 10.0,
            standing_com_speed_m_s: 0.02,
            standing_time_s: 0.5,
            fallen_tilt_deg: 60.0,
            fallen_com_height_ratio: 0.6,
            home_radius_m: 0.005,
        }
    }
}

/// What is the same for every episode of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EpisodeConfig {
    pub horizon_s: f64,
    pub physics_step_s: f64,
    pub control_period_s: f64,
    /// End an episode once it is settled. False: only a fall ends it before the horizon, so that
    /// [`Record::home_at_s`](super::Record::home_at_s) means something, and "recovered" is standing at the horizon to the letter.
    pub end_early: bool,
    pub judge: Judge,
}

impl Default for EpisodeConfig {
    fn default() -> Self {
        Self {
            horizon_s: 6.0,
            physics_step_s: 0.001,
            control_period_s: 0.002,
            end_early: true,
            judge: Judge::default(),
        }
    }
}

impl EpisodeConfig {
    /// How long an episode of a campaign goes on.
    pub fn until(&self) -> Until {
        if self.end_early { Until::Decided } else { Until::Fallen }
    }
}

/// What disturbs the robot in one episode. The controller knows nothing of it.
#[derive(Default)]
pub struct Disturbance {
    pub pushes: Vec<Push>,
    /// None: ideal sensors (the delay of the robot remains).
    pub sensor_errors: Option<SensorErrors>,
    /// How the simulated robot and its ground differ from those that the controller was designed for.
    pub variation: Variation,
}

/// Whether an episode goes on after it is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// Stop when settled (after the last push) or fallen.
    Decided,
    /// Stop when fallen.
    Fallen,
    /// Run to the horizon, whatever happens.
    Horizon,
}
