//! One closed loop of plant and controller, and its judge.

use crate::robot::Foot;
use crate::sim::{Push, sensors::SensorErrors};
use serde::{Deserialize, Serialize};

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// Standing at the horizon: trunk upright, COM slow, DCM inside the support for the last half second.
    Recovered,
    /// A link other than the soles at the ground, or COM height or tilt out of bounds.
    Fell,
    /// Numbers not finite.
    Diverged,
    /// None of these.
    TimedOut,
}

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
}

impl Default for Judge {
    fn default() -> Self {
        Self {
            standing_tilt_deg: 10.0,
            standing_com_speed_m_s: 0.02,
            standing_time_s: 0.5,
            fallen_tilt_deg: 60.0,
            fallen_com_height_ratio: 0.6,
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
    pub judge: Judge,
}

impl Default for EpisodeConfig {
    fn default() -> Self {
        Self { horizon_s: 6.0, physics_step_s: 0.001, control_period_s: 0.002, judge: Judge::default() }
    }
}

/// What disturbs the robot in one episode.
pub struct Disturbance {
    pub pushes: Vec<Push>,
    /// None: ideal sensors (the delay of the robot remains).
    pub sensor_errors: Option<SensorErrors>,
}

/// Whether an episode goes on after it is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// Stop when settled (after the last push) or fallen.
    Decided,
    /// Run to the horizon, whatever happens.
    Horizon,
}

/// A footstep that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Footstep {
    pub foot: Foot,
    pub lift_s: f64,
    pub land_s: f64,
    /// Centre of the sole in the world, at lift and at landing.
    pub from_m: [f64; 3],
    pub to_m: [f64; 3],
    /// Whether the state at landing was inside a set of the new support.
    pub in_set_at_landing: bool,
}

/// What is kept of an episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    pub outcome: Outcome,
    /// Simulated time [s].
    pub end_s: f64,
    pub fell_at_s: Option<f64>,
    /// What decided the fall, in words (e.g. the link that touched the ground).
    pub fall_cause: Option<String>,
    /// Start of the stretch of standing at which the episode was decided.
    pub settled_at_s: Option<f64>,
    pub peak_tilt_deg: f64,
    /// Largest joint torque, and its share of the limit.
    pub peak_torque_n_m: f64,
    pub peak_torque_ratio: f64,
    pub peak_joint_speed_rad_s: f64,
    /// Largest distance of the DCM outside of the support [m]; 0 when it never left it.
    pub peak_dcm_outside_m: f64,
    /// Time at which the state first left every set.
    pub left_sets_at_s: Option<f64>,
    /// Largest margin of the slowest gain's set at the end of the last push (negative: outside).
    pub cpi_margin_after_push: Option<f64>,
    pub gain_switches: u32,
    pub footsteps: Vec<Footstep>,
}
