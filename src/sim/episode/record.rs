//! Outcome and record of an episode.

use super::footsteps::FootstepLog;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser};
use std::collections::BTreeMap;

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Outcome {
    /// At the end of the episode the robot had stood for the judge's time: trunk upright, COM slow, DCM inside of the
    /// support polygon.
    Recovered,
    /// At the horizon the robot had not fallen, but did not stand either, and the judge [counts](super::Counts) this as
    /// won.
    Survived,
    /// A link other than the soles touched the ground, the COM was too low, or the trunk was tilted too far.
    Fell,
    /// A sole bore more than the judge's limit.
    Broke,
    /// A number of the simulation became NaN, infinite or absurdly large, or the simulation failed (a panic).
    Diverged,
    /// The controller failed: its process died, did not answer or answered nonsense, or its command was invalid.
    Failed,
    /// At the horizon the robot had neither fallen nor recovered, and the judge does not count this as won. An episode
    /// has this outcome until it has another one.
    #[default]
    TimedOut,
}

impl Outcome {
    pub const ALL: [Self; 7] = [
        Self::Recovered,
        Self::Survived,
        Self::Fell,
        Self::Broke,
        Self::Diverged,
        Self::Failed,
        Self::TimedOut,
    ];

    /// Whether the trial was won.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Recovered | Self::Survived)
    }

    /// Whether the robot fell or broke, after which nothing is recorded of it.
    pub fn is_lost(self) -> bool {
        matches!(self, Self::Fell | Self::Broke)
    }

    /// The outcome in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recovered => "recovered",
            Self::Survived => "survived",
            Self::Fell => "fell",
            Self::Broke => "broke",
            Self::Diverged => "diverged",
            Self::Failed => "failed",
            Self::TimedOut => "timed out",
        }
    }
}

/// Where a state lies with respect to the states from which a controller promises to recover by standing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Membership {
    Inside,
    Outside,
    /// The controller promises no states: no sole is in contact, or the support is too small.
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

    /// From the margin among these states; see [`Promise`](standfast_core::socket::Promise).
    pub fn of_margin(margin: f64) -> Self {
        match margin {
            m if m >= 0.0 => Membership::Inside,
            m if m.is_finite() => Membership::Outside,
            _ => Membership::Empty,
        }
    }
}

/// The record of an episode. A number has its unit in its name; angles are in degrees, other quantities are in the
/// world frame. The fields have the names of the columns of `trials.parquet`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Record {
    pub outcome: Outcome,
    /// Simulated time (s).
    pub end_s: f64,
    /// Time at which it fell or broke (s).
    pub fell_at_s: Option<f64>,
    /// The cause of the fall in words, for example the link that touched the ground. For a trial that broke, diverged or
    /// failed, it is the cause of that.
    pub fall_cause: Option<String>,
    /// Start of the time of standing that decided the episode.
    pub settled_at_s: Option<f64>,
    /// Time after the last push from which the COM stays, until the end, within `home_radius_m` (horizontally) of the
    /// point midway between the soles' centres; the paper speaks of the COG converging to the origin. None if the COM
    /// is not there at the end. An episode that ends early may end before the COM arrives, or leaves again.
    pub home_at_s: Option<f64>,
    /// Speed of the COM (m/s) when the first push starts, which should find a robot at rest. None without a push.
    pub com_speed_at_push_m_s: Option<f64>,
    pub peak_tilt_deg: f64,
    /// The lowest height of the COM above the ground, as a share of its height at home. Like all peaks, it ends with a
    /// fall.
    pub lowest_com_height_ratio: Option<f64>,
    /// Largest joint torque, and the largest share of a joint's torque limit, each averaged over a tick. The servo
    /// chooses a torque within its limit at the start of a physics step, and its damping follows the speed within the
    /// step. The share is therefore larger than 1 if an impact changes the speed of a joint by more than its
    /// `full_torque_speed_rad_s` in one step, or if its damping is so large for its rotor that it would be unstable
    /// otherwise. The excess is subtracted from the limit of the next steps.
    pub peak_torque_n_m: f64,
    pub peak_torque_ratio: f64,
    /// Time (s) during which the torque of some joint, averaged over a tick, was at its limit. Only ticks with the
    /// trunk within `standing_tilt_deg` of upright count; all other ticks belong to the fall.
    pub torque_limited_s: f64,
    pub peak_joint_speed_rad_s: f64,
    /// Largest load of a sole (N), and the largest share of a motor's torque limit that its gear bore
    /// ([`PeakLoads`](crate::loads::PeakLoads)). None in the results of earlier versions.
    pub peak_sole_force_n: Option<f64>,
    pub peak_gear_torque_ratio: Option<f64>,
    /// Largest distance of the DCM from the support polygon (m); 0 if the DCM never left it.
    pub peak_dcm_outside_m: f64,
    /// Largest distance (m) that a sole under load (a tenth of the weight or more) has slid on the ground since the
    /// load began. Only ticks with the trunk within `standing_tilt_deg` of upright count. Rolling is not sliding.
    pub peak_slip_m: f64,
    /// Time at which the legs first met before a fall, and the names of the two links.
    pub legs_met_at_s: Option<f64>,
    pub legs_met: Option<String>,
    /// Margin of the true state at the end of the last push among the states from which the controller promises to
    /// recover by standing: 1 for rest at home, negative outside, and negative infinity if there were no such states.
    /// If a foot was in the air at the end of the push, these are the states when the robot last stood. None without a
    /// promise.
    pub promise_margin: Option<f64>,
    /// The margin of the estimated state, by which the controller acts.
    pub promise_margin_est: Option<f64>,
    pub footsteps: FootstepLog,
    /// The last totals of the controller's reports before a fall.
    pub totals: Totals,
}

/// How long plots, films and pictures go on after the robot has come to stand still (s).
const REST_S: f64 = 0.5;

impl Record {
    /// Time (s) after which nothing of interest happens: the time of the fall or, with `REST_S` to spare, the time at
    /// which the robot stands still and, if it gets home, is home.
    pub fn end_of_interest_s(&self) -> f64 {
        let settled_s = self
            .settled_at_s
            .map(|settled_at_s| settled_at_s.max(self.home_at_s.unwrap_or(settled_at_s)) + REST_S);
        self.fell_at_s.or(settled_s).unwrap_or(self.end_s)
    }
}

/// Numbers that a controller reports for a whole episode, by their names. A file has them as the text of one JSON
/// object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Totals(pub BTreeMap<String, f64>);

impl Serialize for Totals {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(&self.0).map_err(ser::Error::custom)?)
    }
}

impl<'de> Deserialize<'de> for Totals {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::read(&String::deserialize(from)?).map_err(de::Error::custom)
    }
}

impl Totals {
    /// Reads the text in a file. An empty text has no totals.
    pub fn read(text: &str) -> serde_json::Result<Self> {
        if text.is_empty() {
            Ok(Self::default())
        } else {
            serde_json::from_str(text).map(Self)
        }
    }

    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied()
    }
}
