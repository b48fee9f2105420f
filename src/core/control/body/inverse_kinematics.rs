//! Inverse kinematics with the COG Jacobian: joint angles for given COM, soles, trunk and arms. The paper, Sect. VI.A:
//! "desired joint angle vector is obtained from the desired COG position by solving the inverse kinematics with COG
//! Jacobian".
//!
//! Each tick takes one Newton step on a reference posture, which is kept apart from the measured one. The step is a
//! weighted least-squares solution for the velocities of the base (six) and of the joints. The weights rank the tasks
//! in the order places of the soles, joint limits, COM, trunk, rotations of the soles, posture.

use super::tasks::{
    KINEMATICS, NormalEquations, SOLE_ROTATION, TOO_HIGH, TaskJacobians, led_axes, legs, reachable,
    weight_of_lengths,
};
use crate::robot::{Foot, Kinematics, PerFoot, Pose, Posture, Robot};
use nalgebra::{Cholesky, DMatrix, DVector, Isometry3, Point3, UnitQuaternion, Vector3};

/// Largest number of checks of the joint limits in a tick.
const LIMIT_ROUNDS: usize = 3;

/// Targets for this tick: poses in the world frame.
#[derive(Debug, Clone)]
pub struct BodyTargets {
    /// Position of the COM (m).
    pub com: Point3<f64>,
    /// Largest rise of the COM in a tick (m).
    pub rise: f64,
    /// Velocity of the COM (m/s).
    pub com_vel: Vector3<f64>,
    /// Pose of each sole, at the centre of its contact face.
    pub soles: PerFoot<Pose>,
    /// Velocity of each sole's centre (m/s). The angular velocity of the soles is taken as zero.
    pub sole_vel: PerFoot<Vector3<f64>>,
    pub trunk: UnitQuaternion<f64>,
}

/// Inverse kinematics of one robot. It allocates only when it is made.
#[derive(Debug, Clone)]
pub struct InverseKinematics {
    /// The reference posture, to which the joints are sent.
    pub posture: Posture,
    /// Velocity of the reference posture: base linear, base angular, joints.
    pub velocity: DVector<f64>,
    kinematics: Kinematics,
    in_leg: Vec<bool>,
    /// The factor of [`weight_of_lengths`].
    of_lengths: f64,
    jacobians: TaskJacobians,
    /// The two right-hand sides are displacement and velocity.
    equations: NormalEquations<2>,
    factor: DMatrix<f64>,
    step: DVector<f64>,
    /// Weighted sum of the squared errors of all tasks.
    squared_error: f64,
}

impl InverseKinematics {
    /// Starts in the home posture.
    pub fn new(robot: &Robot) -> Self {
        Self::at(robot, robot.home_posture())
    }

    /// Starts in a given posture.
    pub fn at(robot: &Robot, posture: Posture) -> Self {
        let size = 6 + robot.joints.len();
        Self {
            posture,
            velocity: DVector::zeros(size),
            kinematics: Kinematics::new(robot),
            in_leg: legs(robot),
            of_lengths: weight_of_lengths(robot),
            jacobians: TaskJacobians::new(robot),
            equations: NormalEquations::new(size),
            factor: DMatrix::zeros(size, size),
            step: DVector::zeros(size),
            squared_error: 0.0,
        }
    }

    /// Continues from another posture of the same robot.
    pub fn start_at(&mut self, posture: &Posture) {
        self.posture.base = posture.base;
        self.posture.q.copy_from_slice(&posture.q);
    }

    /// Moves the reference posture by one Newton step towards `targets`, and sets its velocity.
    pub fn follow(&mut self, robot: &Robot, targets: &BodyTargets) {
        self.kinematics.update(robot, &self.posture);
        self.jacobians.update(robot, &self.kinematics);
        self.equations.clear();
        self.add_soles(robot, targets);
        self.add_com(targets);
        self.add_trunk(robot, targets);
        self.add_posture(robot);
        self.add_damping();
        self.solve_within_limits(robot);
        let posture = &mut self.posture;
        let linear = self.step.fixed_rows::<3>(0).into_owned();
        let angular = self.step.fixed_rows::<3>(3).into_owned();
        posture.base = Isometry3::from_parts(
            (posture.base.translation.vector + linear).into(),
            UnitQuaternion::from_scaled_axis(angular) * posture.base.rotation,
        );
        for (i, q) in posture.q.iter_mut().enumerate() {
            *q =
                (*q + self.step[6 + i]).clamp(robot.joints[i].lower_rad, robot.joints[i].upper_rad);
        }
    }

    /// COM height of the reference posture (m).
    pub fn com_height(&mut self, robot: &Robot) -> f64 {
        self.kinematics.update(robot, &self.posture);
        self.kinematics.com().z
    }

    fn add_soles(&mut self, robot: &Robot, targets: &BodyTargets) {
        for foot in Foot::BOTH {
            let pose = self.kinematics.sole_pose(robot, foot);
            let wanted = &targets.soles[foot];
            let linear = wanted.translation.vector - pose.translation.vector;
            let angular = (wanted.rotation * pose.rotation.inverse()).scaled_axis();
            for k in 0..3 {
                let weight = KINEMATICS.soles * self.of_lengths;
                self.add_row(
                    weight,
                    JacobianRow::Sole(foot, k),
                    linear[k],
                    targets.sole_vel[foot][k],
                );
            }
            for axis in led_axes(robot, foot, &pose) {
                self.add_row(
                    SOLE_ROTATION,
                    JacobianRow::Turn(foot, axis),
                    angular.dot(&axis),
                    0.0,
                );
            }
        }
    }

    fn add_com(&mut self, targets: &BodyTargets) {
        let mut error = targets.com - self.kinematics.com();
        // After a long stride the body is low. It must not leap off the ground when a foot is lifted again.
        error.z = error.z.min(targets.rise);
        let height = if error.z < 0.0 {
            TOO_HIGH
        } else {
            KINEMATICS.height
        };
        for (k, weight) in [KINEMATICS.com, KINEMATICS.com, height]
            .into_iter()
            .enumerate()
        {
            self.add_row(
                weight * self.of_lengths,
                JacobianRow::Com(k),
                error[k],
                targets.com_vel[k],
            );
        }
    }

    fn add_trunk(&mut self, robot: &Robot, targets: &BodyTargets) {
        let rotation = self.kinematics.link_pose(robot.trunk).rotation;
        let angular = (targets.trunk * rotation.inverse()).scaled_axis();
        for k in 0..3 {
            let weight = if k == 2 {
                KINEMATICS.yaw
            } else {
                KINEMATICS.trunk
            };
            self.add_row(weight, JacobianRow::Trunk(3 + k), angular[k], 0.0);
        }
    }

    /// Pulls the joints outside of the legs to their home angles.
    fn add_posture(&mut self, robot: &Robot) {
        let NormalEquations {
            matrix,
            right: [displacement, _],
            ..
        } = &mut self.equations;
        for i in 0..6 {
            matrix[(i, i)] += KINEMATICS.base * if i < 3 { self.of_lengths } else { 1.0 };
        }
        for (j, &home) in robot.home_rad.iter().enumerate() {
            let weight = if self.in_leg[j] {
                KINEMATICS.legs
            } else {
                KINEMATICS.arms
            };
            matrix[(6 + j, 6 + j)] += weight;
            displacement[6 + j] += weight * (home - self.posture.q[j]);
        }
    }

    /// Damps the step by the squared error of all tasks (T. Sugihara's Levenberg-Marquardt method). The damping is
    /// negligible while all tasks are met, and prevents leaps of the joints when they cannot be met.
    fn add_damping(&mut self) {
        for i in 0..self.step.len() {
            self.equations.matrix[(i, i)] +=
                0.5 * self.squared_error * if i < 3 { self.of_lengths } else { 1.0 };
        }
        self.squared_error = 0.0;
    }

    fn add_row(&mut self, weight: f64, row: JacobianRow, displacement: f64, velocity: f64) {
        self.squared_error += weight * displacement * displacement;
        let jacobians = &self.jacobians;
        self.equations.add_row(
            weight,
            |i| match row {
                JacobianRow::Sole(foot, k) => jacobians.soles[foot][(k, i)],
                JacobianRow::Turn(foot, axis) => {
                    axis.dot(&jacobians.soles[foot].fixed_view::<3, 1>(3, i))
                }
                JacobianRow::Trunk(k) => jacobians.trunk[(k, i)],
                JacobianRow::Com(k) => jacobians.com[(k, i)],
            },
            [displacement, velocity],
        );
    }

    /// Solves for displacement and velocity. Joints that would pass a limit are held at it, and the equations are
    /// solved again for the others. If there is no solution, the posture stays as it is.
    fn solve_within_limits(&mut self, robot: &Robot) {
        let NormalEquations {
            matrix,
            right: [displacement, velocity],
            ..
        } = &mut self.equations;
        for _ in 0..LIMIT_ROUNDS {
            self.factor.copy_from(matrix);
            let Some(factor) =
                Cholesky::new(std::mem::replace(&mut self.factor, DMatrix::zeros(0, 0)))
            else {
                self.factor = matrix.clone();
                self.step.fill(0.0);
                self.velocity.fill(0.0);
                return;
            };
            self.step.copy_from(displacement);
            factor.solve_mut(&mut self.step);
            self.velocity.copy_from(velocity);
            factor.solve_mut(&mut self.velocity);
            self.factor = factor.unpack_dirty();
            let mut pinned = false;
            for (j, joint) in robot.joints.iter().enumerate() {
                let (q, i) = (self.posture.q[j], 6 + j);
                let next = q + self.step[i];
                let [lower, upper] = reachable(joint, robot.home_rad[j]);
                let limit = next.clamp(lower, upper);
                if (next - limit).abs() > 1e-9 && matrix[(i, i)] < KINEMATICS.limit {
                    matrix[(i, i)] += KINEMATICS.limit;
                    displacement[i] += KINEMATICS.limit * (limit - q);
                    pinned = true;
                }
            }
            if !pinned {
                return;
            }
        }
    }
}

/// A row of one of the Jacobians.
#[derive(Clone, Copy)]
enum JacobianRow {
    /// Position of a sole along an axis of the world.
    Sole(Foot, usize),
    /// Rotation of a sole about an axis (world frame).
    Turn(Foot, Vector3<f64>),
    Trunk(usize),
    Com(usize),
}
