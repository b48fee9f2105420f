//! Noise of the sensors, delay and friction. All of them are assumed: in units of the robot, they are those of UT-mu2.

use super::figures::rounded;
use standfast_core::robot::{GRAVITY, Robot, SensorNoise, Units};

/// Friction coefficient between soles and ground.
pub const FRICTION: f64 = 0.8;
/// Delay from sensing to torque, in 1 / omega.
const DELAY: f64 = 0.0225;

/// The delay from sensing to torque (s) of a robot whose home posture is known.
pub fn delay_s(robot: &Robot) -> f64 {
    rounded(DELAY / robot.omega(), 1)
}

pub fn noise(robot: &Robot) -> SensorNoise {
    let units = Units::of(robot);
    let weight = units.weight_n();
    SensorNoise {
        joint_angle_rad: 0.0005,
        joint_speed_rad_s: rounded(0.00888 * units.omega(), 2),
        gyro_rad_s: rounded(0.00178 * units.omega(), 2),
        orientation_rad: 0.003,
        accelerometer_m_s2: rounded(0.0051 * GRAVITY, 1),
        sole_force_n: rounded(0.0064 * weight, 1),
        sole_moment_n_m: rounded(0.00265 * weight * units.half_sole_m, 1),
    }
}
