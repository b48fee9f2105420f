//! What inverse kinematics and inverse dynamics share: the tasks of the body (soles, COM, trunk, joints) with their Jacobians,
//! the weights that rank them, and the normal equations of the weighted least squares that both solve.

use crate::robot::{Foot, Joint, Kinematics, PerFoot, Robot};
use nalgebra::{DMatrix, DVector, Matrix3xX, Matrix6xX, Point3};

/// What a squared error of each task counts, metres and radians alike.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    /// Of a sole that stands, in place and rotation.
    pub stance: f64,
    /// Of one in the air.
    pub swing: f64,
    /// Of the COM over the ground.
    pub com: f64,
    pub height: f64,
    /// Of the trunk's rotation.
    pub trunk: f64,
    /// Of each joint outside of the legs.
    pub arms: f64,
    /// Of each joint of a leg: only so that the problem always has one solution.
    pub legs: f64,
    /// Of a joint at its limit.
    pub limit: f64,
    /// Of the base's own six, likewise only for a solution.
    pub base: f64,
}

/// Of displacements and velocities. All feet are led alike; the height gives way where legs are too short for a long stride.
pub(super) const KINEMATICS: Weights = Weights {
    stance: 1e4,
    swing: 1e4,
    com: 1e2,
    height: 1.0,
    trunk: 1e1,
    arms: 1.0,
    legs: 1e-6,
    limit: 1e6,
    base: 1e-9,
};

/// Of accelerations. What stands does not move; the swing foot and the height give way to the COM.
pub(super) const DYNAMICS: Weights = Weights {
    stance: 1e5,
    swing: 30.0,
    com: 100.0,
    height: 30.0,
    trunk: 1.0,
    arms: 1.0,
    legs: 0.02,
    limit: 5.0,
    base: 1e-6,
};

/// A reference stays this far from a joint's limit (rad): a straight leg has no velocity to offer along itself.
const LIMIT_MARGIN_RAD: f64 = 0.1;

/// Jacobians of the tasks at a posture: columns are the generalised velocity (base linear, base angular, joints).
#[derive(Debug, Clone)]
pub(super) struct TaskJacobians {
    pub com: Matrix3xX<f64>,
    /// Of each sole's centre: linear, angular.
    pub soles: PerFoot<Matrix6xX<f64>>,
    /// Of the trunk's origin.
    pub trunk: Matrix6xX<f64>,
}

impl TaskJacobians {
    pub fn new(robot: &Robot) -> Self {
        let size = 6 + robot.joints.len();
        Self {
            com: Matrix3xX::zeros(size),
            soles: PerFoot::from_fn(|_| Matrix6xX::zeros(size)),
            trunk: Matrix6xX::zeros(size),
        }
    }

    /// At the posture of `kinematics`.
    pub fn update(&mut self, robot: &Robot, kinematics: &Kinematics) {
        for foot in Foot::BOTH {
            let center = sole_center(robot, kinematics, foot);
            kinematics.point_jacobian(robot, robot.soles[foot].link, &center, &mut self.soles[foot]);
        }
        kinematics.com_jacobian(robot, &mut self.com);
        kinematics.point_jacobian(robot, robot.trunk, &trunk_origin(robot, kinematics), &mut self.trunk);
    }
}

/// Centre of a sole's contact face, world (m).
pub(super) fn sole_center(robot: &Robot, kinematics: &Kinematics, foot: Foot) -> Point3<f64> {
    kinematics.sole_pose(robot, foot).translation.vector.into()
}

/// Origin of the trunk's frame, world (m).
pub(super) fn trunk_origin(robot: &Robot, kinematics: &Kinematics) -> Point3<f64> {
    kinematics.link_pose(robot.trunk).translation.vector.into()
}

/// Normal equations `A v = b` of `min sum of weight (row v - target)^2`, for N targets at once. Only the lower triangle of A is
/// kept, which is all that a Cholesky factorisation reads.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations<const N: usize> {
    pub matrix: DMatrix<f64>,
    pub right: [DVector<f64>; N],
    /// The row that is added, side by side.
    row: DVector<f64>,
}

impl<const N: usize> NormalEquations<N> {
    pub fn new(size: usize) -> Self {
        let zeros = DVector::zeros(size);
        Self { matrix: DMatrix::zeros(size, size), right: std::array::from_fn(|_| zeros.clone()), row: zeros }
    }

    pub fn clear(&mut self) {
        self.matrix.fill(0.0);
        self.right.iter_mut().for_each(|right| right.fill(0.0));
    }

    /// Adds one row for each of the targets.
    pub fn add_row(&mut self, weight: f64, row: impl Fn(usize) -> f64, targets: [f64; N]) {
        let size = self.row.len();
        self.row.iter_mut().enumerate().for_each(|(i, entry)| *entry = row(i));
        let row = self.row.as_slice();
        for j in 0..size {
            let scaled = weight * row[j];
            if scaled == 0.0 {
                continue;
            }
            // Columns lie side by side.
            let below = &mut self.matrix.as_mut_slice()[j * size + j..(j + 1) * size];
            below.iter_mut().zip(&row[j..]).for_each(|(entry, value)| *entry += scaled * value);
            for (right, target) in self.right.iter_mut().zip(targets) {
                right[j] += scaled * target;
            }
        }
    }
}

/// Whether each joint is on the way from the base to a sole.
pub(super) fn legs(robot: &Robot) -> Vec<bool> {
    let mut in_leg = vec![false; robot.joints.len()];
    for foot in Foot::BOTH {
        for joint in robot.chain(robot.soles[foot].link) {
            in_leg[joint] = true;
        }
    }
    in_leg
}

/// Angles that a joint is sent to (rad): its limits less the margin, but not less than home.
pub(super) fn reachable(joint: &Joint, home_rad: f64) -> [f64; 2] {
    [(joint.lower_rad + LIMIT_MARGIN_RAD).min(home_rad), (joint.upper_rad - LIMIT_MARGIN_RAD).max(home_rad)]
}
