//! What a policy observes: a list of terms, each with its scale, clip and history, in the order of its training.

use nalgebra::{Isometry3, Matrix6xX, Translation3, Vector3};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, Kinematics, PerFoot, Posture, Robot};
use standfast_core::socket::Sensed;
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// Longest history of a term.
const MOST_HISTORY: usize = 1000;
/// Largest velocity of a command that asks for standing (m/s, rad/s).
const STANDS: f64 = 0.01;

/// A part of the observation.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    pub term: Quantity,
    /// Factor of the term.
    #[serde(default)]
    pub scale: Scale,
    /// Largest magnitude of a number, after scaling.
    pub clip: Option<f64>,
    /// Number of values of the term in the observation, the oldest first. Values from before the start are the first
    /// value.
    #[serde(default = "once")]
    pub history: usize,
}

impl Term {
    /// Number of numbers of the term in the observation of a policy with `joints` joints.
    pub fn length(&self, joints: usize) -> usize {
        self.history * self.term.length(joints)
    }

    /// Fails, in words, if the scale does not fit the number of values of the term, for a policy with `joints` joints.
    pub fn check_scale(&self, joints: usize) -> Result<(), String> {
        self.scale.check(self.term.length(joints))
    }

    /// The quantity of the term, in the word of a file.
    pub fn name(&self) -> String {
        let word = toml::Value::try_from(self.term).ok();
        word.as_ref()
            .and_then(toml::Value::as_str)
            .unwrap_or_default()
            .into()
    }
}

/// One factor for all numbers of a term, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Scale {
    All(f64),
    Each(Vec<f64>),
}

impl Default for Scale {
    fn default() -> Self {
        Self::All(1.0)
    }
}

impl Scale {
    fn at(&self, i: usize) -> f64 {
        match self {
            Self::All(scale) => *scale,
            Self::Each(each) => each[i],
        }
    }

    /// Fails, in words, if the scale does not fit a term of `numbers` numbers.
    fn check(&self, numbers: usize) -> Result<(), String> {
        match self {
            Self::Each(each) if each.len() != numbers => {
                Err(format!("{} factors for {numbers} numbers", each.len()))
            }
            _ if (0..numbers).any(|i| !self.at(i).is_finite()) => Err("is not finite".into()),
            _ => Ok(()),
        }
    }
}

fn once() -> usize {
    1
}

/// The quantity of a term. The base is the first link of the URDF, and vectors are in its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Velocity of the base (m/s), estimated from the joints and the sole with more load, as if it did not slide.
    BaseLinearVelocity,
    /// Angular velocity of the base (rad/s).
    BaseAngularVelocity,
    /// The direction of gravity, of length 1.
    ProjectedGravity,
    /// The velocity that the policy is asked for: all three numbers, the first two, and the last one.
    Command,
    CommandWalk,
    CommandTurn,
    /// Angles of the joints less the angles at the action 0 (rad); speeds of the joints (rad/s).
    JointPositions,
    JointVelocities,
    /// The last action, within `action_clip`; 0 at first.
    LastAction,
    /// Sine and cosine of the phases of the left and the right foot.
    PhaseSin,
    PhaseCos,
    /// Sine and cosine of the phase of the left foot.
    Phase,
}

impl Quantity {
    fn length(self, joints: usize) -> usize {
        match self {
            Self::BaseLinearVelocity
            | Self::BaseAngularVelocity
            | Self::ProjectedGravity
            | Self::Command => 3,
            Self::CommandWalk | Self::PhaseSin | Self::PhaseCos | Self::Phase => 2,
            Self::CommandTurn => 1,
            Self::JointPositions | Self::JointVelocities | Self::LastAction => joints,
        }
    }

    fn needs_gait(self) -> bool {
        matches!(self, Self::PhaseSin | Self::PhaseCos | Self::Phase)
    }
}

/// The clock of a gait. The phase of each foot goes around `hz` times a second.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gait {
    pub hz: f64,
    /// Phases of the left and the right foot at first (rad).
    #[serde(default = "opposite")]
    pub start_rad: [f64; 2],
    /// The phases while the command asks for standing (rad); None if they go on.
    pub standing_rad: Option<[f64; 2]>,
}

fn opposite() -> [f64; 2] {
    [0.0, PI]
}

impl Gait {
    /// The phases that the policy sees (rad).
    fn seen(&self, phase_rad: [f64; 2], command: [f64; 3]) -> [f64; 2] {
        let stands = command.iter().all(|velocity| velocity.abs() < STANDS);
        self.standing_rad.filter(|_| stands).unwrap_or(phase_rad)
    }
}

/// Checks the values, for a policy with `joints` joints. Errors name `file`.
pub fn check(file: &str, terms: &[Term], joints: usize, gait: Option<&Gait>) -> Result<()> {
    if terms.is_empty() {
        return Err(Error::value(
            file,
            "observation",
            "[]",
            "is empty",
            "the terms that the network sees",
        ));
    }
    for (i, term) in terms.iter().enumerate() {
        let field = |key: &str| format!("observation.{i}.{key}");
        if let Err(problem) = term.check_scale(joints) {
            let (value, accepted) = (
                format!("{:?}", term.scale),
                "a finite number, or one for each number of the term",
            );
            return Err(Error::value(file, field("scale"), value, problem, accepted));
        }
        if let Some(clip) = term.clip.filter(|clip| clip.is_nan() || *clip <= 0.0) {
            return Err(Error::value(
                file,
                field("clip"),
                clip,
                "out of range",
                "more than 0",
            ));
        }
        if !(1..=MOST_HISTORY).contains(&term.history) {
            let accepted = format!("1 to {MOST_HISTORY}");
            return Err(Error::value(
                file,
                field("history"),
                term.history,
                "out of range",
                accepted,
            ));
        }
        if term.term.needs_gait() && gait.is_none() {
            let accepted = "a table `[gait]` with `hz`";
            return Err(Error::value(
                file,
                field("term"),
                "a phase",
                "needs the clock of a gait",
                accepted,
            ));
        }
    }
    match gait.filter(|gait| !(gait.hz > 0.0 && gait.hz <= 100.0)) {
        Some(gait) => Err(Error::value(
            file,
            "gait.hz",
            gait.hz,
            "out of range",
            "more than 0, at most 100",
        )),
        None => Ok(()),
    }
}

/// Number of numbers in the observation of a policy with `joints` joints.
pub fn length(terms: &[Term], joints: usize) -> usize {
    terms.iter().map(|term| term.length(joints)).sum()
}

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
        }
    }

    pub fn update(&mut self, robot: &Robot, sensed: &Sensed) {
        self.posture.q.copy_from_slice(&sensed.q);
        self.posture.base = Isometry3::identity();
        self.kinematics.update(robot, &self.posture);
        // From here on, vectors are in the axes of the base.
        let trunk = self.kinematics.link_pose(robot.trunk).rotation;
        let to_world = sensed.imu.orientation * trunk.inverse();
        let between: Vector3<f64> = robot
            .chain(robot.trunk)
            .map(|joint| self.kinematics.joint_axis(joint) * sensed.dq[joint])
            .sum();
        self.gravity = to_world.inverse() * -Vector3::z();
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
    /// Phases of the feet (rad), and the phases in the observation.
    phase_rad: [f64; 2],
    seen_rad: [f64; 2],
    /// The last values of each term, the oldest first.
    past: Vec<VecDeque<Vec<f32>>>,
}

impl Memory {
    pub fn new(terms: &[Term], gait: Option<&Gait>, command: [f64; 3], joints: usize) -> Self {
        let phase_rad = gait.map_or([0.0; 2], |gait| gait.start_rad);
        Self {
            last_action: vec![0.0; joints],
            phase_rad,
            seen_rad: gait.map_or(phase_rad, |gait| gait.seen(phase_rad, command)),
            past: terms
                .iter()
                .map(|term| VecDeque::with_capacity(term.history))
                .collect(),
        }
    }

    /// The observation, as the network takes it.
    pub fn observe(&mut self, terms: &[Term], seen: &Observation) -> Vec<f32> {
        let mut observed = Vec::new();
        for (i, term) in terms.iter().enumerate() {
            let now = self.value(term, seen);
            let past = &mut self.past[i];
            if past.len() == term.history {
                past.pop_front();
            }
            past.push_back(now);
            while past.len() < term.history {
                past.push_front(past[0].clone());
            }
            observed.extend(past.iter().flatten());
        }
        observed
    }

    fn value(&self, term: &Term, seen: &Observation) -> Vec<f32> {
        let base = seen.base;
        let [walk_x, walk_y, turn] = seen.command;
        let numbers: Vec<f64> = match term.term {
            Quantity::BaseLinearVelocity => base.linear.as_slice().into(),
            Quantity::BaseAngularVelocity => base.angular.as_slice().into(),
            Quantity::ProjectedGravity => base.gravity.as_slice().into(),
            Quantity::Command => seen.command.into(),
            Quantity::CommandWalk => vec![walk_x, walk_y],
            Quantity::CommandTurn => vec![turn],
            Quantity::JointPositions => seen.joint_positions.clone(),
            Quantity::JointVelocities => seen.joint_velocities.clone(),
            Quantity::LastAction => self.last_action.iter().map(|&value| value.into()).collect(),
            Quantity::PhaseSin => self.seen_rad.map(f64::sin).into(),
            Quantity::PhaseCos => self.seen_rad.map(f64::cos).into(),
            Quantity::Phase => vec![self.seen_rad[0].sin(), self.seen_rad[0].cos()],
        };
        let clip = term.clip.unwrap_or(f64::INFINITY);
        let scaled = numbers
            .into_iter()
            .enumerate()
            .map(|(i, number)| (term.scale.at(i) * number).clamp(-clip, clip) as f32);
        scaled.collect()
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
            self.seen_rad = gait.seen(self.phase_rad, command);
        }
    }
}
