//! How far from its ankle a foot can press. A load F with its centre of pressure at a distance r from the axis of the
//! ankle asks that joint for the torque `F r`, so weak motors keep the ZMP away from the edges of the sole.

use super::kinematics::Kinematics;
use super::model::{Foot, Robot, Sole};

/// An axis counts as one of pitch or roll if the cosine of its angle to that of the sole is larger than this.
const ALIGNED: f64 = 0.8;
/// The ankle is sought among this many joints above the sole.
const JOINTS: usize = 2;

/// However weak an ankle is, it is taken to hold the ZMP within this share of the sole.
const LEAST: f64 = 0.05;

/// The ankle above a sole, at home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ankle {
    /// Where the axes of pitch (x) and roll (y) pass over the sole, from its centre (m).
    pub above_m: [f64; 2],
    /// Torque limits in pitch and in roll (N m); infinite where the ankle has no such joint, and the leg is rigid.
    pub torque_n_m: [f64; 2],
}

impl Ankle {
    /// An ankle that never gives way.
    pub const RIGID: Ankle = Ankle { above_m: [0.0; 2], torque_n_m: [f64::INFINITY; 2] };

    /// Whether it has a joint for roll. Without one, the sole rolls with the leg.
    pub fn rolls(&self) -> bool {
        self.torque_n_m[1].is_finite()
    }

    /// The ankle of this foot.
    pub fn of(robot: &Robot, foot: Foot) -> Self {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        let sole = kinematics.sole_pose(robot, foot);
        let mut ankle = Self::RIGID;
        for joint in robot.chain(robot.soles[foot].link).take(JOINTS) {
            let axis = sole.inverse_transform_vector(&kinematics.joint_axis(joint));
            let above = sole.inverse_transform_point(&kinematics.joint_position(joint));
            for (k, along) in [axis.y, axis.x].into_iter().enumerate() {
                if along.abs() > ALIGNED && ankle.torque_n_m[k].is_infinite() {
                    (ankle.above_m[k], ankle.torque_n_m[k]) = (above[k], robot.servos[joint].torque_n_m);
                }
            }
        }
        ankle
    }
}

impl Sole {
    /// Smallest and largest x and y of the centre of pressure (m, from the sole's centre) that the ankle can hold under a
    /// load (N).
    pub fn pressable_m(&self, load_n: f64) -> [[f64; 2]; 2] {
        [0, 1].map(|k| {
            let half = self.half_m[k];
            let lever = (self.ankle.torque_n_m[k] / load_n).max(LEAST * half);
            [-lever, lever].map(|side| (self.ankle.above_m[k] + side).clamp(-half, half))
        })
    }
}
