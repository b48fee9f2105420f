//! What can be seen of one tick, as plain numbers for pictures and replays.

use super::tick::Tick;
use nalgebra::{Isometry2, Point2, Point3, UnitQuaternion, Vector3};
use standfast_core::robot::kinematics::on_ground;
use standfast_core::robot::{Foot, PerFoot, Posture, Robot};
use standfast_core::socket::{Airborne, RecoveryRegion};

/// One moment of an episode: the true state, and the intentions of the controller, both in the world frame. The
/// intentions are moved there from the controller's own estimate of the world, which drifts when feet slip
/// ([`to_world`]).
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
    /// The ZMP that the controller wants, if it says so.
    pub zmp_ref: Option<Point2<f64>>,
    /// Centre of each sole's contact face, on the ground or not.
    pub soles: PerFoot<Point3<f64>>,
    /// Corners of the support polygon, counter-clockwise; empty in flight.
    pub support: Vec<Point2<f64>>,
    /// Regions that the controller promises: COM positions from which it recovers by standing. For a controller with
    /// feedback gains, these are the slices of the gains' CPI sets from slow to fast, at the estimated COM velocity and
    /// the desired ZMP. Corners are counter-clockwise. A region may be empty, and there are no regions with a foot in
    /// the air.
    pub regions: Vec<RecoveryRegion>,
    /// Name of the acting gain; None for a controller without gains, and with a foot in the air.
    pub gain: Option<String>,
    /// Margin in the slowest gain's CPI set: 1 at rest at home, and negative when no CPI set contains the state. None
    /// without gains, with a foot in the air, and if there is no CPI set.
    pub margin: Option<f64>,
    /// What the controller is doing, in one word.
    pub phase: String,
    /// The foot in the air.
    pub in_air: Option<Foot>,
    /// Corners of the sole where the foot in the air is to land.
    pub footstep: Option<[Point3<f64>; 4]>,
    /// Force of the ground on each sole (N), averaged over the past tick, at the centre of pressure; None without load.
    pub contacts: PerFoot<Option<Arrow>>,
    /// The pushing or pulling force on the robot, averaged over the past tick; None if there is none.
    pub push: Option<Arrow>,
    /// Pivot of the rope of a push by a pendulum, and centre of its bob (m), until the bob is caught.
    pub rope: Option<[Point3<f64>; 2]>,
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
        let (truth, report) = (tick.truth, &tick.report);
        let force = truth.push_force;
        let to_world = to_world(tick);
        let mut regions = report
            .promise
            .map_or_else(Vec::new, |promise| promise.regions());
        for corner in regions.iter_mut().flat_map(|region| &mut region.corners) {
            *corner = to_world * *corner;
        }
        Self {
            time_s: truth.time_s,
            posture: truth.posture.clone(),
            com: truth.com,
            dcm: tick.dcm,
            dcm_outside_m: tick.dcm_outside_m,
            zmp: truth.zmp.map(Point2::from),
            zmp_ref: report.zmp_ref.map(|zmp_ref| to_world * zmp_ref),
            soles: PerFoot::from_fn(|foot| truth.soles[foot].translation.vector.into()),
            support: tick
                .support
                .map_or_else(Vec::new, |polygon| polygon.vertices().to_vec()),
            regions,
            gain: report
                .gain
                .filter(|_| report.footstep.is_none())
                .map(String::from),
            margin: report.cpi_margin.filter(|margin| margin.is_finite()),
            phase: report.phase.into(),
            in_air: report.footstep.map(|footstep| footstep.foot),
            footstep: report.footstep.map(|Airborne { foot, landing }| {
                robot.soles[foot].corners().map(|corner| {
                    let corner = landing * corner;
                    let place = to_world * corner.xy();
                    Point3::new(place.x, place.y, corner.z)
                })
            }),
            contacts: PerFoot::from_fn(|foot| contact(tick, foot)),
            push: (force.norm() > 0.0).then_some(Arrow {
                point: truth.push_point,
                force,
            }),
            rope: truth.rope(),
            slope: truth.ground.slope,
        }
    }
}

/// Transform from the world as the controller estimates it to the true world: the transform moves the estimated
/// horizontal pose of the robot's base to the true pose. It is the identity for a controller that estimates no pose.
pub fn to_world(tick: &Tick) -> Isometry2<f64> {
    let Some(base) = &tick.report.base else {
        return Isometry2::identity();
    };
    on_ground(&tick.truth.posture.base) * on_ground(base).inverse()
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
    Some(Arrow {
        point: sole * center,
        force: wrench.force,
    })
}
