//! Learned policies: a network that turns an observation into targets of the joints, `q_ref = default + scale *
//! action`. The guide's chapter `onnx.md` has the keys of its file.
//!
//! The network runs at its own rate, and its last targets hold in between. The servos get the stiffness and the damping
//! with which the network was trained. Motors are those of the robot: where the training had other ones, that is told.

#![forbid(unsafe_code)]

mod limited;
mod motors;
mod net;
mod observation;
mod proto;
mod torchscript;
mod training;

pub use training::{motors as motors_of_training, written};

use net::Net;
use observation::{Base, Gait, Memory, Observation, Term};
use serde::{Deserialize, Serialize};
use standfast_controllers::companion_files;
use standfast_controllers::kinds::{ControllerKind, kind};
use standfast_controllers::spec::{ControllerSpec, about, check_name};
use standfast_controllers::tunable::Tunable;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::{Command, Controller, PreparedController, Report, Sensed, TickError};
use standfast_files::assets::{Source, parse_toml};
use std::sync::Arc;
use toml::Table;

/// The kind of controllers that this crate adds ([`standfast_controllers::kinds::add`]).
pub const KIND: ControllerKind = ControllerKind {
    parse: Policy::read,
    ..kind::<Policy>("onnx")
};

/// Smallest and largest number of a servo, as in a robot's settings.
const LEAST: f64 = 1e-12;
const MOST: f64 = 1e12;

/// The content of the controller's file. Lists of joints are in the order of `joints`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    kind: String,
    name: String,
    #[serde(default)]
    description: String,
    /// The network, a file of ONNX or TorchScript in the folder of this file.
    model: String,
    /// Time between two actions (s).
    period_s: f64,
    /// Names of the joints that the policy drives. The others keep the posture of the start.
    joints: Vec<String>,
    /// Angles of the joints at the action 0 (rad), and the change of the angles by an action of 1 (rad).
    default_rad: Vec<f64>,
    action_scale: Vec<f64>,
    /// Largest magnitude of an action.
    action_clip: Option<f64>,
    /// Stiffness (N m/rad) and damping (N m s/rad) of the joints' servos.
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    /// The velocity that the policy is asked for: forward, to the left (m/s), and turning (rad/s).
    #[serde(default)]
    command: [f64; 3],
    #[serde(default)]
    training: Motors,
    gait: Option<Gait>,
    /// The terms of the observation, in the order in which the network takes them.
    observation: Vec<Term>,
    /// Path of the file itself. No file states this key.
    #[serde(default)]
    file: String,
}

/// The motors of the training: torque limits (N m) and rotor inertias (kg m^2). They are told where the robot has other
/// ones, and `--motors` gives them to the robot; they are not simulated with the policy alone.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Motors {
    torque_n_m: Option<Vec<f64>>,
    rotor_inertia_kg_m2: Option<Vec<f64>>,
}

/// Keys of former versions, whose figures were simulated with the policy alone.
const OF_ITS_OWN: [&str; 2] = ["torque_n_m", "rotor_inertia_kg_m2"];

impl Policy {
    /// Reads a file, and keeps its path.
    pub fn read(source: &Source) -> Result<Box<dyn ControllerSpec>> {
        companion_files::refuse_file(source, "`model`")?;
        let table: Table = parse_toml(source)?;
        if let Some(key) = OF_ITS_OWN.into_iter().find(|key| table.contains_key(*key)) {
            let problem = "motors belong to the robot, and are the same for every controller";
            let accepted = format!(
                "the same list in a table [training], which says what the policy was trained with; `--motors {}` then gives \
                 these motors to the robot",
                source.file
            );
            return Err(Error::value(
                &source.file,
                key,
                "(a list)",
                problem,
                accepted,
            ));
        }
        Ok(Box::new(Self {
            file: source.file.clone(),
            ..parse_toml(source)?
        }))
    }

    fn bad(
        &self,
        field: &str,
        value: impl ToString,
        problem: &str,
        accepted: impl Into<String>,
    ) -> Error {
        Error::value(&self.file, field, value, problem, accepted)
    }

    /// The index in the robot of each joint of the policy.
    fn joints_of(&self, robot: &Robot) -> Result<Vec<usize>> {
        let names: Vec<&str> = robot
            .joints
            .iter()
            .map(|joint| joint.name.as_str())
            .collect();
        let joints = self.joints.iter().map(|name| {
            let index = names.iter().position(|known| known == name);
            index.ok_or_else(|| {
                self.bad(
                    "joints",
                    name,
                    &format!("{} has no such joint", robot.name),
                    names.join(", "),
                )
            })
        });
        joints.collect()
    }

    /// The number of control periods (s) from one action to the next, which must be whole.
    fn ticks_per_action(&self, period_s: f64) -> Result<u64> {
        let ticks = (self.period_s / period_s).round();
        if ticks >= 1.0 && (ticks * period_s - self.period_s).abs() < 1e-6 * self.period_s {
            return Ok(ticks as u64);
        }
        let accepted = format!("a multiple of the control period, {period_s} s");
        Err(self.bad(
            "period_s",
            self.period_s,
            "does not fit the campaign",
            accepted,
        ))
    }
}

impl ControllerSpec for Policy {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        let fail = |field: &str, value: String, problem: &str, accepted: &str| {
            Err(Error::value(file, field, value, problem, accepted))
        };
        check_name(file, &self.name)?;
        if !(self.period_s > 0.0 && self.period_s <= 1.0) {
            return fail(
                "period_s",
                self.period_s.to_string(),
                "out of range",
                "more than 0, at most 1",
            );
        }
        if let Some(name) = self
            .joints
            .iter()
            .enumerate()
            .find(|(i, name)| self.joints[..*i].contains(name))
        {
            return fail(
                "joints",
                name.1.clone(),
                "is there twice",
                "each joint once",
            );
        }
        let any = f64::NEG_INFINITY..=f64::INFINITY;
        let lists = [
            (
                "default_rad",
                Some(&self.default_rad),
                any.clone(),
                "a finite number",
            ),
            (
                "action_scale",
                Some(&self.action_scale),
                any,
                "a finite number",
            ),
            ("stiffness", Some(&self.stiffness), 0.0..=MOST, "0 to 1e12"),
            ("damping", Some(&self.damping), 0.0..=MOST, "0 to 1e12"),
            (
                "training.torque_n_m",
                self.training.torque_n_m.as_ref(),
                LEAST..=MOST,
                "1e-12 to 1e12",
            ),
            (
                "training.rotor_inertia_kg_m2",
                self.training.rotor_inertia_kg_m2.as_ref(),
                LEAST..=MOST,
                "1e-12 to 1e12",
            ),
        ];
        for (field, list, range, accepted) in lists {
            let Some(list) = list else { continue };
            if list.len() != self.joints.len() {
                let accepted = format!("one for each of its {} joints", self.joints.len());
                return fail(
                    field,
                    format!("{} numbers", list.len()),
                    "has another length than joints",
                    &accepted,
                );
            }
            if let Some(value) = list
                .iter()
                .find(|value| !value.is_finite() || !range.contains(value))
            {
                return fail(field, value.to_string(), "out of range", accepted);
            }
        }
        if let Some(clip) = self
            .action_clip
            .filter(|clip| clip.is_nan() || *clip <= 0.0)
        {
            return fail(
                "action_clip",
                clip.to_string(),
                "out of range",
                "more than 0",
            );
        }
        if self.command.iter().any(|velocity| !velocity.is_finite()) {
            return fail(
                "command",
                format!("{:?}", self.command),
                "is not finite",
                "three finite numbers",
            );
        }
        observation::check(
            file,
            &self.observation,
            self.joints.len(),
            self.gait.as_ref(),
        )
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    /// Factors on the numbers of the servos. The numbers of the network are not tuned.
    fn tunables(&self) -> Vec<Tunable> {
        ["action_scale", "stiffness", "damping"]
            .map(|key| Tunable::new(key, 1.0, [0.5, 2.0]))
            .into()
    }

    fn trained_otherwise(&self, robot: &Robot) -> Option<String> {
        let joints = self.joints_of(robot).ok()?;
        motors::otherwise(&self.training, robot, &joints)
    }

    fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        Ok(vec![companion_files::read(
            &self.file,
            "model",
            &self.model,
        )?])
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        let (joints, ticks_per_action) = (self.joints_of(robot)?, self.ticks_per_action(period_s)?);
        let (_, bytes) = companion_files::read(&self.file, "model", &self.model)?;
        let sizes = [
            observation::length(&self.observation, joints.len()),
            joints.len(),
        ];
        let net = Net::of(&bytes, sizes).map_err(|problem| {
            let accepted = "an ONNX file with one input and one output of these sizes, and no memory of its own";
            self.bad("model", &self.model, &problem, accepted)
        })?;
        let mut home = robot.home_command();
        let mut gains: Vec<[f64; 2]> = robot
            .servos
            .iter()
            .map(|servo| [servo.kp, servo.kd])
            .collect();
        for (i, &joint) in joints.iter().enumerate() {
            gains[joint] = [self.stiffness[i], self.damping[i]];
            (home.q_ref[joint], home.tau_ff[joint]) = (self.default_rad[i], 0.0);
        }
        home.gains = Some(gains);
        let shared = Arc::new(SharedPolicy {
            settings: self.clone(),
            robot: robot.clone(),
            joints,
            ticks_per_action,
            net,
            home,
        });
        let about = format!(
            "{}, with stiffness and damping of its training",
            about(&self.description, &self.model)
        );
        let mut prepared =
            PreparedController::new(&self.name, about, move |_seed| Actor::new(&shared));
        prepared.stride_s = self.gait.as_ref().map(|gait| 1.0 / gait.hz);
        Ok(prepared)
    }
}

/// The data that all episodes share.
struct SharedPolicy {
    settings: Policy,
    robot: Robot,
    /// The index in the robot of each joint of the policy.
    joints: Vec<usize>,
    ticks_per_action: u64,
    net: Net,
    /// The command at the action 0.
    home: Command,
}

/// A policy in an episode.
#[derive(Clone)]
struct Actor {
    shared: Arc<SharedPolicy>,
    base: Base,
    memory: Memory,
    ticks: u64,
    acting: Command,
    /// The last observation.
    observed: Vec<f32>,
}

impl Actor {
    fn new(shared: &Arc<SharedPolicy>) -> Self {
        let settings = &shared.settings;
        Self {
            shared: Arc::clone(shared),
            base: Base::new(&shared.robot),
            memory: Memory::new(
                &settings.observation,
                settings.gait.as_ref(),
                settings.command,
                shared.joints.len(),
            ),
            ticks: 0,
            acting: shared.home.clone(),
            observed: vec![0.0; observation::length(&settings.observation, shared.joints.len())],
        }
    }

    /// Makes an observation, runs the network, and sets the targets.
    fn act(&mut self, sensed: &Sensed) -> Result<(), TickError> {
        let SharedPolicy {
            settings,
            robot,
            joints,
            net,
            ..
        } = &*self.shared;
        self.base.update(robot, sensed);
        let of_joints = |all: &[f64]| joints.iter().map(|&joint| all[joint]).collect::<Vec<_>>();
        let (q, joint_velocities) = (of_joints(&sensed.q), of_joints(&sensed.dq));
        let joint_positions = q
            .iter()
            .zip(&settings.default_rad)
            .map(|(q, default)| q - default)
            .collect();
        let seen = Observation {
            base: &self.base,
            command: settings.command,
            joint_positions,
            joint_velocities,
        };
        self.observed = self.memory.observe(&settings.observation, &seen);
        let mut action = net.run(self.observed.clone()).map_err(TickError::Failed)?;
        if let Some(i) = action.iter().position(|value| !value.is_finite()) {
            let problem = format!(
                "{}: action {i} of {} is not finite",
                settings.name, settings.model
            );
            return Err(TickError::Failed(problem));
        }
        if let Some(clip) = settings.action_clip {
            for value in &mut action {
                *value = value.clamp(-clip as f32, clip as f32);
            }
        }
        for (i, &joint) in joints.iter().enumerate() {
            self.acting.q_ref[joint] =
                settings.default_rad[i] + settings.action_scale[i] * f64::from(action[i]);
        }
        self.memory.remember(
            action,
            settings.gait.as_ref(),
            settings.command,
            settings.period_s,
        );
        Ok(())
    }
}

impl Controller for Actor {
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        sensed.check(self.shared.robot.joints.len())?;
        if self.ticks.is_multiple_of(self.shared.ticks_per_action) {
            self.act(sensed)?;
        }
        self.ticks += 1;
        command.clone_from(&self.acting);
        Ok(())
    }

    fn report(&self) -> Report<'_> {
        Report::of_phase("policy")
    }

    fn fork(&self) -> Option<Box<dyn Controller>> {
        Some(Box::new(self.clone()))
    }

    fn answer(&self, observed: &[f64]) -> Option<Result<Vec<f64>, String>> {
        let action = self
            .shared
            .net
            .run(observed.iter().map(|&number| number as f32).collect());
        Some(action.map(|action| action.into_iter().map(f64::from).collect()))
    }

    fn observed(&self) -> Vec<(String, Vec<f64>)> {
        let mut numbers = self.observed.iter().map(|&number| f64::from(number));
        let SharedPolicy {
            settings, joints, ..
        } = &*self.shared;
        let terms = settings.observation.iter().map(|term| {
            let length = term.length(joints.len());
            (term.name(), numbers.by_ref().take(length).collect())
        });
        terms.collect()
    }
}
