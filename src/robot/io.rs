//! What passes between a plant (simulated or real) and a controller, once a control tick.

use super::model::PerFoot;
use nalgebra::{UnitQuaternion, Vector3};

/// What the sensors tell: the only thing that a controller sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Joint angles (rad), one per joint.
    pub q: Vec<f64>,
    pub imu: Imu,
    /// Of the ground on each sole, in the axes of the sole; mean over the last tick.
    pub soles: PerFoot<Wrench>,
}

/// Inertial measurement unit, rigid with the trunk: at the origin of the trunk's frame, axes parallel to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Trunk frame to world.
    pub orientation: UnitQuaternion<f64>,
    /// Angular velocity (rad/s), trunk frame.
    pub gyro: Vector3<f64>,
    /// Specific force (acceleration less gravity) (m/s^2), trunk frame, mean over the last tick.
    pub accelerometer: Vector3<f64>,
}

/// A force and a moment about the centre of a sole's contact face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// (N)
    pub force: Vector3<f64>,
    /// (N m)
    pub moment: Vector3<f64>,
}

/// What a controller asks of the joint servos until the next tick:
/// `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff`, within the servo's limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// (rad)
    pub q_ref: Vec<f64>,
    /// (rad/s)
    pub dq_ref: Vec<f64>,
    /// (N m)
    pub tau_ff: Vec<f64>,
}
