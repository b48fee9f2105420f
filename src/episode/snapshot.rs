//! What there is to see of one tick: plain numbers, for whoever draws them.

use super::tick::{Tick, support_on_ground};
use crate::control::Phase;
use crate::control::estimate::on_ground;
use crate::robot::{Foot, PerFoot, Posture, Robot};
use nalgebra::{Isometry2, Point2, Point3, UnitQuaternion, Vector3};

/// One moment of an episode: the truth, and what the controller wants. World frame: what the controller wants is moved
/// there from the world as it estimates it, which drifts away where feet slip ([`to_world`]).
#[derive(Debug, Clone)]
pub struct Snapshot {
    pub time_s: f64,
    /// Of the simulated robot.
    pub posture: Posture,
    pub com: Point3<f64>,
    pub dcm: Point2<f64>,
    /// Its distance outside of the soles on the ground (m); negative inside, infinite in flight.
    pub dcm_outside_m: f64,
    /// From the simulated contacts; None in flight.
    pub zmp: Option<Point2<f64>>,
    /// The one that the controller wants.
    pub zmp_ref: Point2<f64>,
    /// Centre of each sole's contact face, on the ground or not.
    pub soles: PerFoot<Point3<f64>>,
    /// Corners of the hull of the soles on the ground, counter-clockwise; none in flight.
    pub support: Vec<Point2<f64>>,
    /// For each gain, slow to fast, the slice of its set over the COM, at the COM velocity as estimated and the ZMP wanted:
    /// the set holds the state while the estimated COM is over it. Corners, counter-clockwise; none where the set holds no such state, and
    /// for all gains while a foot is in the air: the supervisor rests then.
    pub slices: Vec<Vec<Point2<f64>>>,
    /// The gain that acts, index into those of the gain set; None without gains, or with a foot in the air.
    pub gain: Option<usize>,
    /// Margin of the slowest gain's set (1 at rest at home, negative when no set holds the state); None as for `gain`, and
    /// where there is no set.
    pub margin: Option<f64>,
    pub phase: Phase,
    /// Where the foot that is in the air is to land: corners of its sole.
    pub footstep: Option<[Point3<f64>; 4]>,
    /// Force of the ground on each sole (N), mean over the tick that ends, and its point; None where nothing presses.
    pub contacts: PerFoot<Option<Arrow>>,
    /// The force that pushes or pulls the robot, mean over the tick that ends; None if there is none.
    pub push: Option<Arrow>,
    /// Ground plane (through the origin) to world.
    pub slope: UnitQuaternion<f64>,
}

/// A force and its point of attack, world (N, m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrow {
    pub point: Point3<f64>,
    pub force: Vector3<f64>,
}

/// A sole that is pressed by less carries no load, and shows no force (N).
pub const LEAST_N: f64 = 0.5;

impl Snapshot {
    /// What a tick shows.
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
            support: support_on_ground(robot, truth).map_or_else(Vec::new, |polygon| polygon.vertices().to_vec()),
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

/// From the world as the controller estimates it to the world: what takes its estimate of the trunk over the ground to
/// where the trunk is.
pub fn to_world(tick: &Tick) -> Isometry2<f64> {
    on_ground(&tick.truth.posture.base) * on_ground(&tick.account.estimate.posture.base).inverse()
}

/// The force on a sole, at its centre of pressure.
fn contact(tick: &Tick, foot: Foot) -> Option<Arrow> {
    let (sole, wrench) = (&tick.truth.soles[foot], &tick.truth.sole_wrenches[foot]);
    let to_sole = sole.rotation.inverse();
    let (force, moment) = (to_sole * wrench.force, to_sole * wrench.moment);
    if force.z < LEAST_N {
        return None;
    }
    let center = Point3::new(-moment.y / force.z, moment.x / force.z, 0.0);
    Some(Arrow { point: sole * center, force: wrench.force })
}
