//! The measure of a push that compares robots and headings: its impulse over m omega d, d being the way from the COM
//! at home to the edge of the support at home towards which the push goes. 1 is what an instantaneous push may be
//! without a footstep: it moves the DCM by impulse / (m omega), and to the edge the ZMP can follow.

use crate::control::home_polygon;
use crate::geometry::SupportPolygon;
use crate::robot::{Kinematics, Robot};
use nalgebra::{Point2, Vector2};

/// A robot at home, as designed.
pub struct NoStep {
    support: SupportPolygon,
    com: Point2<f64>,
    m_omega_kg_s: f64,
}

impl NoStep {
    pub fn new(robot: &Robot) -> Self {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        Self { support: home_polygon(robot), com: kinematics.com().xy(), m_omega_kg_s: robot.mass() * robot.omega() }
    }

    /// m omega d along a heading (degrees; 0 forward, 90 to the left), in N s; None if the COM is not above the support.
    pub fn impulse_n_s(&self, heading_deg: f64) -> Option<f64> {
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let d = self.support.distance_along(self.com, Vector2::new(cos, sin));
        d.filter(|&d| d > 0.0 && self.support.contains(self.com)).map(|d| self.m_omega_kg_s * d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_com_beside_the_support_has_no_bound() {
        let no_step = NoStep::new(&Robot::load("ut-mu2").unwrap());
        let beside = NoStep { com: no_step.com + Vector2::new(0.2, 0.0), ..no_step };
        assert_eq!([0.0, 180.0].map(|heading_deg| beside.impulse_n_s(heading_deg)), [None, None]);
    }
}
