//! The footsteps of an episode, for its record.

use crate::control::{Account, Phase};
use crate::robot::{Foot, PerFoot, Pose};
use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Footstep {
    pub foot: Foot,
    /// Times of the ticks at which the controller lifts the foot and takes it as landed.
    pub lift_s: f64,
    pub land_s: f64,
    /// Centre of the sole in the world frame, at lift and at landing.
    pub from_m: [f64; 3],
    pub to_m: [f64; 3],
    /// The ZMP error for which the footstep was taken, in the control frame at the lift (x forward, y left).
    pub zmp_error_m: [f64; 2],
    /// Whether the state at landing was in a CPI set of the new support.
    pub in_set_at_landing: bool,
}

/// A lifted foot. The fields are those of [`Footstep`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lifted {
    pub foot: Foot,
    pub lift_s: f64,
    pub from_m: [f64; 3],
    pub zmp_error_m: [f64; 2],
}

/// The footsteps of an episode up to now.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FootstepLog {
    pub taken: Vec<Footstep>,
    pub unfinished: Option<Lifted>,
}

impl FootstepLog {
    /// Takes note of a tick: the poses of the soles, and what the controller did.
    pub fn watch(&mut self, time_s: f64, soles: &PerFoot<Pose>, account: &Account) {
        let center = |foot: Foot| soles[foot].translation.vector.into();
        match (account.swing, self.unfinished) {
            (Some(swing), None) => {
                let (foot, zmp_error) = (swing.footstep.foot, swing.footstep.zmp_error);
                let lifted = Lifted { foot, lift_s: time_s, from_m: center(foot), zmp_error_m: zmp_error.into() };
                self.unfinished = Some(lifted);
            }
            (None, Some(Lifted { foot, lift_s, from_m, zmp_error_m })) => {
                self.unfinished = None;
                self.taken.push(Footstep {
                    foot,
                    lift_s,
                    land_s: time_s,
                    from_m,
                    to_m: center(foot),
                    zmp_error_m,
                    in_set_at_landing: account.phase == Phase::Switching,
                });
            }
            _ => {}
        }
    }
}
