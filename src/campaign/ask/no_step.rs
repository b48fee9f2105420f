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
    use crate::campaign::limit::Yardstick;
    use crate::campaign::{Campaign, Overrides};

    /// The bound of `limit` without the factor of the push's duration.
    #[test]
    fn it_is_the_bound_without_a_footstep() {
        let robot = Robot::load("ut-mu2").unwrap();
        let yardstick = Yardstick::new(&robot, &Campaign::load("nominal", &Overrides::default()).unwrap()).unwrap();
        let no_step = NoStep::new(&robot);
        for heading_deg in [-135.0, -20.0, 0.0, 70.0, 90.0, 180.0] {
            let bound = yardstick.heading(heading_deg).unwrap().bound_no_step_n_s / yardstick.push_factor;
            let found = no_step.impulse_n_s(heading_deg).unwrap();
            println!("{heading_deg}: {found} N s");
            assert!((found - bound).abs() < 1e-9, "{heading_deg}: {found}, not {bound}");
        }
        let beside = NoStep { com: no_step.com + Vector2::new(0.2, 0.0), ..no_step };
        assert_eq!([0.0, 180.0].map(|heading_deg| beside.impulse_n_s(heading_deg)), [None, None]);
    }
}
