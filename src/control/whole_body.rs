//! Whole body: joint angles for a wanted COM, soles, trunk and arms by inverse kinematics with the COG Jacobian
//! (paper, Sect. VI.A: "desired joint angle vector is obtained from the desired COG position by solving the inverse
//! kinematics with COG Jacobian").
//!
//! One Newton step a tick on a reference posture that lives beside the measured one: weighted least squares over the
//! base's six and the joints' velocities. The weights rank the tasks: soles, joint limits, COM, trunk, posture.

use crate::robot::{Foot, Joint, Kinematics, PerFoot, Pose, Posture, Robot};
use nalgebra::{Cholesky, DMatrix, DVector, Isometry3, Matrix3xX, Matrix6xX, Point3, UnitQuaternion, Vector3};

/// Weights of squared errors (metres and radians alike).
const SOLES: f64 = 1e4;
const COM: f64 = 1e2;
/// Height gives way where legs are too short for a long stride.
const HEIGHT: f64 = 1.0;
const TRUNK: f64 = 1e1;
/// Joints outside of the legs stay at home.
const ARMS: f64 = 1.0;
/// Leg joints: only so that the problem always has one solution.
const LEGS: f64 = 1e-6;
/// A joint that would pass its limit is held there,
const LIMIT: f64 = 1e6;
/// or rather this much before it (rad): a straight leg has no velocity to offer along itself.
const LIMIT_MARGIN_RAD: f64 = 0.1;
/// The base's own velocities, likewise.
const BASE: f64 = 1e-9;
/// Joint limits are re-checked at most this often a tick.
const LIMIT_ROUNDS: usize = 3;

/// What the body shall do: poses in the world, at this tick.
#[derive(Debug, Clone)]
pub struct Task {
    /// Centre of mass (m).
    pub com: Point3<f64>,
    /// The COM rises by this much at most in a tick (m).
    pub rise: f64,
    /// (m/s)
    pub com_vel: Vector3<f64>,
    /// Centre of each contact face.
    pub soles: PerFoot<Pose>,
    /// Velocity of each sole's centre (m/s); that soles turn is left out.
    pub sole_vel: PerFoot<Vector3<f64>>,
    /// Orientation.
    pub trunk: UnitQuaternion<f64>,
}

/// Inverse kinematics of one robot. Allocates once.
#[derive(Debug)]
pub struct WholeBody {
    /// The reference: where the joints are sent.
    pub posture: Posture,
    /// Velocity of the reference: base linear, base angular, joints.
    pub velocity: DVector<f64>,
    kinematics: Kinematics,
    in_leg: Vec<bool>,
    com_jacobian: Matrix3xX<f64>,
    body_jacobian: Matrix6xX<f64>,
    normal: DMatrix<f64>,
    factor: DMatrix<f64>,
    error: DVector<f64>,
    step: DVector<f64>,
    /// Weighted, of all tasks.
    squared_error: f64,
}

impl WholeBody {
    /// Starts at home.
    pub fn new(robot: &Robot) -> Self {
        let size = 6 + robot.joints.len();
        Self {
            posture: robot.home_posture(),
            velocity: DVector::zeros(size),
            kinematics: Kinematics::new(robot),
            in_leg: legs(robot),
            com_jacobian: Matrix3xX::zeros(size),
            body_jacobian: Matrix6xX::zeros(size),
            normal: DMatrix::zeros(size, size),
            factor: DMatrix::zeros(size, size),
            error: DVector::zeros(size),
            step: DVector::zeros(size),
            squared_error: 0.0,
        }
    }

    /// Moves the reference posture towards `task` by one Newton step and sets its velocity.
    pub fn follow(&mut self, robot: &Robot, task: &Task) {
        self.kinematics.update(robot, &self.posture);
        self.normal.fill(0.0);
        self.error.fill(0.0);
        self.velocity.fill(0.0);
        self.add_soles(robot, task);
        self.add_com(robot, task);
        self.add_trunk(robot, task);
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
            *q = (*q + self.step[6 + i]).clamp(robot.joints[i].lower_rad, robot.joints[i].upper_rad);
        }
    }

    /// Height of the COM of the reference posture (m).
    pub fn com_height(&mut self, robot: &Robot) -> f64 {
        self.kinematics.update(robot, &self.posture);
        self.kinematics.com().z
    }

    fn add_soles(&mut self, robot: &Robot, task: &Task) {
        for foot in Foot::BOTH {
            let pose = self.kinematics.sole_pose(robot, foot);
            let point = Point3::from(pose.translation.vector);
            self.kinematics.point_jacobian(robot, robot.soles[foot].link, &point, &mut self.body_jacobian);
            let wanted = &task.soles[foot];
            let linear = wanted.translation.vector - pose.translation.vector;
            let angular = (wanted.rotation * pose.rotation.inverse()).scaled_axis();
            for k in 0..3 {
                self.add_row(SOLES, Row::Body(k), linear[k], task.sole_vel[foot][k]);
                self.add_row(SOLES, Row::Body(3 + k), angular[k], 0.0);
            }
        }
    }

    fn add_com(&mut self, robot: &Robot, task: &Task) {
        self.kinematics.com_jacobian(robot, &mut self.com_jacobian);
        let mut error = task.com - self.kinematics.com();
        // A body that a long stride has lowered must not leap off the ground when a foot is lifted again.
        error.z = error.z.min(task.rise);
        for (k, weight) in [COM, COM, HEIGHT].into_iter().enumerate() {
            self.add_row(weight, Row::Com(k), error[k], task.com_vel[k]);
        }
    }

    fn add_trunk(&mut self, robot: &Robot, task: &Task) {
        let pose = *self.kinematics.link_pose(robot.trunk);
        let point = Point3::from(pose.translation.vector);
        self.kinematics.point_jacobian(robot, robot.trunk, &point, &mut self.body_jacobian);
        let angular = (task.trunk * pose.rotation.inverse()).scaled_axis();
        for k in 0..3 {
            self.add_row(TRUNK, Row::Body(3 + k), angular[k], 0.0);
        }
    }

    fn add_posture(&mut self, robot: &Robot) {
        for i in 0..6 {
            self.normal[(i, i)] += BASE;
        }
        for (j, &home) in robot.home_rad.iter().enumerate() {
            let weight = if self.in_leg[j] { LEGS } else { ARMS };
            self.normal[(6 + j, 6 + j)] += weight;
            self.error[6 + j] += weight * (home - self.posture.q[j]);
        }
    }

    /// Damping by the squared error of what cannot be reached (T. Sugihara's Levenberg-Marquardt): none worth mention
    /// while all tasks are met, and no leap of the joints when they cannot be.
    fn add_damping(&mut self) {
        for i in 0..self.error.len() {
            self.normal[(i, i)] += 0.5 * self.squared_error;
        }
        self.squared_error = 0.0;
    }

    /// Adds `weight (J v - target)^2` to the normal equations, for the displacement and for the velocity.
    fn add_row(&mut self, weight: f64, row: Row, displacement: f64, velocity: f64) {
        let size = self.error.len();
        self.squared_error += weight * displacement * displacement;
        let entry = |i: usize| match row {
            Row::Body(k) => self.body_jacobian[(k, i)],
            Row::Com(k) => self.com_jacobian[(k, i)],
        };
        for j in 0..size {
            let scaled = weight * entry(j);
            if scaled == 0.0 {
                continue;
            }
            // The lower triangle is all that the factorisation reads.
            for i in j..size {
                self.normal[(i, j)] += scaled * entry(i);
            }
            self.error[j] += scaled * displacement;
            self.velocity[j] += scaled * velocity;
        }
    }

    /// Solves for displacement and velocity; joints that would pass a limit are pinned to it and the rest solved anew.
    fn solve_within_limits(&mut self, robot: &Robot) {
        let wanted_velocity = self.velocity.clone_owned();
        for _ in 0..LIMIT_ROUNDS {
            self.factor.copy_from(&self.normal);
            let Some(factor) = Cholesky::new(std::mem::replace(&mut self.factor, DMatrix::zeros(0, 0))) else {
                self.factor = self.normal.clone();
                self.step.fill(0.0);
                self.velocity.fill(0.0);
                return;
            };
            self.step.copy_from(&self.error);
            factor.solve_mut(&mut self.step);
            self.velocity.copy_from(&wanted_velocity);
            factor.solve_mut(&mut self.velocity);
            self.factor = factor.unpack_dirty();
            let mut pinned = false;
            for (j, joint) in robot.joints.iter().enumerate() {
                let (q, i) = (self.posture.q[j], 6 + j);
                let next = q + self.step[i];
                let [lower, upper] = reachable(joint, robot.home_rad[j]);
                let limit = next.clamp(lower, upper);
                if (next - limit).abs() > 1e-9 && self.normal[(i, i)] < LIMIT {
                    self.normal[(i, i)] += LIMIT;
                    self.error[i] += LIMIT * (limit - q);
                    pinned = true;
                }
            }
            if !pinned {
                return;
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

/// A row of one of the two Jacobians at hand.
#[derive(Clone, Copy)]
enum Row {
    Body(usize),
    Com(usize),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What has become of a task that was reached for.
    struct Followed {
        /// Largest distance of COM (over the ground, and in height) and soles from where they are to be (m).
        com: f64,
        height: f64,
        soles: f64,
        /// Largest change of a joint reference in a tick: of all ticks, and of the last (rad).
        leap: f64,
        last: f64,
    }

    /// From home, the feet moved by `[left, right]` (m) and the COM at home height over their middle.
    fn stride(robot: &Robot, by: [Vector3<f64>; 2]) -> Task {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        let mut soles = PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot));
        for (foot, by) in Foot::BOTH.into_iter().zip(by) {
            soles[foot].translation.vector += by;
        }
        Task {
            com: kinematics.com() + 0.5 * (by[0] + by[1]),
            rise: f64::INFINITY,
            com_vel: Vector3::zeros(),
            soles,
            sole_vel: PerFoot::default(),
            trunk: UnitQuaternion::identity(),
        }
    }

    /// A stride of least jerk, as a swing foot's, in 0.2 s; then 500 ticks in which nothing more is asked.
    fn follow(robot: &Robot, left: [f64; 2], right: [f64; 2]) -> Followed {
        let by = [left, right].map(|[x, y]| Vector3::new(x, y, 0.0));
        let mut body = WholeBody::new(robot);
        let (mut leap, mut last) = (0.0_f64, 0.0);
        let mut task = stride(robot, by);
        for k in 1..=600 {
            let before = body.posture.q.clone();
            let u = f64::from(k.min(100)) / 100.0;
            let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            task = stride(robot, by.map(|by| by * share));
            body.follow(robot, &task);
            last = body.posture.q.iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            leap = leap.max(last);
        }
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &body.posture);
        let missed = |foot: Foot| {
            let away = task.soles[foot].inverse() * kinematics.sole_pose(robot, foot);
            away.translation.vector.norm().max(away.rotation.angle())
        };
        let com = kinematics.com() - task.com;
        let soles = missed(Foot::Left).max(missed(Foot::Right));
        Followed { com: com.xy().norm(), height: com.z.abs(), soles, leap, last }
    }

    const HERE: [f64; 2] = [0.0, 0.0];

    /// The height gives way to the arms, by micrometres.
    #[test]
    fn what_the_legs_can_reach_is_reached() {
        let robot = Robot::load("ut-mu2").unwrap();
        for (left, right) in
            [(HERE, HERE), (HERE, [0.06, 0.0]), (HERE, [-0.1, -0.05]), ([0.1, 0.0], HERE), ([0.0, 0.08], [0.02, 0.0])]
        {
            let Followed { com, height, soles, .. } = follow(&robot, left, right);
            assert!(com < 1e-6 && soles < 1e-6 && height < 5e-5, "{left:?} {right:?}: {com} {soles} {height}");
        }
    }

    /// Feet so far apart that a leg is straight at home height. Joints once leapt by radians there.
    #[test]
    fn what_the_legs_cannot_reach_is_approached_without_a_leap() {
        let robot = Robot::load("ut-mu2").unwrap();
        for (left, right) in [
            (HERE, [0.18, 0.0]),
            (HERE, [-0.18, 0.0]),
            ([0.25, 0.0], HERE),
            ([0.2, 0.05], [-0.2, -0.05]),
            (HERE, [0.0, -0.4]),
        ] {
            let Followed { com, height, soles, leap, last } = follow(&robot, left, right);
            println!("{left:?} {right:?}: COM {com:.1e}, height {height:.1e}, soles {soles:.1e}, {leap:.3} {last:.1e}");
            assert!(leap < 0.2 && last < 1e-9, "{left:?} {right:?}: leaps by {leap} rad, in the end by {last}");
            // The height gives way, not what stands on the ground.
            assert!(com < 5e-3 && soles < 1e-3 && height > 1e-3, "{left:?} {right:?}: {com} {soles} {height}");
        }
    }
}
