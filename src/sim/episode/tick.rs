//! One tick of a closed loop, as observers see it.

use crate::Truth;
use nalgebra::Point2;
use standfast_core::geometry::SupportPolygon;
use standfast_core::robot::{Foot, GRAVITY, PerFoot, Pose, Robot};
use standfast_core::socket::{Command, Controller, Report};

/// A failure that ends an episode at once, in words.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    OfController(String),
    OfSimulation(String),
}

/// One control tick as an observer sees it: the true state now (with averages over the past tick), and the controller's
/// response to its present readings.
pub struct Tick<'a> {
    pub truth: &'a Truth,
    /// True divergent component of motion (DCM, capture point), world frame.
    pub dcm: Point2<f64>,
    /// Convex hull of the soles on the ground, world frame; None in flight.
    pub support: Option<SupportPolygon>,
    /// Distance of the DCM from the support (m): negative inside, infinite in flight.
    pub dcm_outside_m: f64,
    /// What the controller did, and why.
    pub report: Report<'a>,
    /// The controller itself; None if the report has no controller.
    pub controller: Option<&'a dyn Controller>,
    pub command: &'a Command,
    /// The failure at this tick, if there is one.
    pub failure: Option<&'a Failure>,
    /// Whether the judge has decided the episode at an earlier tick.
    pub is_after: bool,
}

impl<'a> Tick<'a> {
    /// A tick of `robot`, whose pendulum has the natural frequency `omega` (rad/s).
    pub fn new(
        robot: &Robot,
        omega: f64,
        truth: &'a Truth,
        report: Report<'a>,
        command: &'a Command,
    ) -> Self {
        let dcm = truth.com.xy() + truth.com_vel.xy() / omega;
        let support = support_on_ground(robot, truth, GRAVITY / (omega * omega));
        let dcm_outside_m = support.map_or(f64::INFINITY, |polygon| polygon.signed_distance(dcm));
        let (controller, failure, is_after) = (None, None, false);
        Self {
            truth,
            dcm,
            support,
            dcm_outside_m,
            report,
            controller,
            command,
            failure,
            is_after,
        }
    }

    /// Whether the episode cannot go on: a number is not finite or absurdly large, or something failed.
    pub fn is_broken(&self) -> bool {
        self.failure.is_some() || !self.truth.is_finite()
    }
}

/// Convex hull of the soles on the ground, world frame, for a robot whose COM height at home is `com_height_m`; None in
/// flight.
fn support_on_ground(robot: &Robot, truth: &Truth, com_height_m: f64) -> Option<SupportPolygon> {
    /// A sole is on the ground if one of its corners is at most this high above it, in COM heights.
    const NEAR: f64 = 0.01;
    let mut corners = [Point2::origin(); 8];
    let mut count = 0;
    let placed = PerFoot::from_fn(|foot| {
        robot.soles[foot]
            .corners()
            .map(|corner| truth.soles[foot] * corner)
    });
    for foot in Foot::BOTH.into_iter().filter(|&f| {
        placed[f]
            .iter()
            .any(|c| c.z - truth.ground.height_m(c.xy()) < NEAR * com_height_m)
    }) {
        for corner in placed[foot] {
            corners[count] = corner.xy();
            count += 1;
        }
    }
    SupportPolygon::hull(&corners[..count])
}

/// Horizontal distance of the COM from the point midway between the soles' centres (m).
pub fn home_distance(com: Point2<f64>, soles: &PerFoot<Pose>) -> f64 {
    let middle = (soles.left.translation.vector.xy() + soles.right.translation.vector.xy()) / 2.0;
    (com.coords - middle).norm()
}
