//! The size of a robot in relation to UT-mu2, for which the window, pages and pictures were made. Marks grow with the
//! length of the robot, and the pull of the mouse with its weight.

use crate::robot::{Robot, Units};
use crate::sim::Push;

/// UT-mu2 at home: height of its COM (m), and its mass (kg).
const COM_HEIGHT_M: f64 = 0.31;
const MASS_KG: f64 = 8.0;
/// Default impulse of the window and the command line for a robot of this size (N s).
const FIRST_PUSH_N_S: f64 = 5.0;

/// Length and mass of a robot as multiples of UT-mu2's. Since gravity is the same for all robots, forces scale with the
/// mass, and speeds with the square root of the length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotScale {
    length: f64,
    mass: f64,
}

impl RobotScale {
    /// The scale of a robot, by its COM height at home and its mass.
    pub fn of(robot: &Robot) -> Self {
        Self { length: robot.home_com_height() / COM_HEIGHT_M, mass: robot.mass() / MASS_KG }
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

    /// Default impulse of a push (N s), a round number.
    pub fn first_push_n_s(self) -> f64 {
        round(FIRST_PUSH_N_S * self.impulse())
    }

    /// Length at which a force is drawn (m/N), from that for UT-mu2.
    pub fn m_per_n(self, m_per_n: f64) -> f64 {
        m_per_n / self.stiffness()
    }
}

/// The push of the window and the command line if none is given, in round numbers.
pub fn first_push(robot: &Robot) -> Push {
    let usual = Push::of(&Units::of(robot));
    let impulse_n_s = RobotScale::of(robot).first_push_n_s();
    Push { impulse_n_s, duration_s: round(usual.duration_s), start_s: round(usual.start_s), ..usual }
}

/// The nearest number that a person would choose: 1, 2, 2.5 or 5 times a power of ten.
pub fn round(value: f64) -> f64 {
    let power = 10_f64.powi(value.log10().floor() as i32);
    let off = |factor: f64| (value / (factor * power)).ln().abs();
    [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b))).map_or(value, |best| best * power)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A robot three times as long, of the same density.
    pub const THRICE: RobotScale = RobotScale { length: 3.0, mass: 27.0 };

    #[test]
    fn all_factors_are_one_for_ut_mu2() {
        let scale = RobotScale::of(&Robot::load("ut-mu2").unwrap());
        for one in [scale.length(), scale.force(), scale.stiffness(), scale.impulse()] {
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

    #[test]
    fn numbers_are_rounded_to_those_that_people_choose() {
        for (value, expected) in
            [(0.0999, 0.1), (0.1004, 0.1), (0.29, 0.25), (4.7, 5.0), (8.0, 10.0), (935.0, 1000.0), (19.8, 20.0)]
        {
            assert!((round(value) / expected - 1.0).abs() < 1e-12, "{value}: {}", round(value));
        }
    }
}
