//! Impulse and heading of the next push that a key gives.

use standfast_core::error::{Error, Result};
use standfast_core::robot::Units;
use standfast_sim::Push;
use standfast_sim::push::round;

/// Largest impulse, and step by which a key changes it, as multiples of the default push.
const MOST: f64 = 4.0;
const STEP: f64 = 0.02;

/// The next push.
#[derive(Debug, Clone, Copy)]
pub struct Aim {
    pub impulse_n_s: f64,
    /// Heading, from -180 (not included) to 180 degrees.
    pub heading_deg: f64,
    /// Largest accepted impulse (N s).
    pub most_n_s: f64,
    /// Step by which a key changes the impulse (N s).
    pub step_n_s: f64,
}

impl Aim {
    /// The first push, for a robot with these units. Fails if `--impulse` or `--heading` is out of range.
    pub fn new(impulse: Option<f64>, heading: f64, units: &Units) -> Result<Self> {
        let [most_n_s, step_n_s] =
            [MOST, STEP].map(|factor| round(factor * Push::of(units).impulse_n_s));
        let impulse_n_s = impulse.unwrap_or(Push::first(units).impulse_n_s);
        if !(0.0..=most_n_s).contains(&impulse_n_s) {
            let accepted = format!("0 to {most_n_s}");
            return Err(Error::option(
                "--impulse",
                impulse_n_s,
                "out of range",
                accepted,
            ));
        }
        if !heading.is_finite() {
            return Err(Error::option(
                "--heading",
                heading,
                "out of range",
                "-180 to 180",
            ));
        }
        Ok(Self {
            impulse_n_s,
            heading_deg: wrapped(heading),
            most_n_s,
            step_n_s,
        })
    }

    /// Sets the impulse (N s), clamped to the accepted range.
    pub fn set_impulse(&mut self, impulse_n_s: f64) {
        self.impulse_n_s = impulse_n_s.clamp(0.0, self.most_n_s);
    }

    /// Makes the push harder by a number of steps, or softer if it is negative.
    pub fn harder(&mut self, steps: i32) {
        self.set_impulse(self.impulse_n_s + f64::from(steps) * self.step_n_s);
    }

    /// Turns the heading to the left (degrees).
    pub fn turn(&mut self, by_deg: f64) {
        self.heading_deg = wrapped(self.heading_deg + by_deg);
    }
}

/// A heading in -180 (not included) to 180 degrees.
fn wrapped(heading_deg: f64) -> f64 {
    180.0 - (180.0 - heading_deg).rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_core::robot::SizeRatio;

    /// The aim for an impulse (None for the default) and a heading (degrees).
    fn aim(units: &Units, impulse: Option<f64>, heading: f64) -> Result<Aim> {
        Aim::new(impulse, heading, units)
    }

    #[test]
    fn headings_are_wrapped() {
        for (given, expected) in [
            (0.0, 0.0),
            (180.0, 180.0),
            (-180.0, 180.0),
            (195.0, -165.0),
            (-540.0, 180.0),
        ] {
            assert_eq!(wrapped(given), expected);
        }
    }

    #[test]
    fn a_heavier_robot_is_pushed_harder() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let [ut_mu2, thrice] = [
            &robot,
            &robot.scaled(SizeRatio {
                length: 3.0,
                mass: 27.0,
            }),
        ]
        .map(Units::of);
        for (units, first, most, step) in [(ut_mu2, 5.0, 20.0, 0.1), (thrice, 250.0, 1000.0, 5.0)] {
            let mut aim = aim(&units, None, 0.0).unwrap();
            assert_eq!(
                (aim.impulse_n_s, aim.most_n_s, aim.step_n_s),
                (first, most, step)
            );
            aim.harder(-2);
            assert!(
                (aim.impulse_n_s - (first - 2.0 * step)).abs() < 1e-12,
                "{aim:?}"
            );
            aim.set_impulse(1e9);
            assert_eq!(aim.impulse_n_s, most);
        }
        let refused = aim(&ut_mu2, Some(60.0), 0.0).unwrap_err().to_string();
        assert!(
            refused.contains("--impulse") && refused.contains("0 to 20"),
            "{refused}"
        );
        assert_eq!(aim(&thrice, Some(60.0), 0.0).unwrap().impulse_n_s, 60.0);
        assert!(
            aim(&ut_mu2, Some(-1.0), 0.0).is_err() && aim(&ut_mu2, None, f64::INFINITY).is_err()
        );
    }
}
