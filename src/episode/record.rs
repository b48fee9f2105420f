//! How an episode ended, and what is kept of it.

use super::footsteps::{Footstep, Lifted};
use serde::{Deserialize, Serialize};

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// Standing at the horizon: trunk upright, COM slow, DCM inside the support for the last half second.
    Recovered,
    /// A link other than the soles at the ground, or COM height or tilt out of bounds.
    Fell,
    /// Numbers not finite, or absurdly large.
    Diverged,
    /// None of these.
    TimedOut,
}

impl Outcome {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recovered => "recovered",
            Self::Fell => "fell",
            Self::Diverged => "diverged",
            Self::TimedOut => "timed out",
        }
    }
}

/// Where the slowest gain's maximal CPI set, the largest, has the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Membership {
    Inside,
    Outside,
    /// There is no set: nothing to stand on, or less than the margin of the gain set.
    Empty,
}

impl Membership {
    pub fn name(self) -> &'static str {
        match self {
            Membership::Inside => "inside",
            Membership::Outside => "outside",
            Membership::Empty => "empty",
        }
    }

    /// From the margin of [`crate::control::stand::Supervisor`].
    pub(super) fn of_margin(margin: f64) -> Self {
        match margin {
            m if m >= 0.0 => Membership::Inside,
            m if m.is_finite() => Membership::Outside,
            _ => Membership::Empty,
        }
    }
}

/// What is kept of an episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    pub outcome: Outcome,
    /// Simulated time (s).
    pub end_s: f64,
    pub fell_at_s: Option<f64>,
    /// What decided the fall, in words (e.g. the link that touched the ground).
    pub fall_cause: Option<String>,
    /// Start of the stretch of standing at which the episode was decided.
    pub settled_at_s: Option<f64>,
    /// Time after the last push from which the COM over the ground stays within `home_radius_m` of the middle of the
    /// soles' centres until the episode's end (the paper's convergence of the COG to the origin); None if it is not
    /// there at the end. An episode that ends early ends before the COM can leave again, or arrive.
    pub home_at_s: Option<f64>,
    pub peak_tilt_deg: f64,
    /// Largest joint torque, and its share of the limit.
    pub peak_torque_n_m: f64,
    pub peak_torque_ratio: f64,
    /// Time during which the mean torque of some joint over a tick was at its limit, the trunk within
    /// `standing_tilt_deg` of upright: beyond that it is the fall (s).
    pub torque_limited_s: f64,
    pub peak_joint_speed_rad_s: f64,
    /// Largest distance of the DCM outside of the support (m); 0 when it never left it.
    pub peak_dcm_outside_m: f64,
    /// Largest distance by which a sole that carries load (a tenth of the weight or more) has slid over the ground since it
    /// took up that load, the trunk within `standing_tilt_deg` of upright (m): rolling over its edge is not sliding.
    pub peak_slip_m: f64,
    /// Time at which the state first left every set.
    pub left_sets_at_s: Option<f64>,
    /// Whether the slowest gain's set holds the true state at the end of the last push (with the ZMP that the
    /// controller wants, on the support that it sees; both as when it last stood, if a foot is in the air by then: whether
    /// standing would have sufficed); None without gains.
    pub set_after_push: Option<Membership>,
    /// The margin of that set (negative: outside); None also where the set is empty.
    pub cpi_margin_after_push: Option<f64>,
    /// The same for the state as estimated, by which the controller chooses its gain.
    pub cpi_margin_after_push_est: Option<f64>,
    pub gain_switches: u32,
    pub footsteps: Vec<Footstep>,
    /// The footstep that was in the air at the fall, or at the end.
    pub unfinished_footstep: Option<Lifted>,
}
