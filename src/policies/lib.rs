//! Learned policies: a network that turns an observation into targets of the joints, `q_ref = default + scale *
//! action`. The guide's chapter `onnx.md` has the keys of its file.
//!
//! The network runs at its own rate, and its last targets hold in between. The servos get the stiffness and the damping
//! with which the network was trained. Motors are those of the robot: where the training had other ones, that is told.

#![forbid(unsafe_code)]

mod actor;
mod limited;
mod motors;
mod net;
mod observation;
mod proto;
mod terms;
mod torchscript;
mod training;

pub use training::{motors as motors_of_training, written};

use actor::{Actor, SharedPolicy};
use net::{Ends, Net, Outputs, Parts};
use serde::{Deserialize, Serialize};
use standfast_controllers::companion_files;
use standfast_controllers::kinds::{ControllerKind, kind};
use standfast_controllers::spec::{ControllerSpec, about, check_name};
use standfast_controllers::tunable::Tunable;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_files::assets::{Source, parse_toml};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use terms::{Gait, Sizes, Stack, Term};
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
    /// Largest magnitude of an action, or the least and the largest action of each joint.
    action_clip: Option<ActionClip>,
    /// Stiffness (N m/rad) and damping (N m s/rad) of the joints' servos. They are left out if the network gives them.
    stiffness: Option<Vec<f64>>,
    damping: Option<Vec<f64>>,
    /// The velocity that the policy is asked for: forward, to the left (m/s), and turning (rad/s).
    #[serde(default)]
    command: [f64; 3],
    #[serde(default)]
    training: Motors,
    gait: Option<Gait>,
    /// The joints that the policy observes; None if they are those that it drives.
    observed: Option<ObservedJoints>,
    /// The outputs and the memory of the network.
    #[serde(default, skip_serializing_if = "terms::is_default")]
    network: Outputs,
    /// The terms of the observation, in the order in which the network takes them, and how many frames of all of them it
    /// takes.
    observation: Vec<Term>,
    #[serde(default, skip_serializing_if = "terms::is_default")]
    frames: Stack,
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

/// Joints that a policy observes, and the angles (rad) from which it sees theirs.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ObservedJoints {
    joints: Vec<String>,
    default_rad: Vec<f64>,
}

/// Limits of the actions.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "accepted: a number, or a table with the lists `lower` and `upper`"
)]
enum ActionClip {
    Magnitude(f64),
    Each { lower: Vec<f64>, upper: Vec<f64> },
}

impl ActionClip {
    /// The least and the largest action of joint `i`.
    fn of(&self, i: usize) -> [f64; 2] {
        match self {
            Self::Magnitude(clip) => [-clip, *clip],
            Self::Each { lower, upper } => [lower[i], upper[i]],
        }
    }
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

    /// The index in the robot of each of these joints, which the key `field` names.
    fn indices(&self, field: &str, joints: &[String], robot: &Robot) -> Result<Vec<usize>> {
        let names: Vec<&str> = robot
            .joints
            .iter()
            .map(|joint| joint.name.as_str())
            .collect();
        let joints = joints.iter().map(|name| {
            let index = names.iter().position(|known| known == name);
            index.ok_or_else(|| {
                self.bad(
                    field,
                    name,
                    &format!("{} has no such joint", robot.name),
                    names.join(", "),
                )
            })
        });
        joints.collect()
    }

    /// The index in the robot of each joint of the policy.
    fn joints_of(&self, robot: &Robot) -> Result<Vec<usize>> {
        self.indices("joints", &self.joints, robot)
    }

    /// The joints that the policy observes, and the angles (rad) from which it sees theirs.
    fn observed_joints(&self) -> (&[String], &[f64]) {
        match &self.observed {
            Some(observed) => (&observed.joints, &observed.default_rad),
            None => (&self.joints, &self.default_rad),
        }
    }

    fn sizes(&self) -> Sizes {
        Sizes {
            driven: self.joints.len(),
            observed: self.observed_joints().0.len(),
        }
    }

    /// The observed inputs of the network, each with its number of numbers.
    fn inputs(&self) -> Vec<(Option<String>, usize)> {
        terms::inputs(&self.observation, self.frames, self.sizes())
    }

    /// The network's file, and the files with its weights, which lie in its folder: names within the folder of this file.
    fn parts(&self) -> Result<(Parts, Vec<String>)> {
        let (_, model) = companion_files::read(&self.file, "model", &self.model)?;
        let named = net::weight_files(&model).map_err(|problem| {
            self.bad(
                "model",
                &self.model,
                &problem,
                "an ONNX or TorchScript file",
            )
        })?;
        let (mut weights, mut names) = (Vec::new(), Vec::new());
        for file in named {
            let folder = Path::new(&self.model).parent().unwrap_or(Path::new(""));
            let path = folder.join(&file);
            // A file has one name, without `./`.
            let parts = path.components().filter(|part| *part != Component::CurDir);
            let name = parts.collect::<PathBuf>().to_string_lossy().into_owned();
            if !companion_files::is_inside(&file) {
                let problem = format!("keeps its weights in {file:?}");
                let accepted = "a file in the folder of the network";
                return Err(self.bad("model", &self.model, &problem, accepted));
            }
            let (_, bytes) =
                companion_files::read(&self.file, "model", &name).map_err(|error| {
                    let problem = format!("keeps its weights in another file: {error}");
                    self.bad(
                        "model",
                        &self.model,
                        &problem,
                        "that file beside the network",
                    )
                })?;
            weights.push((file, bytes));
            names.push(name);
        }
        Ok((Parts { model, weights }, names))
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
        let observed = self.observed.as_ref();
        let seen = observed.map_or(&self.joints[..], |observed| &observed.joints);
        for (field, names) in [("joints", &self.joints[..]), ("observed.joints", seen)] {
            if names.is_empty() {
                return fail(field, "[]".into(), "is empty", "at least one joint");
            }
            let twice = |(i, name): &(usize, &String)| names[..*i].contains(name);
            if let Some((_, name)) = names.iter().enumerate().find(twice) {
                return fail(field, name.clone(), "is there twice", "each joint once");
            }
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
                "observed.default_rad",
                observed.map(|observed| &observed.default_rad),
                any.clone(),
                "a finite number",
            ),
            (
                "action_scale",
                Some(&self.action_scale),
                any,
                "a finite number",
            ),
            (
                "stiffness",
                self.stiffness.as_ref(),
                0.0..=MOST,
                "0 to 1e12",
            ),
            ("damping", self.damping.as_ref(), 0.0..=MOST, "0 to 1e12"),
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
        for (key, list, output) in [
            ("stiffness", &self.stiffness, &self.network.stiffness),
            ("damping", &self.damping, &self.network.damping),
        ] {
            if list.is_some() == output.is_some() {
                let accepted = format!(
                    "a list with a number for each joint, or the output that gives it (`network.{key}`)"
                );
                let value = list.as_ref().map_or("(none)", |_| "(a list)");
                return fail(
                    key,
                    value.into(),
                    "is stated twice or not at all",
                    &accepted,
                );
            }
        }
        for (field, list, range, accepted) in lists {
            let Some(list) = list else { continue };
            let count = match field {
                "observed.default_rad" => seen.len(),
                _ => self.joints.len(),
            };
            if list.len() != count {
                let accepted = format!("one for each of its {count} joints");
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
        match &self.action_clip {
            Some(ActionClip::Each { lower, upper })
                if lower.len() != self.joints.len()
                    || upper.len() != self.joints.len()
                    || lower.iter().zip(upper).any(|(lower, upper)| {
                        lower.partial_cmp(upper) != Some(std::cmp::Ordering::Less)
                    }) =>
            {
                let accepted = format!(
                    "two lists of {} numbers, the lower less than the upper",
                    self.joints.len()
                );
                return fail(
                    "action_clip",
                    format!("{lower:?}, {upper:?}"),
                    "does not fit",
                    &accepted,
                );
            }
            Some(ActionClip::Magnitude(clip)) if clip.is_nan() || *clip <= 0.0 => {
                return fail(
                    "action_clip",
                    clip.to_string(),
                    "out of range",
                    "more than 0",
                );
            }
            _ => {}
        }
        if self.command.iter().any(|velocity| !velocity.is_finite()) {
            return fail(
                "command",
                format!("{:?}", self.command),
                "is not finite",
                "three finite numbers",
            );
        }
        let gait = self.gait.as_ref();
        terms::check(file, &self.observation, self.frames, self.sizes(), gait)
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    /// Factors on the numbers of the servos. The numbers of the network are not tuned.
    fn tunables(&self) -> Vec<Tunable> {
        let keys: &[&str] = match self.stiffness {
            Some(_) => &["action_scale", "stiffness", "damping"],
            None => &["action_scale"],
        };
        keys.iter()
            .map(|key| Tunable::new(*key, 1.0, [0.5, 2.0]))
            .collect()
    }

    fn trained_otherwise(&self, robot: &Robot) -> Option<String> {
        let joints = self.joints_of(robot).ok()?;
        motors::otherwise(&self.training, robot, &joints)
    }

    fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        let (Parts { model, weights }, names) = self.parts()?;
        let weights = weights.into_iter().map(|(_, bytes)| bytes);
        let weights = names.into_iter().zip(weights);
        Ok([(self.model.clone(), model)]
            .into_iter()
            .chain(weights)
            .collect())
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        let (joints, ticks_per_action) = (self.joints_of(robot)?, self.ticks_per_action(period_s)?);
        let (observed, observed_from_rad) = self.observed_joints();
        let observed = self.indices("observed.joints", observed, robot)?;
        let observed_from_rad = observed_from_rad.to_vec();
        let ends = Ends {
            observed: self.inputs(),
            outputs: self.network.clone(),
            actions: joints.len(),
        };
        let net = Net::of(self.parts()?.0, ends).map_err(|problem| {
            let accepted =
                "an ONNX or TorchScript file whose inputs are observed or fed back, with an output for the action";
            self.bad("model", &self.model, &problem, accepted)
        })?;
        let mut home = robot.home_command();
        let mut gains: Vec<[f64; 2]> = robot
            .servos
            .iter()
            .map(|servo| [servo.kp, servo.kd])
            .collect();
        for (i, &joint) in joints.iter().enumerate() {
            if let (Some(stiffness), Some(damping)) = (&self.stiffness, &self.damping) {
                gains[joint] = [stiffness[i], damping[i]];
            }
            (home.q_ref[joint], home.tau_ff[joint]) = (self.default_rad[i], 0.0);
        }
        home.gains = Some(gains);
        let shared = Arc::new(SharedPolicy {
            settings: self.clone(),
            robot: robot.clone(),
            joints,
            observed,
            observed_from_rad,
            ticks_per_action,
            net,
            home,
        });
        let about = format!(
            "{}, with {}",
            about(&self.description, &self.model),
            match self.stiffness {
                Some(_) => "stiffness and damping of its training",
                None => "stiffness and damping that its network gives",
            }
        );
        let mut prepared =
            PreparedController::new(&self.name, about, move |_seed| Actor::new(&shared));
        prepared.stride_s = self.gait.as_ref().map(|gait| 1.0 / gait.hz);
        Ok(prepared)
    }
}
