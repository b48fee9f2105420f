//! Torques and hard stops of Rapier's joints.
//!
//! Rapier cannot apply a generalised force, so its implicit joint spring has to: with a stiffness too small to matter
//! and a rest position `q + tau / stiffness`, the spring exerts `tau`.

use crate::servo::Drive;
use rapier3d::prelude::{JointAxesMask, MultibodyLink};

/// Stiffness of the spring that exerts the torque (N m/rad). The joints of a robot of 1 kg with its COM at 1 m are
/// thousands of times as stiff.
const STIFFNESS: f32 = 1e-3;
/// Index of the free axis of a revolute joint in Rapier's spatial coordinates.
const AXIS: usize = 3;
/// Distance from a limit at which Rapier's constraint is switched on (rad). It costs a solver row even when idle.
const LIMIT_RANGE_RAD: f64 = 0.1;

/// Angle of a revolute joint (rad).
pub fn angle(link: &MultibodyLink) -> f64 {
    f64::from(link.joint.coords()[AXIS])
}

/// Sets the constant part of a drive as the spring of Rapier's joint, for the next step.
pub fn install(link: &mut MultibodyLink, drive: Drive) {
    let rest = link.joint.coords()[AXIS] + drive.constant as f32 / STIFFNESS;
    link.joint.set_spring(AXIS, STIFFNESS, rest);
}

/// Switches the joint's hard stop on near a limit, and off elsewhere.
pub fn guard_limits(link: &mut MultibodyLink, lower_rad: f64, upper_rad: f64) {
    let q = angle(link);
    let near = q < lower_rad + LIMIT_RANGE_RAD || q > upper_rad - LIMIT_RANGE_RAD;
    link.joint.data.limit_axes.set(JointAxesMask::ANG_X, near);
}
