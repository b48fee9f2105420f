//! Pushes: horizontal forces on the trunk for a short time.

use crate::robot::Units;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
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

/// A push: a horizontal force on the trunk, whose line of action passes above or below the COM of the home posture at
/// the given height. The point where it acts moves with the trunk.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Push {
    /// Impulse (N s), not negative.
    pub impulse_n_s: f64,
    /// Heading of the force: 0 pushes forward (+x), 90 to the left (+y).
    pub heading_deg: f64,
    /// Height of the line of action above the COM of the home posture (m).
    pub height_m: f64,
    pub duration_s: f64,
    pub start_s: f64,
    pub profile: Profile,
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
        }
    }
}

impl Push {
    /// A push without an impulse, with the usual start and duration for a robot with these units.
    pub fn of(units: &Units) -> Self {
        let time_s = units.time_s();
        Self { duration_s: 0.2813 * time_s, start_s: 2.813 * time_s, ..Self::default() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_impulse_is_delivered_whole_whatever_the_step_and_profile() {
        for profile in [Profile::Rectangular, Profile::HalfSine] {
            let push = Push { impulse_n_s: 2.0, heading_deg: 90.0, duration_s: 0.0335, profile, ..Push::default() };
            for step in [0.0005, 0.001, 0.004] {
                let sum: f64 = (0..(2.0 / step) as usize)
                    .map(|i| push.mean_force(i as f64 * step, (i + 1) as f64 * step).y * step)
                    .sum();
                assert!((sum - 2.0).abs() < 1e-9, "{profile:?} in steps of {step} s delivers {sum} N s");
            }
        }
    }
}
