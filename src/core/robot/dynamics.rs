//! Dynamics of the tree of links: its equations of motion, and the static joint torques as their special case.
//!
//! [`Dynamics`] is for motion: `M(q) a + h(q, v) = (0, tau) + sum J^T w`, with mass matrix M, bias forces h, joint
//! torques tau, and contact wrenches w with their Jacobians J. The bias comes from a recursion from base to leaves for
//! the motion and back for the forces (recursive Newton-Euler). M comes from the inertia that each joint carries
//! (composite rigid bodies). See R. Featherstone, Rigid Body Dynamics Algorithms, ch. 5 and 6; here vectors are
//! three-dimensional and in world axes.
//!
//! [`load_torques`] is for rest: `tau = -sum_i J_i^T m_i g - sum_feet J_f^T w`, with the Jacobian J_i of the COM of
//! link i and J_f of the centre of a sole. With `g - com_acc` in place of `g` it also holds for a body whose links all
//! have the same acceleration, as in the paper's pendulum (its COG-ZMP model has no angular momentum).

use super::kinematics::Kinematics;
use super::model::{Foot, GRAVITY, PerFoot, Robot};
use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

/// Mass matrix, bias forces and bias accelerations of one robot. Generalised velocities have 6 + n entries: velocity of
/// the base's origin and angular velocity of the base (world axes), then joint rates. It allocates only when made.
#[derive(Debug, Clone)]
pub struct Dynamics {
    mass_matrix: DMatrix<f64>,
    bias: DVector<f64>,
    com_bias: Vector3<f64>,
    /// Motion of each link when all generalised accelerations are 0.
    motion: Vec<Motion>,
    /// Force on each link and all that it carries, and moment about the link's origin.
    load: Vec<[Vector3<f64>; 2]>,
    /// Inertia of each link about its COM, in world axes.
    inertia: Vec<Matrix3<f64>>,
    /// Inertia of each link and all that it carries, about the base's origin, in world axes.
    carried_inertia: Vec<Matrix3<f64>>,
}

/// Motion of a link: angular velocity, angular acceleration, and acceleration of its origin, in world axes.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    angular_vel: Vector3<f64>,
    angular_acc: Vector3<f64>,
    acc: Vector3<f64>,
}

impl Motion {
    /// Acceleration of the point of the link at `lever` from its origin.
    fn acc_at(&self, lever: &Vector3<f64>) -> Vector3<f64> {
        self.acc
            + self.angular_acc.cross(lever)
            + self.angular_vel.cross(&self.angular_vel.cross(lever))
    }
}

impl Dynamics {
    /// A workspace for `robot`. Its values are undefined before the first [`update`](Self::update).
    pub fn new(robot: &Robot) -> Self {
        let (links, size) = (robot.links.len(), 6 + robot.joints.len());
        Self {
            mass_matrix: DMatrix::zeros(size, size),
            bias: DVector::zeros(size),
            com_bias: Vector3::zeros(),
            motion: vec![Motion::default(); links],
            load: vec![[Vector3::zeros(); 2]; links],
            inertia: vec![Matrix3::zeros(); links],
            carried_inertia: vec![Matrix3::zeros(); links],
        }
    }

    /// Computes everything for the posture of `kinematics` and a generalised velocity (6 + n entries), without
    /// allocating.
    pub fn update(&mut self, robot: &Robot, kinematics: &Kinematics, velocity: &DVector<f64>) {
        for (inertia, (i, link)) in self.inertia.iter_mut().zip(robot.links.iter().enumerate()) {
            let to_world = kinematics.link_pose(i).rotation.to_rotation_matrix();
            *inertia = to_world.matrix() * link.inertia_kg_m2 * to_world.matrix().transpose();
        }
        self.update_bias(robot, kinematics, velocity);
        self.update_mass_matrix(robot, kinematics);
    }

    /// Mass matrix M, symmetric (kg, kg m, kg m^2). As in the simulation, rotors only count on the diagonal of their
    /// joints; their spin is not part of the body's momentum.
    pub fn mass_matrix(&self) -> &DMatrix<f64> {
        &self.mass_matrix
    }

    /// Bias forces h (N, N m): the generalised forces by which Coriolis, centrifugal and gravity effects are balanced.
    pub fn bias(&self) -> &DVector<f64> {
        &self.bias
    }

    /// `dJ/dt v` of the COM: its acceleration (m/s^2) when all generalised accelerations are 0.
    pub fn com_bias_acc(&self) -> Vector3<f64> {
        self.com_bias
    }

    /// `dJ/dt v` of [`Kinematics::point_jacobian`]: linear acceleration (m/s^2) of the point of `robot.links[link]`
    /// that is now at `point`, and angular acceleration of the link (rad/s^2), when all generalised accelerations are
    /// 0.
    pub fn point_bias_acc(
        &self,
        kinematics: &Kinematics,
        link: usize,
        point: &Point3<f64>,
    ) -> [Vector3<f64>; 2] {
        let motion = &self.motion[link];
        [
            motion.acc_at(&(point - origin(kinematics, link))),
            motion.angular_acc,
        ]
    }

    /// Recursive Newton-Euler at zero generalised acceleration.
    fn update_bias(&mut self, robot: &Robot, kinematics: &Kinematics, velocity: &DVector<f64>) {
        let angular_vel = Vector3::new(velocity[3], velocity[4], velocity[5]);
        self.motion[0] = Motion {
            angular_vel,
            ..Motion::default()
        };
        for (j, joint) in robot.joints.iter().enumerate() {
            let parent = self.motion[joint.parent];
            let spin = kinematics.joint_axis(j) * velocity[6 + j];
            let lever = kinematics.joint_position(j) - origin(kinematics, joint.parent);
            self.motion[j + 1] = Motion {
                angular_vel: parent.angular_vel + spin,
                angular_acc: parent.angular_acc + parent.angular_vel.cross(&spin),
                acc: parent.acc_at(&lever),
            };
        }
        for (i, link) in robot.links.iter().enumerate() {
            let (motion, inertia) = (&self.motion[i], &self.inertia[i]);
            let lever = kinematics.link_com(i) - origin(kinematics, i);
            let force = (motion.acc_at(&lever) + Vector3::z() * GRAVITY) * link.mass_kg;
            let spin = inertia * motion.angular_acc
                + motion.angular_vel.cross(&(inertia * motion.angular_vel));
            self.load[i] = [force, spin + lever.cross(&force)];
        }
        for (j, joint) in robot.joints.iter().enumerate().rev() {
            let [force, moment] = self.load[j + 1];
            self.bias[6 + j] = kinematics.joint_axis(j).dot(&moment);
            let lever = kinematics.joint_position(j) - origin(kinematics, joint.parent);
            let carrier = &mut self.load[joint.parent];
            carrier[0] += force;
            carrier[1] += moment + lever.cross(&force);
        }
        let [force, moment] = self.load[0];
        self.bias.fixed_rows_mut::<3>(0).copy_from(&force);
        self.bias.fixed_rows_mut::<3>(3).copy_from(&moment);
        self.com_bias = force / kinematics.subtree(0).0 - Vector3::z() * GRAVITY;
    }

    /// Fills M column by column with the wrench that accelerates what a joint carries, as it acts on the joints that
    /// carry this joint, and on the base.
    fn update_mass_matrix(&mut self, robot: &Robot, kinematics: &Kinematics) {
        let base = origin(kinematics, 0);
        for (i, link) in robot.links.iter().enumerate() {
            let lever = kinematics.link_com(i) - base;
            self.carried_inertia[i] = self.inertia[i] + point_inertia(link.mass_kg, &lever);
        }
        for (j, joint) in robot.joints.iter().enumerate().rev() {
            let carried = self.carried_inertia[j + 1];
            self.carried_inertia[joint.parent] += carried;
        }
        let (mass, com) = kinematics.subtree(0);
        let coupling = (com - base).cross_matrix() * mass;
        let matrix = &mut self.mass_matrix;
        matrix.fill(0.0);
        matrix
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&Matrix3::from_diagonal_element(mass));
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&coupling);
        matrix
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&coupling.transpose());
        matrix
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.carried_inertia[0]);
        for (j, servo) in robot.servos.iter().enumerate() {
            let axis = kinematics.joint_axis(j);
            let (mass, com) = kinematics.subtree(j + 1);
            let force = axis.cross(&(com - kinematics.joint_position(j))) * mass;
            // About the base's origin: the carried body turns about the joint. This is a turn about the base's origin
            // plus the velocity of that origin if it were fixed to the carried body.
            let glide = axis.cross(&(base - kinematics.joint_position(j)));
            let moment = self.carried_inertia[j + 1] * axis + (com - base).cross(&(glide * mass));
            for k in 0..3 {
                matrix[(k, 6 + j)] = force[k];
                matrix[(3 + k, 6 + j)] = moment[k];
                matrix[(6 + j, k)] = force[k];
                matrix[(6 + j, 3 + k)] = moment[k];
            }
            for i in robot.chain(j + 1) {
                let about = moment - (kinematics.joint_position(i) - base).cross(&force);
                let entry = kinematics.joint_axis(i).dot(&about);
                matrix[(6 + i, 6 + j)] = entry;
                matrix[(6 + j, 6 + i)] = entry;
            }
            matrix[(6 + j, 6 + j)] += servo.rotor_inertia_kg_m2;
        }
    }
}

fn origin(kinematics: &Kinematics, link: usize) -> Point3<f64> {
    kinematics.link_pose(link).translation.vector.into()
}

/// Inertia of a point mass at `lever` from the reference point.
fn point_inertia(mass: f64, lever: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::from_diagonal_element(lever.norm_squared()) - lever * lever.transpose()) * mass
}

/// Writes to `out` the joint torques (N m, one per joint) that hold the posture of `kinematics`. A positive torque
/// turns a joint towards larger angles.
///
/// `gravity` is the effective gravity in the world frame (m/s^2), (0, 0, -9.81) at rest. `wrenches` are those of the
/// ground on each foot in the world frame: force (N), and moment (N m) about the centre of the sole.
///
/// Returns the resulting force on the base and the moment about its origin. They are zero if the wrenches carry the
/// robot; otherwise the joint torques alone cannot hold it.
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
    let base = origin(kinematics, 0);
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
