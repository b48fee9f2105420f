//! A measure of pushes by which robots and headings can be compared: the impulse divided by m omega d, with mass m,
//! natural frequency omega, and the distance d from the COM at home to the edge of the support polygon in the heading
//! of the push. It is 1 for the largest instantaneous push without a footstep: such a push shifts the DCM by impulse /
//! (m omega), and the ZMP can follow it as far as the edge.

use nalgebra::{Point2, Vector2};
use standfast_core::control::home_polygon;
use standfast_core::geometry::SupportPolygon;
use standfast_core::robot::{Kinematics, Robot};

/// A robot at home, as designed.
pub struct StandingBound {
    support: SupportPolygon,
    com: Point2<f64>,
    m_omega_kg_s: f64,
}

impl StandingBound {
    pub fn new(robot: &Robot) -> Self {
        let kinematics = Kinematics::at_home(robot);
        Self {
            support: home_polygon(robot),
            com: kinematics.com().xy(),
            m_omega_kg_s: robot.mass() * robot.omega(),
        }
    }

    /// m omega d for a heading (degrees; 0 is forward, 90 to the left), in N s; None if the COM is not above the
    /// support.
    pub fn impulse_n_s(&self, heading_deg: f64) -> Option<f64> {
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let d = self
            .support
            .distance_along(self.com, Vector2::new(cos, sin));
        d.filter(|&d| d > 0.0 && self.support.contains(self.com))
            .map(|d| self.m_omega_kg_s * d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_com_beside_the_support_has_no_bound() {
        let no_step = StandingBound::new(&standfast_robots::load("ut-mu2").unwrap());
        let beside = StandingBound {
            com: no_step.com + Vector2::new(0.2, 0.0),
            ..no_step
        };
        assert_eq!(
            [0.0, 180.0].map(|heading_deg| beside.impulse_n_s(heading_deg)),
            [None, None]
        );
    }
}
