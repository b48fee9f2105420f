//! Inverse dynamics of the whole body: joint torques for desired accelerations of COM, trunk, soles and joints, with
//! contact forces that the soles and friction can supply.
//!
//! One least-squares problem yields the generalised acceleration a and the contact forces f together. The tasks are
//! rows `J a = wanted - dJ/dt v`, with J the task Jacobian, v the generalised velocity, and weights that rank the
//! tasks. Summed up, they are `min 1/2 a' H a - g' a + rho/2 |f|^2`. The base has no motor, so its six equations of
//! motion `M_b a + h_b = B f` hold exactly: M_b and h_b are its rows of mass matrix and bias forces, and B maps f to a
//! wrench on the base. Each stance sole presses at four corners; the force at each corner is a sum of non-negative
//! forces along the four edges of a pyramid inside its friction cone.
//!
//! With l the force that enforces the base's equations, `a = H^-1 (g + M_b' l)` and `S l = B f - r`. Here
//! `S = M_b H^-1 M_b'`, and `r = h_b + M_b H^-1 g` is the wrench that the tasks ask for. It remains to find the contact
//! forces whose wrench is nearest to r, measured by the tasks' own cost:
//! `min 1/2 (B f - r)' S^-1 (B f - r) + rho/2 |f|^2` over `f >= 0`, which [`Nnls`] solves. So the accelerations are
//! those that the ground can supply. The joint torques are then `tau = M a + h - J' f`.

use super::nnls::{Nnls, Quadratic, SIZE, Unknowns};
use super::tasks::{
    DYNAMICS, NormalEquations, SWING_SOLE, TaskJacobians, led_axes, legs, reachable, trunk_origin,
    weight_of_lengths,
};
use crate::robot::dynamics::Dynamics;
use crate::robot::{Foot, GRAVITY, Kinematics, PerFoot, Pose, Posture, Robot, Units};
use crate::socket::Wrench;
use nalgebra::{
    Cholesky, DMatrix, DVector, Matrix6, MatrixXx6, Point2, Point3, SMatrix, Vector3, Vector6,
};

/// Rate of the critically damped spring that drives a joint back from its limit, as a multiple of omega.
const LIMIT_RATE: f64 = 3.55;
/// Weight of the squared contact forces, with forces as multiples of the robot's weight and joint accelerations as
/// multiples of omega^2. It is small, and shares a load evenly among the corners.
const RHO: f64 = 6e-6;

/// Damping of a step of a leg's joints; it matters for a leg that is nearly straight.
const STEP_DAMPING: f64 = 1e-3;

const EDGES: usize = 4;
const PER_SOLE: usize = 4 * EDGES;

/// Limits of the contact forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactModel {
    /// Friction coefficient on which the contact forces may rely.
    pub friction: f64,
    /// Share of each sole's length and width, about its centre, on which it may press.
    pub sole_share: f64,
}

/// Desired accelerations, world frame.
#[derive(Debug, Clone)]
pub struct DesiredAcceleration {
    /// Acceleration of the COM (m/s^2).
    pub com_acc: Vector3<f64>,
    /// Angular acceleration of the trunk (rad/s^2).
    pub trunk_acc: Vector3<f64>,
    /// Linear (m/s^2) and angular (rad/s^2) acceleration of each sole at its centre; 0 for a stance sole.
    pub sole_acc: PerFoot<[Vector3<f64>; 2]>,
    /// Acceleration of each joint (rad/s^2), as far as the tasks above leave it open.
    pub joint_acc: Vec<f64>,
    /// Which soles stand on the ground.
    pub standing: PerFoot<bool>,
}

impl DesiredAcceleration {
    /// All accelerations are zero.
    pub fn rest(robot: &Robot, standing: PerFoot<bool>) -> Self {
        Self {
            com_acc: Vector3::zeros(),
            trunk_acc: Vector3::zeros(),
            sole_acc: PerFoot::default(),
            joint_acc: vec![0.0; robot.joints.len()],
            standing,
        }
    }
}

/// What the model predicts for the computed torques, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedContact {
    /// Acceleration of the COM by the contact forces (m/s^2).
    pub com_acc: Vector3<f64>,
    /// Wrench of the ground on each sole, about its centre, in world axes.
    pub wrenches: PerFoot<Wrench>,
    /// ZMP at the height of the soles (m); None if no sole presses.
    pub zmp: Option<Point2<f64>>,
    /// Largest ratio of joint torque to servo limit. Above 1, the servos cannot supply the torques.
    pub torque_ratio: f64,
    /// Whether the contact forces are optimal. If not, they are feasible, and the iterations ran out.
    pub is_optimal: bool,
}

/// Inverse dynamics of one robot. It allocates only when it is made.
#[derive(Debug, Clone)]
pub struct InverseDynamics {
    contact: ContactModel,
    /// Weight of the robot (N).
    weight_n: f64,
    in_leg: Vec<bool>,
    /// The factor of [`weight_of_lengths`].
    of_lengths: f64,
    /// Weight of the squared contact forces (1/(N s^2)^2), rho of the module's text.
    rho: f64,
    /// Rate of [`LIMIT_RATE`] (1/s).
    limit_rate: f64,
    /// Joint torques of the last solve (N m), one per joint.
    pub tau: Vec<f64>,
    /// Generalised acceleration of the last solve: base linear, base angular (both in world axes), joints.
    pub acceleration: DVector<f64>,
    kinematics: Kinematics,
    dynamics: Dynamics,
    jacobians: TaskJacobians,
    /// H and g of the module's text.
    equations: NormalEquations<1>,
    /// L^-1 M_b', with H = L L'.
    coupling: MatrixXx6<f64>,
    /// B: column i is the wrench on the base (force, and moment about the base's origin) of unknown force i.
    spread: SMatrix<f64, 6, SIZE>,
    /// Direction of each unknown force, and the point where it acts (world frame).
    edges: [Vector3<f64>; SIZE],
    points: [Point3<f64>; SIZE],
    quadratic: Quadratic,
    nnls: Nnls,
}

impl InverseDynamics {
    /// Inverse dynamics of a robot whose contact forces have the limits of `contact`.
    pub fn new(robot: &Robot, contact: ContactModel) -> Self {
        let (size, units) = (6 + robot.joints.len(), Units::of(robot));
        Self {
            contact,
            weight_n: robot.weight_n(),
            in_leg: legs(robot),
            of_lengths: weight_of_lengths(robot),
            rho: RHO * (units.omega().powi(2) / units.weight_n()).powi(2),
            limit_rate: LIMIT_RATE * units.omega(),
            tau: vec![0.0; robot.joints.len()],
            acceleration: DVector::zeros(size),
            kinematics: Kinematics::new(robot),
            dynamics: Dynamics::new(robot),
            jacobians: TaskJacobians::new(robot),
            equations: NormalEquations::new(size),
            coupling: MatrixXx6::zeros(size),
            spread: SMatrix::zeros(),
            edges: [Vector3::zeros(); SIZE],
            points: [Point3::origin(); SIZE],
            quadratic: Quadratic::zeros(),
            nnls: Nnls::default(),
        }
    }

    /// Finds the joint torques ([`tau`](Self::tau)) and accelerations for `wanted`, at `posture` and the generalised
    /// `velocity` (6 + n entries: base linear, base angular, joints). It does not allocate. Returns None if numbers are
    /// so extreme that there is no solution; torques and accelerations are then meaningless.
    pub fn solve(
        &mut self,
        robot: &Robot,
        posture: &Posture,
        velocity: &DVector<f64>,
        wanted: &DesiredAcceleration,
    ) -> Option<PredictedContact> {
        self.kinematics.update(robot, posture);
        self.dynamics.update(robot, &self.kinematics, velocity);
        self.jacobians.update(robot, &self.kinematics);
        self.equations.clear();
        self.add_soles(robot, wanted);
        self.add_com(wanted);
        self.add_trunk(robot, wanted);
        self.add_joints(robot, posture, velocity, wanted);
        self.place_forces(robot, wanted);
        self.solve_tasks(wanted)?;
        self.find_torques();
        Some(self.predict(robot, wanted))
    }

    /// Steps of the joints of a leg (index, and angle in rad) that bring its sole to `pose` while the base stays where it
    /// is: a damped Newton step from the posture of the last solve. A rotation of 1 rad counts like `length_m` (m).
    pub fn leg_step<'a>(
        &'a self,
        robot: &'a Robot,
        foot: Foot,
        pose: &Pose,
        length_m: f64,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let sole = self.kinematics.sole_pose(robot, foot);
        let linear = (pose.translation.vector - sole.translation.vector) / length_m;
        let angular = (pose.rotation * sole.rotation.inverse()).scaled_axis();
        let column = move |j: usize| {
            let mut column = self.jacobians.soles[foot].column(6 + j).into_owned();
            column.fixed_rows_mut::<3>(0).unscale_mut(length_m);
            column
        };
        let error = Vector6::from_iterator(linear.iter().chain(&angular).copied());
        let pull = robot
            .leg(foot)
            .fold(Matrix6::identity() * STEP_DAMPING, |sum, j| {
                sum + column(j) * column(j).transpose()
            })
            .cholesky()
            .map_or(Vector6::zeros(), |factor| factor.solve(&error));
        robot.leg(foot).map(move |j| (j, column(j).dot(&pull)))
    }

    fn add_soles(&mut self, robot: &Robot, wanted: &DesiredAcceleration) {
        for foot in Foot::BOTH {
            let weight = if wanted.standing[foot] {
                DYNAMICS.soles
            } else {
                SWING_SOLE
            };
            let pose = self.kinematics.sole_pose(robot, foot);
            let bias = self.dynamics.point_bias_acc(
                &self.kinematics,
                robot.soles[foot].link,
                &pose.translation.vector.into(),
            );
            let jacobian = &self.jacobians.soles[foot];
            let [linear, angular] = [0, 1].map(|part| wanted.sole_acc[foot][part] - bias[part]);
            for k in 0..3 {
                self.equations
                    .add_row(weight * self.of_lengths, |i| jacobian[(k, i)], [linear[k]]);
            }
            for axis in led_axes(robot, foot, &pose) {
                self.equations.add_row(
                    weight,
                    |i| axis.dot(&jacobian.fixed_view::<3, 1>(3, i)),
                    [axis.dot(&angular)],
                );
            }
        }
    }

    fn add_com(&mut self, wanted: &DesiredAcceleration) {
        let acc = wanted.com_acc - self.dynamics.com_bias_acc();
        for (k, weight) in [DYNAMICS.com, DYNAMICS.com, DYNAMICS.height]
            .into_iter()
            .enumerate()
        {
            self.equations.add_row(
                weight * self.of_lengths,
                |i| self.jacobians.com[(k, i)],
                [acc[k]],
            );
        }
    }

    fn add_trunk(&mut self, robot: &Robot, wanted: &DesiredAcceleration) {
        let origin = trunk_origin(robot, &self.kinematics);
        let [_, bias] = self
            .dynamics
            .point_bias_acc(&self.kinematics, robot.trunk, &origin);
        for k in 0..3 {
            let acc = wanted.trunk_acc[k] - bias[k];
            let weight = if k == 2 { DYNAMICS.yaw } else { DYNAMICS.trunk };
            self.equations
                .add_row(weight, |i| self.jacobians.trunk[(3 + k, i)], [acc]);
        }
    }

    fn add_joints(
        &mut self,
        robot: &Robot,
        posture: &Posture,
        velocity: &DVector<f64>,
        wanted: &DesiredAcceleration,
    ) {
        let NormalEquations {
            matrix,
            right: [target],
            ..
        } = &mut self.equations;
        for i in 0..6 {
            matrix[(i, i)] += DYNAMICS.base * if i < 3 { self.of_lengths } else { 1.0 };
        }
        for (j, joint) in robot.joints.iter().enumerate() {
            let mut add = |weight: f64, acc: f64| {
                matrix[(6 + j, 6 + j)] += weight;
                target[6 + j] += weight * acc;
            };
            add(
                if self.in_leg[j] {
                    DYNAMICS.legs
                } else {
                    DYNAMICS.arms
                },
                wanted.joint_acc[j],
            );
            let [lower, upper] = reachable(joint, robot.home_rad[j]);
            let beyond = posture.q[j] - posture.q[j].clamp(lower, upper);
            if beyond != 0.0 {
                let rate = self.limit_rate;
                add(
                    DYNAMICS.limit,
                    -rate * (rate * beyond + 2.0 * velocity[6 + j]),
                );
            }
        }
    }

    /// Sets the point and direction of each unknown force, and its wrench on the base.
    fn place_forces(&mut self, robot: &Robot, wanted: &DesiredAcceleration) {
        let base = self.kinematics.link_pose(0).translation.vector;
        for (side, foot) in Foot::BOTH.into_iter().enumerate() {
            let sole = self.kinematics.sole_pose(robot, foot);
            for (k, corner) in robot.soles[foot]
                .pressable_corners(self.weight_n)
                .iter()
                .enumerate()
            {
                let point = sole * (corner * self.contact.sole_share);
                for edge in 0..EDGES {
                    let lean = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()][edge];
                    let direction = sole.rotation * (Vector3::z() + lean * self.contact.friction);
                    let i = side * PER_SOLE + k * EDGES + edge;
                    (self.edges[i], self.points[i]) = (direction, point);
                    let mut column = self.spread.column_mut(i);
                    if wanted.standing[foot] {
                        column.fixed_rows_mut::<3>(0).copy_from(&direction);
                        column
                            .fixed_rows_mut::<3>(3)
                            .copy_from(&(point.coords - base).cross(&direction));
                    } else {
                        column.fill(0.0);
                    }
                }
            }
        }
    }

    /// Solves for accelerations and contact forces; None if the equations have no solution.
    fn solve_tasks(&mut self, wanted: &DesiredAcceleration) -> Option<()> {
        let NormalEquations {
            matrix,
            right: [target],
            ..
        } = &mut self.equations;
        let size = target.len();
        let Some(factor) = Cholesky::new(std::mem::replace(matrix, DMatrix::zeros(0, 0))) else {
            *matrix = DMatrix::zeros(size, size);
            return None;
        };
        let l = factor.l_dirty();
        let mass_matrix = self.dynamics.mass_matrix();
        for k in 0..6 {
            for i in 0..size {
                self.coupling[(i, k)] = mass_matrix[(i, k)];
            }
        }
        l.solve_lower_triangular_mut(&mut self.coupling);
        l.solve_lower_triangular_mut(target);
        let column = |k: usize| self.coupling.column(k);
        let yielding = Matrix6::from_fn(|i, k| column(i).dot(&column(k)));
        let asked = Vector6::from_fn(|k, _| self.dynamics.bias()[k] + column(k).dot(target));
        let stiffness = yielding.cholesky().map(|yielding| yielding.inverse());
        if let Some(stiffness) = stiffness {
            let spread = &self.spread;
            let weighted = stiffness * spread;
            self.quadratic = spread.transpose() * weighted + Quadratic::identity() * self.rho;
            let linear: Unknowns = weighted.transpose() * asked;
            let allowed: [bool; SIZE] =
                std::array::from_fn(|i| wanted.standing[Foot::BOTH[i / PER_SOLE]]);
            self.nnls.solve(&self.quadratic, &linear, &allowed);
            let excess = stiffness * (spread * self.nnls.f - asked);
            for i in 0..size {
                let along: f64 = (0..6).map(|k| self.coupling[(i, k)] * excess[k]).sum();
                self.acceleration[i] = target[i] + along;
            }
            l.ad_solve_lower_triangular_mut(&mut self.acceleration);
        }
        *matrix = factor.unpack_dirty();
        stiffness.map(|_| ())
    }

    fn find_torques(&mut self) {
        let (mass_matrix, bias) = (self.dynamics.mass_matrix(), self.dynamics.bias());
        for (j, tau) in self.tau.iter_mut().enumerate() {
            *tau = mass_matrix.column(6 + j).dot(&self.acceleration) + bias[6 + j];
        }
        for (i, &f) in self.nnls.f.iter().enumerate().filter(|(_, f)| **f > 0.0) {
            let jacobian = &self.jacobians.soles[Foot::BOTH[i / PER_SOLE]];
            // The Jacobian is taken at the sole's centre.
            let (force, moment) = (self.edges[i] * f, self.lever(i).cross(&(self.edges[i] * f)));
            for (j, tau) in self.tau.iter_mut().enumerate() {
                let column = jacobian.column(6 + j);
                *tau -=
                    column.fixed_rows::<3>(0).dot(&force) + column.fixed_rows::<3>(3).dot(&moment);
            }
        }
    }

    /// Vector from the centre of the sole to the point of an unknown force (m).
    fn lever(&self, i: usize) -> Vector3<f64> {
        let first = i / PER_SOLE * PER_SOLE;
        // The corners are in order around the sole, so the third lies opposite to the first.
        let center = nalgebra::center(&self.points[first], &self.points[first + 2 * EDGES]);
        self.points[i] - center
    }

    fn predict(&self, robot: &Robot, wanted: &DesiredAcceleration) -> PredictedContact {
        let mut wrenches = PerFoot::<Wrench>::default();
        let (mut force, mut pressed, mut press) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (i, &f) in self.nnls.f.iter().enumerate() {
            let wrench = &mut wrenches[Foot::BOTH[i / PER_SOLE]];
            wrench.force += self.edges[i] * f;
            wrench.moment += self.lever(i).cross(&(self.edges[i] * f));
            force += self.edges[i] * f;
            press += self.edges[i].z * f;
            pressed += self.points[i].coords * (self.edges[i].z * f);
        }
        debug_assert!(
            Foot::BOTH
                .iter()
                .all(|&f| wanted.standing[f] || wrenches[f] == Wrench::default())
        );
        PredictedContact {
            com_acc: force / robot.mass() - Vector3::z() * GRAVITY,
            wrenches,
            zmp: (press > 0.0).then(|| (pressed / press).xy().into()),
            torque_ratio: self
                .tau
                .iter()
                .zip(&robot.servos)
                .map(|(tau, servo)| tau.abs() / servo.torque_n_m)
                .fold(0.0, f64::max),
            is_optimal: self.nnls.is_optimal,
        }
    }
}
