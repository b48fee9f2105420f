//! Pushes: horizontal forces on a link for a short time, or the bob of a pendulum that strikes the robot.

use super::bob::Bob;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use standfast_core::robot::Units;
use std::f64::consts::PI;

/// Course of the force over the push's duration. It does not change the impulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    #[default]
    Rectangular,
    HalfSine,
}

impl Profile {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rectangular => "rectangular",
            Self::HalfSine => "half-sine",
        }
    }
}

/// A push: a horizontal force on a link, the trunk unless [`PushPoint`](standfast_core::robot::PushPoint) says otherwise. Its
/// line of action passes above or below the COM of the home posture, or a stated point, at the given height. The point where
/// it acts moves with the link. With a bob there is no such force: the bob comes along that line and touches the robot at
/// `start_s`, with a momentum of `impulse_n_s`; the duration is one to plan with, and the profile has no meaning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Push {
    /// Impulse (N s), not negative.
    pub impulse_n_s: f64,
    /// Heading of the force: 0 pushes forward (+x), 90 to the left (+y).
    pub heading_deg: f64,
    /// Height of the line of action above the COM of the home posture, or above the stated point (m).
    pub height_m: f64,
    pub duration_s: f64,
    pub start_s: f64,
    pub profile: Profile,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bob: Option<Bob>,
}

impl Default for Push {
    fn default() -> Self {
        Self {
            impulse_n_s: 0.0,
            heading_deg: 0.0,
            height_m: 0.0,
            duration_s: 0.05,
            start_s: 0.5,
            profile: Profile::Rectangular,
            bob: None,
        }
    }
}

impl Push {
    /// The default push of a robot with these units, from behind. A campaign takes from it, to the bit, the values that
    /// its file leaves out.
    pub fn of(units: &Units) -> Self {
        let time_s = units.time_s();
        Self {
            impulse_n_s: 0.3585 * units.mass_kg * units.speed_m_s(),
            duration_s: 0.2813 * time_s,
            start_s: 2.813 * time_s,
            ..Self::default()
        }
    }

    /// The default push in round numbers. The command line and the window use it if nothing is given.
    pub fn first(units: &Units) -> Self {
        let Self {
            impulse_n_s,
            duration_s,
            start_s,
            ..
        } = Self::of(units);
        let [duration_s, start_s] = [duration_s, start_s].map(three_digits);
        Self {
            impulse_n_s: round(impulse_n_s),
            duration_s,
            start_s,
            ..Self::default()
        }
    }

    /// Direction of the force, a unit vector in the world frame.
    pub fn direction(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading_deg.to_radians().sin_cos();
        Vector3::new(cos, sin, 0.0)
    }

    /// Time at which the force ends (s).
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }

    /// Mean force (N) from `from_s` to `to_s` (s), world frame. It is exact, so the physics step does not matter.
    pub fn mean_force(&self, from_s: f64, to_s: f64) -> Vector3<f64> {
        let delivered = self.impulse_n_s * (self.share(to_s) - self.share(from_s));
        self.direction() * (delivered / (to_s - from_s))
    }

    /// Share of the impulse that has acted by `time_s`, from 0 to 1.
    fn share(&self, time_s: f64) -> f64 {
        let phase = ((time_s - self.start_s) / self.duration_s).clamp(0.0, 1.0);
        match self.profile {
            Profile::Rectangular => phase,
            Profile::HalfSine => 0.5 * (1.0 - (PI * phase).cos()),
        }
    }
}

/// The nearest round number: 1, 2, 2.5 or 5 times a power of ten.
pub fn round(value: f64) -> f64 {
    let power = 10_f64.powi(value.log10().floor() as i32);
    let off = |factor: f64| (value / (factor * power)).ln().abs();
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .min_by(|a, b| off(*a).total_cmp(&off(*b)))
        .map_or(value, |best| best * power)
}

/// A number with three significant digits.
pub fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_push_is_scaled_to_the_robot_and_is_that_of_its_campaigns() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let first = Push::first(&Units::of(&robot));
        assert_eq!(
            first,
            Push {
                impulse_n_s: 5.0,
                duration_s: 0.05,
                start_s: 0.5,
                ..Push::default()
            }
        );
        let large = Units::of(&robot.scaled(standfast_core::robot::SizeRatio {
            length: 3.0,
            mass: 27.0,
        }));
        let (exact, first) = (Push::of(&large), Push::first(&large));
        assert!(
            (exact.duration_s - 0.05 * 3_f64.sqrt()).abs() < 1e-5,
            "{exact:?}"
        );
        assert_eq!(
            (first.impulse_n_s, first.duration_s, first.start_s),
            (250.0, 0.0866, 0.866)
        );
        assert!(
            (first.duration_s / exact.duration_s - 1.0).abs() < 5e-3,
            "{first:?} {exact:?}"
        );
    }

    #[test]
    fn numbers_are_rounded_to_those_that_people_choose() {
        for (value, expected) in [
            (0.0999, 0.1),
            (0.1004, 0.1),
            (0.29, 0.25),
            (4.7, 5.0),
            (8.0, 10.0),
            (935.0, 1000.0),
            (19.8, 20.0),
        ] {
            assert!(
                (round(value) / expected - 1.0).abs() < 1e-12,
                "{value}: {}",
                round(value)
            );
        }
    }

    #[test]
    fn the_impulse_is_delivered_whole_whatever_the_step_and_profile() {
        for profile in [Profile::Rectangular, Profile::HalfSine] {
            let push = Push {
                impulse_n_s: 2.0,
                heading_deg: 90.0,
                duration_s: 0.0335,
                profile,
                ..Push::default()
            };
            for step in [0.0005, 0.001, 0.004] {
                let sum: f64 = (0..(2.0 / step) as usize)
                    .map(|i| push.mean_force(i as f64 * step, (i + 1) as f64 * step).y * step)
                    .sum();
                assert!(
                    (sum - 2.0).abs() < 1e-9,
                    "{profile:?} in steps of {step} s delivers {sum} N s"
                );
            }
        }
    }
}
