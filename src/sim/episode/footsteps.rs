//! The footsteps of an episode, for its record.

use serde::{Deserialize, Serialize};
use standfast_core::robot::{Foot, PerFoot, Pose};
use standfast_core::socket::{Airborne, Report};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Footstep {
    pub foot: Foot,
    /// Times of the ticks at which the controller lifts the foot and takes it as landed.
    pub lift_s: f64,
    pub land_s: f64,
    /// Centre of the sole in the world frame, at lift and at landing.
    pub from_m: [f64; 3],
    pub to_m: [f64; 3],
    /// The ZMP error for which the footstep was taken, in the control frame at the lift (x forward, y left), and
    /// whether the state at landing was in a CPI set of the new support. None if the controller does not say.
    pub zmp_error_m: Option<[f64; 2]>,
    pub in_set_at_landing: Option<bool>,
}

/// A lifted foot. The fields have the meanings of the fields of [`Footstep`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lifted {
    pub foot: Foot,
    pub lift_s: f64,
    pub from_m: [f64; 3],
    pub zmp_error_m: Option<[f64; 2]>,
}

/// The footsteps of an episode up to now. A stored trial has the first two fields, which are columns, and no details.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FootstepLog {
    /// Number of completed footsteps.
    #[serde(rename = "footsteps")]
    pub count: u32,
    /// The foot that is in the air, at the fall or at the end.
    pub unfinished_footstep: Option<Foot>,
    /// The completed footsteps in detail.
    #[serde(skip)]
    pub taken: Vec<Footstep>,
    /// The foot in the air in detail.
    #[serde(skip)]
    pub lifted: Option<Lifted>,
}

impl FootstepLog {
    /// Takes note of a tick: the poses of the soles, and the controller's report.
    pub fn watch(&mut self, time_s: f64, soles: &PerFoot<Pose>, report: &Report) {
        let center = |foot: Foot| soles[foot].translation.vector.into();
        match (report.footstep, self.lifted) {
            (Some(Airborne { foot, .. }), None) => {
                self.lifted = Some(Lifted {
                    foot,
                    lift_s: time_s,
                    from_m: center(foot),
                    zmp_error_m: report.zmp_error.map(Into::into),
                });
            }
            (
                None,
                Some(Lifted {
                    foot,
                    lift_s,
                    from_m,
                    zmp_error_m,
                }),
            ) => {
                self.lifted = None;
                self.taken.push(Footstep {
                    foot,
                    lift_s,
                    land_s: time_s,
                    from_m,
                    to_m: center(foot),
                    zmp_error_m,
                    in_set_at_landing: report.in_cpi_set,
                });
            }
            _ => {}
        }
        self.count = self.taken.len() as u32;
        self.unfinished_footstep = self.lifted.map(|lifted| lifted.foot);
    }

    /// Whether a foot was lifted.
    pub fn has_begun(&self) -> bool {
        self.count > 0 || self.unfinished_footstep.is_some()
    }
}
