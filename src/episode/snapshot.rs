//! What can be seen of one tick, as plain numbers for pictures and replays.

use super::tick::Tick;
use crate::control::Phase;
use crate::control::estimate::on_ground;
use crate::robot::{Foot, PerFoot, Posture, Robot};
use nalgebra::{Isometry2, Point2, Point3, UnitQuaternion, Vector3};

/// One moment of an episode: the true state, and what the controller intends, both in the world frame. The latter is
/// moved there from the controller's own estimate of the world, which drifts when feet slip ([`to_world`]).
#[derive(Debug, Clone)]
pub struct Snapshot {
    pub time_s: f64,
    /// Posture of the simulated robot.
    pub posture: Posture,
    pub com: Point3<f64>,
    pub dcm: Point2<f64>,
    /// Distance of the DCM from the support polygon of the soles on the ground (m): negative inside, infinite in
    /// flight.
    pub dcm_outside_m: f64,
    /// ZMP of the simulated contacts; None in flight.
    pub zmp: Option<Point2<f64>>,
    pub zmp_ref: Point2<f64>,
    /// Centre of each sole's contact face, on the ground or not.
    pub soles: PerFoot<Point3<f64>>,
    /// Corners of the support polygon, counter-clockwise; empty in flight.
    pub support: Vec<Point2<f64>>,
    /// For each gain, from slow to fast, the slice of its CPI set over COM positions, at the estimated COM velocity and
    /// the desired ZMP. The set contains the state while the estimated COM lies in the slice. Corners are
    /// counter-clockwise. A slice is empty if the set contains no such state; with a foot in the air there are no
    /// slices, since the supervisor then rests.
    pub slices: Vec<Vec<Point2<f64>>>,
    /// Index of the acting gain, from slow to fast; None without gains or with a foot in the air.
    pub gain: Option<usize>,
    /// Margin in the slowest gain's CPI set: 1 at rest at home, and negative when no set contains the state. None where
    /// `gain` is None, and if there is no set.
    pub margin: Option<f64>,
    pub phase: Phase,
    /// Corners of the sole where the foot in the air is to land.
    pub footstep: Option<[Point3<f64>; 4]>,
    /// Force of the ground on each sole (N), averaged over the past tick, at the centre of pressure; None without load.
    pub contacts: PerFoot<Option<Arrow>>,
    /// The pushing or pulling force on the robot, averaged over the past tick; None if there is none.
    pub push: Option<Arrow>,
    /// Orientation of the ground plane, which passes through the origin, in the world.
    pub slope: UnitQuaternion<f64>,
}

/// A force (N) and the point where it acts (m), world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrow {
    pub point: Point3<f64>,
    pub force: Vector3<f64>,
}

/// A sole with less load than this shows no force (N).
pub const LEAST_N: f64 = 0.5;

impl Snapshot {
    pub fn of(robot: &Robot, tick: &Tick) -> Self {
        let (truth, account) = (tick.truth, &tick.account);
        let gain = account.gain.filter(|_| account.stands());
        let force = truth.push_force;
        let to_world = to_world(tick);
        let slice = |slice: &Vec<Point2<f64>>| slice.iter().map(|corner| to_world * corner).collect();
        let landing = |corner: Point3<f64>| {
            let place = to_world * corner.xy();
            Point3::new(place.x, place.y, corner.z)
        };
        Self {
            time_s: truth.time_s,
            posture: truth.posture.clone(),
            com: truth.com,
            dcm: tick.dcm,
            dcm_outside_m: tick.dcm_outside_m,
            zmp: truth.zmp.map(Point2::from),
            zmp_ref: to_world * account.zmp_ref,
            soles: PerFoot::from_fn(|foot| truth.soles[foot].translation.vector.into()),
            support: tick.support.map_or_else(Vec::new, |polygon| polygon.vertices().to_vec()),
            slices: if account.stands() { account.slices().iter().map(slice).collect() } else { Vec::new() },
            gain,
            margin: gain.map(|_| account.margin).filter(|margin| margin.is_finite()),
            phase: account.phase,
            footstep: account.swing.map(|swing| swing.landing_corners(robot).map(landing)),
            contacts: PerFoot::from_fn(|foot| contact(tick, foot)),
            push: (force.norm() > 0.0).then_some(Arrow { point: truth.push_point, force }),
            slope: truth.ground.slope,
        }
    }
}

/// The transform from the world as the controller estimates it to the true world: it moves the estimated horizontal
/// pose of the robot's base to the true one.
pub fn to_world(tick: &Tick) -> Isometry2<f64> {
    on_ground(&tick.truth.posture.base) * on_ground(&tick.account.estimate.posture.base).inverse()
}

/// The force on a sole, at its centre of pressure.
pub(super) fn contact(tick: &Tick, foot: Foot) -> Option<Arrow> {
    let (sole, wrench) = (&tick.truth.soles[foot], &tick.truth.sole_wrenches[foot]);
    let to_sole = sole.rotation.inverse();
    let (force, moment) = (to_sole * wrench.force, to_sole * wrench.moment);
    if force.z < LEAST_N {
        return None;
    }
    let center = Point3::new(-moment.y / force.z, moment.x / force.z, 0.0);
    Some(Arrow { point: sole * center, force: wrench.force })
}
