//! What a policy observes at an action: the state of the base, which follows from the sensors, and the terms of its file.

use crate::terms::{Gait, Quantity, Stack, Term};
use nalgebra::{Isometry3, Matrix6xX, Translation3, UnitQuaternion, Vector3};
use standfast_core::robot::{Foot, Kinematics, PerFoot, Posture, Robot};
use standfast_core::socket::Sensed;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// The state of the base. It follows from the sensors: the IMU is in the trunk, and the joints in between are known.
#[derive(Clone)]
pub struct Base {
    kinematics: Kinematics,
    posture: Posture,
    jacobian: Matrix6xX<f64>,
    /// Velocity (m/s), angular velocity (rad/s) and direction of gravity, in the axes of the base.
    linear: Vector3<f64>,
    angular: Vector3<f64>,
    gravity: Vector3<f64>,
    /// The orientation of the base in the world.
    to_world: UnitQuaternion<f64>,
}

impl Base {
    pub fn new(robot: &Robot) -> Self {
        Self {
            kinematics: Kinematics::at_home(robot),
            posture: robot.home_posture(),
            jacobian: Matrix6xX::zeros(6 + robot.joints.len()),
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
            gravity: -Vector3::z(),
            to_world: UnitQuaternion::identity(),
        }
    }

    pub fn update(&mut self, robot: &Robot, sensed: &Sensed) {
        self.posture.q.copy_from_slice(&sensed.q);
        self.posture.base = Isometry3::identity();
        self.kinematics.update(robot, &self.posture);
        // From here on, vectors are in the axes of the base.
        let trunk = self.kinematics.link_pose(robot.trunk).rotation;
        self.to_world = sensed.imu.orientation * trunk.inverse();
        let between: Vector3<f64> = robot
            .chain(robot.trunk)
            .map(|joint| self.kinematics.joint_axis(joint) * sensed.dq[joint])
            .sum();
        self.gravity = self.to_world.inverse() * -Vector3::z();
        self.angular = trunk * sensed.imu.gyro - between;
        let load = PerFoot::from_fn(|foot| sensed.soles[foot].force.norm());
        let stance = if load[Foot::Left] >= load[Foot::Right] {
            Foot::Left
        } else {
            Foot::Right
        };
        let sole = self.kinematics.sole_pose(robot, stance);
        let Translation3 { vector } = sole.translation;
        self.kinematics.point_jacobian(
            robot,
            robot.soles[stance].link,
            &vector.into(),
            &mut self.jacobian,
        );
        // The sole rests: 0 = v + omega x r + J dq.
        let mut moves = self.angular.cross(&vector);
        for (joint, dq) in sensed.dq.iter().enumerate() {
            moves += self.jacobian.fixed_view::<3, 1>(0, 6 + joint) * *dq;
        }
        self.linear = -moves;
    }
}

/// The quantities that a policy can observe at an action.
pub struct Observation<'a> {
    pub base: &'a Base,
    pub command: [f64; 3],
    pub joint_positions: Vec<f64>,
    pub joint_velocities: Vec<f64>,
}

/// The data that a policy keeps from one action to the next.
#[derive(Clone)]
pub struct Memory {
    last_action: Vec<f32>,
    /// Phases of the left and the right foot (rad), and their (cos, sin) in the observation.
    phase_rad: [f64; 2],
    seen: [[f64; 2]; 2],
    /// The last values of each term, and the last frames of each input, the oldest first.
    past: Vec<VecDeque<Vec<f32>>>,
    past_frames: Vec<VecDeque<Vec<f32>>>,
}

impl Memory {
    pub fn new(terms: &[Term], gait: Option<&Gait>, command: [f64; 3], joints: usize) -> Self {
        let phase_rad = gait.map_or([0.0; 2], |gait| gait.start_rad);
        Self {
            last_action: vec![0.0; joints],
            phase_rad,
            seen: gait.map_or([[0.0; 2]; 2], |gait| gait.seen(phase_rad, command)),
            past: vec![VecDeque::new(); terms.len()],
            past_frames: vec![VecDeque::new(); terms.len()],
        }
    }

    /// The observation as the network takes it: a list for each input, in the order in which the terms name the inputs.
    pub fn observe(&mut self, terms: &[Term], frames: Stack, seen: &Observation) -> Vec<Vec<f32>> {
        let mut inputs: Vec<(&Option<String>, Vec<f32>)> = Vec::new();
        for (i, term) in terms.iter().enumerate() {
            let now = term.scaled(self.value(term, seen));
            let stacked = term.history.stacked(&mut self.past[i], now);
            match inputs.iter_mut().find(|(input, _)| *input == &term.input) {
                Some((_, frame)) => frame.extend(stacked),
                None => inputs.push((&term.input, stacked)),
            }
        }
        inputs
            .into_iter()
            .zip(&mut self.past_frames)
            .map(|((_, frame), past)| frames.stacked(past, frame))
            .collect()
    }

    fn value(&self, term: &Term, seen: &Observation) -> Vec<f64> {
        let base = seen.base;
        let [walk_x, walk_y, turn] = seen.command;
        let [[left_cos, left_sin], [right_cos, right_sin]] = self.seen;
        match term.term {
            Quantity::BaseLinearVelocity => base.linear.as_slice().into(),
            Quantity::BaseAngularVelocity => base.angular.as_slice().into(),
            Quantity::ProjectedGravity => base.gravity.as_slice().into(),
            Quantity::EulerAngles => {
                let (roll, pitch, yaw) = base.to_world.euler_angles();
                vec![roll, pitch, yaw]
            }
            Quantity::Orientation => {
                let quaternion = base.to_world;
                vec![quaternion.w, quaternion.i, quaternion.j, quaternion.k]
            }
            Quantity::Command => seen.command.into(),
            Quantity::CommandWalk => vec![walk_x, walk_y],
            Quantity::CommandTurn => vec![turn],
            Quantity::JointPositions => seen.joint_positions.clone(),
            Quantity::JointVelocities => seen.joint_velocities.clone(),
            Quantity::LastAction => self.last_action.iter().map(|&value| value.into()).collect(),
            Quantity::PhaseSin => vec![left_sin, right_sin],
            Quantity::PhaseCos => vec![left_cos, right_cos],
            Quantity::Phase => vec![left_sin, left_cos],
            Quantity::PhaseLeftSin => vec![left_sin],
            Quantity::PhaseLeftCos => vec![left_cos],
            Quantity::Constant => term.values.clone(),
        }
    }

    /// Keeps an action, and advances the clock of the gait by `period_s`.
    pub fn remember(
        &mut self,
        action: Vec<f32>,
        gait: Option<&Gait>,
        command: [f64; 3],
        period_s: f64,
    ) {
        self.last_action = action;
        if let Some(gait) = gait {
            self.phase_rad = self
                .phase_rad
                .map(|phase_rad| (phase_rad + TAU * gait.hz * period_s) % TAU);
            self.seen = gait.seen(self.phase_rad, command);
        }
    }
}
