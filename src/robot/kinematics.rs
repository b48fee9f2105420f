//! Forward kinematics, COM and Jacobians.

use nalgebra::Isometry3;

/// Pose of a body in the world.
pub type Pose = Isometry3<f64>;

/// A configuration: base pose in the world and joint angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    pub base: Pose,
    /// [rad], one per joint.
    pub q: Vec<f64>,
}
