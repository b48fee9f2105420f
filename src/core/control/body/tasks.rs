//! The common part of inverse kinematics and inverse dynamics: the tasks (soles, COM, trunk, joints) with their
//! Jacobians, the weights that rank them, and the normal equations of the weighted least-squares problem.

use crate::robot::{Foot, Joint, Kinematics, PerFoot, Pose, Robot};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix6xX, Point3, Vector3};

/// Length whose error costs as much as a rotation error of one radian, in COM heights.
const RADIAN: f64 = 3.2;

/// Weight of a squared length (1/m^2), if a squared angle (rad^2) has the weight 1.
pub(super) fn weight_of_lengths(robot: &Robot) -> f64 {
    (RADIAN * robot.home_com_height()).powi(-2)
}

/// Weight of the squared rotation error of each task. The weight of the squared length is [`weight_of_lengths`] times
/// as large.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    /// Position of a sole, and with accelerations also its rotation. Two weights stand apart: [`SOLE_ROTATION`] for the
    /// rotation with displacements, and [`SWING_SOLE`] for the swing sole with accelerations.
    pub soles: f64,
    /// Horizontal position of the COM.
    pub com: f64,
    pub height: f64,
    pub trunk: f64,
    /// Rotation of the trunk about the vertical.
    pub yaw: f64,
    /// Each joint outside of the legs.
    pub arms: f64,
    /// Each leg joint. This small weight only makes the solution unique.
    pub legs: f64,
    /// A joint at its limit.
    pub limit: f64,
    /// Each of the base's six coordinates. This weight, too, only makes the solution unique.
    pub base: f64,
}

/// Weights of displacements and velocities. Where the legs are too short for a long stride, the trunk turns first, with
/// the soles a little, and then the COM height gives way.
pub(super) const KINEMATICS: Weights = Weights {
    soles: 1e4,
    com: 1e2,
    height: 1e1,
    trunk: 1e1,
    yaw: 1.0,
    arms: 1.0,
    legs: 1e-6,
    limit: 1e6,
    base: 1e-9,
};

/// Weight of the squared rotation error of a sole among [`KINEMATICS`], below those of COM and trunk. With an ankle at its
/// limit the sole rolls onto its edge. If it were kept flat, the knees would stretch, and the robot would leave the
/// ground.
pub(super) const SOLE_ROTATION: f64 = 0.5;

/// Weight of the COM height among [`KINEMATICS`] while the COM is above its target. A straight leg cannot shorten at once.
/// When its sole is lifted, it would push the body up instead, and the robot would leave the ground.
pub(super) const TOO_HIGH: f64 = 300.0;

/// Weights of accelerations. The stance foot does not move; swing foot and COM height give way to the horizontal COM.
pub(super) const DYNAMICS: Weights = Weights {
    soles: 1e5,
    com: 100.0,
    height: 30.0,
    trunk: 1.0,
    yaw: 1.0,
    arms: 1.0,
    legs: 0.02,
    limit: 5.0,
    base: 1e-6,
};

/// Weight of the acceleration of the swing sole among [`DYNAMICS`].
pub(super) const SWING_SOLE: f64 = 30.0;

/// Distance that references keep from joint limits (rad). A straight leg cannot move its foot along the leg.
const LIMIT_MARGIN_RAD: f64 = 0.1;

/// Jacobians of the tasks at a posture. The columns belong to the velocity (base linear, base angular, joints).
#[derive(Debug, Clone)]
pub(super) struct TaskJacobians {
    pub com: Matrix3xX<f64>,
    /// Linear and angular part, at each sole's centre.
    pub soles: PerFoot<Matrix6xX<f64>>,
    /// Linear and angular part, at the trunk's origin.
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

    /// Computes the Jacobians at the posture of `kinematics`.
    pub fn update(&mut self, robot: &Robot, kinematics: &Kinematics) {
        for foot in Foot::BOTH {
            let center = sole_center(robot, kinematics, foot);
            kinematics.point_jacobian(
                robot,
                robot.soles[foot].link,
                &center,
                &mut self.soles[foot],
            );
        }
        kinematics.com_jacobian(robot, &mut self.com);
        kinematics.point_jacobian(
            robot,
            robot.trunk,
            &trunk_origin(robot, kinematics),
            &mut self.trunk,
        );
    }
}

/// Centre of a sole's contact face (m), world frame.
pub(super) fn sole_center(robot: &Robot, kinematics: &Kinematics, foot: Foot) -> Point3<f64> {
    kinematics.sole_pose(robot, foot).translation.vector.into()
}

/// Origin of the trunk's frame (m), world frame.
pub(super) fn trunk_origin(robot: &Robot, kinematics: &Kinematics) -> Point3<f64> {
    kinematics.link_pose(robot.trunk).translation.vector.into()
}

/// Normal equations `A v = b` of `min sum of weight (row v - target)^2`, for N targets at once. Only the lower triangle
/// of A is kept, since a Cholesky factorisation reads nothing else.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations<const N: usize> {
    pub matrix: DMatrix<f64>,
    pub right: [DVector<f64>; N],
    /// The row that is being added, contiguous in memory.
    row: DVector<f64>,
}

impl<const N: usize> NormalEquations<N> {
    pub fn new(size: usize) -> Self {
        let zeros = DVector::zeros(size);
        Self {
            matrix: DMatrix::zeros(size, size),
            right: std::array::from_fn(|_| zeros.clone()),
            row: zeros,
        }
    }

    pub fn clear(&mut self) {
        self.matrix.fill(0.0);
        for right in &mut self.right {
            right.fill(0.0);
        }
    }

    /// Adds one row, with its N targets.
    pub fn add_row(&mut self, weight: f64, row: impl Fn(usize) -> f64, targets: [f64; N]) {
        let size = self.row.len();
        for (i, entry) in self.row.iter_mut().enumerate() {
            *entry = row(i);
        }
        let row = self.row.as_slice();
        for j in 0..size {
            let scaled = weight * row[j];
            if scaled == 0.0 {
                continue;
            }
            // The matrix is stored by columns, so the entries of a column are contiguous.
            let below = &mut self.matrix.as_mut_slice()[j * size + j..(j + 1) * size];
            for (entry, value) in below.iter_mut().zip(&row[j..]) {
                *entry += scaled * value;
            }
            for (right, target) in self.right.iter_mut().zip(targets) {
                right[j] += scaled * target;
            }
        }
    }
}

/// Axes about which a leg can turn its sole (world frame): the axes of the world or, if the ankle has no joint for
/// roll, the pitch and yaw axes of the sole.
pub(super) fn led_axes(
    robot: &Robot,
    foot: Foot,
    sole: &Pose,
) -> impl Iterator<Item = Vector3<f64>> {
    let rolls = robot.soles[foot].ankle.rolls();
    let axes = if rolls {
        Matrix3::identity()
    } else {
        sole.rotation.to_rotation_matrix().into_inner()
    };
    (0..3)
        .filter(move |&k| rolls || k != 0)
        .map(move |k| axes.column(k).into_owned())
}

/// Whether each joint lies between the base and a sole.
pub(super) fn legs(robot: &Robot) -> Vec<bool> {
    let mut in_leg = vec![false; robot.joints.len()];
    for foot in Foot::BOTH {
        for joint in robot.chain(robot.soles[foot].link) {
            in_leg[joint] = true;
        }
    }
    in_leg
}

/// Range of reference angles of a joint (rad): its limits less the margin, extended to its home angle if need be.
pub(super) fn reachable(joint: &Joint, home_rad: f64) -> [f64; 2] {
    [
        (joint.lower_rad + LIMIT_MARGIN_RAD).min(home_rad),
        (joint.upper_rad - LIMIT_MARGIN_RAD).max(home_rad),
    ]
}
