//! How far from its ankle a foot can press. A load F with its centre of pressure at a distance r from the axis of the
//! ankle needs the torque `F r` of that joint, so weak motors keep the ZMP away from the edges of the sole.

use super::kinematics::Kinematics;
use super::model::{Ankle, Foot, Robot};

/// Least cosine of the angle between a joint's axis and an axis of the sole for which the joint counts as pitch or
/// roll.
const ALIGNED: f64 = 0.8;
/// Number of joints above the sole among which the ankle is searched.
const JOINTS: usize = 2;

impl Ankle {
    pub fn of(robot: &Robot, foot: Foot) -> Self {
        let kinematics = Kinematics::at_home(robot);
        let sole = kinematics.sole_pose(robot, foot);
        let mut ankle = Self::RIGID;
        for joint in robot.chain(robot.soles[foot].link).take(JOINTS) {
            let axis = sole.inverse_transform_vector(&kinematics.joint_axis(joint));
            let above = sole.inverse_transform_point(&kinematics.joint_position(joint));
            for (k, along) in [axis.y, axis.x].into_iter().enumerate() {
                if along.abs() > ALIGNED && ankle.torque_n_m[k].is_infinite() {
                    (ankle.above_m[k], ankle.torque_n_m[k]) =
                        (above[k], robot.servos[joint].torque_n_m);
                }
            }
        }
        ankle
    }
}
