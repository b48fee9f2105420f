//! What the robot stands on: the support polygon of the soles in contact, in the control frame (paper, Sect. III.A:
//! "the origin of the controller coordinate is the center point of both feet"). With one sole in contact that point is
//! outside of the support, so no set holds the state: a robot that only stands has nothing to fall back on there.

use crate::control::estimate::{Estimate, control_frame};
use crate::geometry::SupportPolygon;
use crate::robot::{Foot, PerFoot, Pose, Robot};
use nalgebra::{Isometry2, Point2};

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
