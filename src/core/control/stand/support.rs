//! The support polygon: the convex hull of the soles in contact, in the control frame. Of each sole it has only the
//! part on which the ankle can hold its share of the weight. The paper, Sect. III.A: "the origin of the controller
//! coordinate is the center point of both feet". With one sole in contact that origin lies outside of the support
//! polygon, so no CPI set contains the state, and standing alone cannot recover the robot.

use crate::control::estimate::{Estimate, control_frame};
use crate::geometry::SupportPolygon;
use crate::robot::{Foot, PerFoot, Pose, Robot};
use nalgebra::{Isometry2, Point2, Vector2};

/// The control frame, and the support polygon in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Pose of the control frame in the world: its origin is midway between the soles' centres, and its x axis points
    /// along the mean heading of the feet.
    pub frame: Isometry2<f64>,
    /// Convex hull of the parts of the soles in contact on which the feet can press, control frame. None in flight.
    pub polygon: Option<SupportPolygon>,
}

impl Support {
    /// The support of the feet in contact, at their footholds.
    pub fn of(robot: &Robot, footholds: &PerFoot<Pose>, in_contact: &PerFoot<bool>) -> Self {
        Self::about(control_frame(footholds), robot, footholds, in_contact)
    }

    /// The support of the feet in contact, in the control frame `frame`.
    fn about(
        frame: Isometry2<f64>,
        robot: &Robot,
        footholds: &PerFoot<Pose>,
        in_contact: &PerFoot<bool>,
    ) -> Self {
        let mut corners = [Point2::origin(); 8];
        let mut count = 0;
        let feet = Foot::BOTH.into_iter().filter(|&f| in_contact[f]);
        let load_n = robot.weight_n() / feet.clone().count() as f64;
        for foot in feet {
            for corner in robot.soles[foot].pressable_corners(load_n) {
                corners[count] = frame.inverse_transform_point(&(footholds[foot] * corner).xy());
                count += 1;
            }
        }
        Self {
            frame,
            polygon: SupportPolygon::hull(&corners[..count]),
        }
    }

    /// The support according to an estimate.
    pub fn of_estimate(robot: &Robot, estimate: &Estimate) -> Self {
        Self::of(robot, &estimate.footholds, &estimate.in_contact)
    }

    /// The support according to an estimate of a robot that leans: the desired place of its COM is at `lean` (m, world
    /// frame) from the point midway between the soles' centres, and the origin of the frame is there.
    pub fn of_leaning(robot: &Robot, estimate: &Estimate, lean: Vector2<f64>) -> Self {
        let middle = control_frame(&estimate.footholds);
        let frame =
            Isometry2::from_parts((middle.translation.vector + lean).into(), middle.rotation);
        Self::about(frame, robot, &estimate.footholds, &estimate.in_contact)
    }
}
