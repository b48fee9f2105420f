//! How large a robot is beside UT-mu2, for which window, pages and pictures were made: what is seen grows with its
//! length, how hard a hand pulls with its weight.

use crate::robot::Robot;

/// UT-mu2 at home: height of its COM (m), and its mass (kg).
const COM_HEIGHT_M: f64 = 0.31;
const MASS_KG: f64 = 8.0;
/// The push that window and command line give if no other is asked for, for a robot of this size (N s).
const FIRST_PUSH_N_S: f64 = 5.0;

/// Length and mass of a robot, UT-mu2's are 1. Gravity is the same for all: a force goes with the mass, a speed with
/// the root of the length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotScale {
    length: f64,
    mass: f64,
}

impl RobotScale {
    pub fn of(robot: &Robot) -> Self {
        Self { length: robot.home_com_height() / COM_HEIGHT_M, mass: robot.mass() / MASS_KG }
    }

    pub fn length(self) -> f64 {
        self.length
    }

    pub fn force(self) -> f64 {
        self.mass
    }

    /// Of force by length.
    pub fn stiffness(self) -> f64 {
        self.mass / self.length
    }

    pub fn impulse(self) -> f64 {
        self.mass * self.length.sqrt()
    }

    /// The push (N s) that is given if no other is asked for.
    pub fn first_push_n_s(self) -> f64 {
        round(FIRST_PUSH_N_S * self.impulse())
    }

    /// Length of a drawn force (m/N) that has this one for UT-mu2.
    pub fn m_per_n(self, m_per_n: f64) -> f64 {
        m_per_n / self.stiffness()
    }
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

    /// Three times as long, and of the same density.
    pub const THRICE: RobotScale = RobotScale { length: 3.0, mass: 27.0 };

    #[test]
    fn what_is_drawn_was_made_for_ut_mu2() {
        let scale = RobotScale::of(&Robot::load("ut-mu2").unwrap());
        for one in [scale.length(), scale.force(), scale.stiffness(), scale.impulse()] {
            assert!((one - 1.0).abs() < 0.01, "{scale:?}");
        }
    }

    /// A push moves the capture point by `impulse / (mass omega)`, a hand the COM by `force / (mass omega^2)`, where
    /// omega goes with the root of gravity by length: by the same share of the robot's length, however long it is.
    #[test]
    fn a_push_and_a_hand_do_the_same_to_a_robot_of_any_size() {
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
