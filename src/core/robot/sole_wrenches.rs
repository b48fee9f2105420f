//! Turns a desired ZMP into wrenches under the soles.

use super::dynamics::load_torques;
use super::{Foot, Kinematics, PerFoot, Pose, Robot};
use nalgebra::{Point2, Vector2, Vector3};

/// Wrenches on the soles (force; moment about the sole's centre; world axes) that sum to `force` (N) with its ZMP at
/// `zmp` (m).
///
/// With no foot in contact they are zero. With both feet in contact, the load of each follows from the place of the ZMP
/// along the line between their centres. The rest of the distance is covered by the centre of pressure within each
/// sole.
pub fn share(
    robot: &Robot,
    footholds: &PerFoot<Pose>,
    in_contact: &PerFoot<bool>,
    zmp: Point2<f64>,
    force: Vector3<f64>,
) -> PerFoot<[Vector3<f64>; 2]> {
    let centers = PerFoot::from_fn(|foot| footholds[foot].translation.vector.xy());
    let across = centers.right - centers.left;
    let along = across.dot(&(zmp.coords - centers.left)) / across.norm_squared();
    if !in_contact.left && !in_contact.right {
        return PerFoot::default();
    }
    let on_right = match (in_contact.left, in_contact.right) {
        (true, false) => 0.0,
        (false, true) => 1.0,
        _ => along.clamp(0.0, 1.0),
    };
    let offset = zmp.coords - (centers.left + across * on_right);
    PerFoot::from_fn(|foot| {
        let part = if foot == Foot::Right {
            on_right
        } else {
            1.0 - on_right
        };
        let f = force * part;
        let point = clamp_to_sole(robot, foot, &footholds[foot], offset, f.z);
        [f, point.cross(&f)]
    })
}

/// The point of a sole nearest to `offset` from its centre (m, world axes) at which its ankle can hold a load (N).
fn clamp_to_sole(
    robot: &Robot,
    foot: Foot,
    pose: &Pose,
    offset: Vector2<f64>,
    load_n: f64,
) -> Vector3<f64> {
    let local = pose.rotation.inverse() * Vector3::new(offset.x, offset.y, 0.0);
    let [x, y] = robot.soles[foot].pressable_m(load_n);
    pose.rotation * Vector3::new(local.x.clamp(x[0], x[1]), local.y.clamp(y[0], y[1]), 0.0)
}

impl Robot {
    /// The joint whose torque is the largest share of its motor's torque while the weight is on one foot, at home; and
    /// that share. Only joints of a leg above the ankle that pitch count. Joints that roll are left out, since a robot
    /// in the middle of a footstep does not balance sideways.
    pub fn hardest_on_one_leg(&self) -> Option<(usize, f64)> {
        let kinematics = Kinematics::at_home(self);
        let weight = Vector3::new(0.0, 0.0, self.weight_n());
        let mut tau = vec![0.0; self.joints.len()];
        let mut shares = Vec::new();
        for foot in Foot::BOTH {
            let stands = PerFoot::from_fn(|f| f == foot);
            let wrenches = share(
                self,
                &kinematics.sole_poses(self),
                &stands,
                kinematics.com().xy(),
                weight,
            );
            load_torques(
                &kinematics,
                self,
                -weight / self.mass(),
                &wrenches,
                &mut tau,
            );
            let pitching = self
                .chain(self.soles[foot].link)
                .filter(|&j| kinematics.pitches(j));
            shares.extend(
                pitching
                    .skip(1)
                    .map(|j| (j, tau[j].abs() / self.servos[j].torque_n_m)),
            );
        }
        shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}
