//! The units of a robot, in which a figure fits robots of every size.
//!
//! A pendulum of the COM height h swings with `omega = sqrt(g / h)` (eq. 1), and falls in a time of about `1 / omega`.
//! Take two robots of the same build, one of them L times as long with links L^3 times as heavy. They move alike if
//! lengths are measured in h, times in `1 / omega` and forces in weights m g ("dynamic similarity").

use super::model::{Foot, GRAVITY, Robot};
use serde::{Deserialize, Serialize};

/// The units of a robot at home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// Mass m of the robot (kg).
    pub mass_kg: f64,
    /// Height h of the robot's COM (m).
    pub length_m: f64,
    /// Half the length of the shorter sole (m).
    pub half_sole_m: f64,
}

impl Units {
    pub fn of(robot: &Robot) -> Self {
        Self {
            mass_kg: robot.mass(),
            length_m: robot.home_com_height(),
            half_sole_m: Foot::BOTH
                .map(|foot| robot.soles[foot].half_m[0])
                .into_iter()
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// Natural frequency of the pendulum (rad/s).
    pub fn omega(&self) -> f64 {
        (GRAVITY / self.length_m).sqrt()
    }

    /// Unit of time, `1 / omega` (s).
    pub fn time_s(&self) -> f64 {
        1.0 / self.omega()
    }

    /// Unit of speed, `omega h` (m/s).
    pub fn speed_m_s(&self) -> f64 {
        self.omega() * self.length_m
    }

    /// The change of the velocity of the COM by an impulse (N s), in m/s and in the unit of speed, which is sqrt(g h).
    pub fn velocity_of(&self, impulse_n_s: f64) -> [f64; 2] {
        let dv_m_s = impulse_n_s / self.mass_kg;
        [dv_m_s, dv_m_s / self.speed_m_s()]
    }

    /// Unit of force: the weight (N).
    pub fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY
    }

    /// Unit of impulses, the sole impulse (N s): mass times omega times half the length of the shorter sole. A short
    /// push of this size forward brings the DCM from above the middle of the feet to their front edge. (m omega d, by
    /// which a result compares pushes, has instead of half a sole the distance to the edge in the direction of the
    /// push.)
    pub fn impulse_n_s(&self) -> f64 {
        self.mass_kg * self.omega() * self.half_sole_m
    }
}
