//! A motion as its picture shows it: plain samples over time, whether they come from an episode or from a calculation.

use crate::episode::imposed::ImposedTick;
use crate::episode::snapshot::to_world;
use crate::episode::{Tick, support_on_ground};
use crate::geometry::SupportPolygon;
use crate::robot::{PerFoot, Robot};

/// One moment of a motion, from an episode or from a calculation. World frame (m).
#[derive(Debug, Clone)]
pub struct MotionSample {
    pub time_s: f64,
    /// COM over the ground.
    pub com: [f64; 2],
    /// None in flight.
    pub zmp: Option<[f64; 2]>,
    /// The ZMP that the controller wants.
    pub zmp_ref: [f64; 2],
    pub dcm: [f64; 2],
    /// Centre of each sole, on the ground or not.
    pub feet: PerFoot<[f64; 2]>,
    /// Hull of the soles on the ground; None in flight.
    pub support: Option<SupportPolygon>,
    /// A footstep is in the air.
    pub swing: bool,
}

impl MotionSample {
    /// The truth of a tick, and the ZMP that the controller wants, moved to where the robot is.
    pub fn of(robot: &Robot, tick: &Tick) -> Self {
        let truth = tick.truth;
        Self {
            time_s: truth.time_s,
            com: truth.com.xy().into(),
            zmp: truth.zmp,
            zmp_ref: (to_world(tick) * tick.account.zmp_ref).into(),
            dcm: tick.dcm.into(),
            feet: PerFoot::from_fn(|foot| truth.soles[foot].translation.vector.xy().into()),
            support: support_on_ground(robot, truth),
            swing: !tick.account.stands(),
        }
    }

    /// The ideal pendulum of an imposed error; its ZMP is the one wanted.
    pub fn of_imposed(tick: &ImposedTick) -> Self {
        let zmp = tick.zmp.into();
        Self {
            time_s: tick.time_s,
            com: tick.com.into(),
            zmp: Some(zmp),
            zmp_ref: zmp,
            dcm: tick.dcm.into(),
            feet: PerFoot::from_fn(|foot| tick.soles[foot].translation.vector.xy().into()),
            support: tick.support,
            swing: !tick.account.stands(),
        }
    }
}
