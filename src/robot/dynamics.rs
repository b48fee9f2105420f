//! Static loads: the joint torques that hold a posture against gravity and the wrenches under the soles.
//!
//! From the virtual work of a tree at rest: `tau = -sum_i J_i^T m_i g - sum_feet J_f^T w`, where J_i moves the COM of
//! link i and J_f the centre of a sole. With `g - com_acc` in place of `g` it also holds a body whose links all accelerate
//! alike, as those of the paper's pendulum do (its COG and ZMP model has no angular momentum).

use super::kinematics::Kinematics;
use super::model::{Foot, PerFoot, Robot};
use nalgebra::{Point3, Vector3};

/// Joint torques (N m) that hold the posture of `kinematics`, written to `out` (one per joint); positive turns a joint
/// towards larger angles.
///
/// `gravity`: effective gravity, world (m/s^2) (0, 0, -9.81 at rest). `wrenches`: of the ground on each foot, world:
/// force (N) and moment (N m) about the centre of the sole.
///
/// Returns what gravity and the ground leave over on the base: force, and moment about the base's origin. Zero when the
/// wrenches carry the robot; else the torques alone cannot hold it.
pub fn load_torques(
    kinematics: &Kinematics,
    robot: &Robot,
    gravity: Vector3<f64>,
    wrenches: &PerFoot<[Vector3<f64>; 2]>,
    out: &mut [f64],
) -> [Vector3<f64>; 2] {
    for (j, tau) in out.iter_mut().enumerate() {
        let (mass, com) = kinematics.subtree(j + 1);
        let moment = (com - kinematics.joint_position(j)).cross(&(gravity * mass));
        *tau = -kinematics.joint_axis(j).dot(&moment);
    }
    let (mass, com) = kinematics.subtree(0);
    let base: Point3<f64> = kinematics.link_pose(0).translation.vector.into();
    let mut left_over = [gravity * mass, (com - base).cross(&(gravity * mass))];
    for foot in Foot::BOTH {
        let [force, moment] = wrenches[foot];
        let sole: Point3<f64> = kinematics.sole_pose(robot, foot).translation.vector.into();
        for j in robot.chain(robot.soles[foot].link) {
            let about = moment + (sole - kinematics.joint_position(j)).cross(&force);
            out[j] -= kinematics.joint_axis(j).dot(&about);
        }
        left_over[0] += force;
        left_over[1] += moment + (sole - base).cross(&force);
    }
    left_over
}
