//! What the robot stands on: the support polygon of the soles in contact, in the control frame (paper, Sect. III.A:
//! "the origin of the controller coordinate is the center point of both feet"). With one sole in contact that point is
//! outside of the support, so no set holds the state: a robot that only stands has nothing to fall back on there.

use super::estimator::{Estimate, heading};
use crate::geometry::SupportPolygon;
use crate::robot::{Foot, PerFoot, Pose, Robot};
use nalgebra::{Isometry2, Point2, Vector2};

/// The control frame and the support in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Control frame to world: midway between the soles' centres, x along the mean heading of the feet.
    pub frame: Isometry2<f64>,
    /// Hull of the soles in contact, control frame; None in flight.
    pub polygon: Option<SupportPolygon>,
}

impl Support {
    /// Support of the feet in contact, at their footholds.
    pub fn of(robot: &Robot, footholds: &PerFoot<Pose>, in_contact: &PerFoot<bool>) -> Self {
        let frame = control_frame(footholds);
        let mut corners = [Point2::origin(); 8];
        let mut count = 0;
        for foot in Foot::BOTH.into_iter().filter(|&f| in_contact[f]) {
            for corner in robot.soles[foot].corners() {
                corners[count] = frame.inverse_transform_point(&(footholds[foot] * corner).xy());
                count += 1;
            }
        }
        Self { frame, polygon: SupportPolygon::hull(&corners[..count]) }
    }

    /// Support of an estimate.
    pub fn of_estimate(robot: &Robot, estimate: &Estimate) -> Self {
        Self::of(robot, &estimate.footholds, &estimate.in_contact)
    }
}

/// Control frame to world.
pub fn control_frame(footholds: &PerFoot<Pose>) -> Isometry2<f64> {
    let middle = (footholds.left.translation.vector.xy() + footholds.right.translation.vector.xy()) / 2.0;
    let [left, right] = [heading(&footholds.left), heading(&footholds.right)];
    // Mean of two directions, safe at the turn from pi to -pi.
    let sum = Vector2::new(left.cos() + right.cos(), left.sin() + right.sin());
    Isometry2::new(middle, sum.y.atan2(sum.x))
}
