//! The size of a robot in relation to UT-mu2, for which the window and pages were made. Marks grow with the
//! length of the robot, and the pull of the mouse with its weight.

use standfast_core::robot::Robot;

/// UT-mu2 at home: height of its COM (m), and its mass (kg).
const COM_HEIGHT_M: f64 = 0.31;
const MASS_KG: f64 = 8.0;

/// Length and mass of a robot as multiples of UT-mu2's. Since gravity is the same for all robots, forces scale with the
/// mass, and speeds with the square root of the length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotScale {
    pub length: f64,
    pub mass: f64,
}

impl RobotScale {
    /// The scale of a robot, by its COM height at home and its mass.
    pub fn of(robot: &Robot) -> Self {
        Self {
            length: robot.home_com_height() / COM_HEIGHT_M,
            mass: robot.mass() / MASS_KG,
        }
    }

    /// Factor for lengths.
    pub fn length(self) -> f64 {
        self.length
    }

    /// Factor for forces.
    pub fn force(self) -> f64 {
        self.mass
    }

    /// Factor for forces per length.
    pub fn stiffness(self) -> f64 {
        self.mass / self.length
    }

    /// Factor for impulses.
    pub fn impulse(self) -> f64 {
        self.mass * self.length.sqrt()
    }

    /// Length at which a force is drawn (m/N), from the length for UT-mu2.
    pub fn m_per_n(self, m_per_n: f64) -> f64 {
        m_per_n / self.stiffness()
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A robot three times as long, of the same density.
    pub const THRICE: RobotScale = RobotScale {
        length: 3.0,
        mass: 27.0,
    };

    #[test]
    fn all_factors_are_one_for_ut_mu2() {
        let scale = RobotScale::of(&standfast_robots::load("ut-mu2").unwrap());
        for one in [
            scale.length(),
            scale.force(),
            scale.stiffness(),
            scale.impulse(),
        ] {
            assert!((one - 1.0).abs() < 0.01, "{scale:?}");
        }
    }

    /// A push moves the capture point by `impulse / (mass omega)`, and a steady pull moves the COM by `force / (mass
    /// omega^2)`, where omega is sqrt(g / length). Both must be the same share of the length for robots of any size.
    #[test]
    fn pushes_and_pulls_move_robots_of_any_size_by_the_same_share() {
        let omega = 3.0_f64.sqrt().recip();
        assert!((THRICE.impulse() / (27.0 * omega) - 3.0).abs() < 1e-9);
        assert!((THRICE.force() / (27.0 * omega * omega) - 3.0).abs() < 1e-9);
        assert!((THRICE.stiffness() * THRICE.length() - THRICE.force()).abs() < 1e-9);
    }
}
