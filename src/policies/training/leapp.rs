//! The descriptions that LEAPP, the exporter of Isaac Lab and Isaac ROS, writes beside a network: raw inputs, outputs that
//! are fed back, targets of the joints and gains of their servos as outputs.

use super::known::{Figure, Training, plain};
use crate::ObservedJoints;
use crate::net::Outputs;
use crate::terms::{Quantity, Term};
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::IgnoredAny;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use std::collections::BTreeMap;

#[derive(Deserialize)]
pub struct Leapp {
    models: IndexMap<String, Model>,
    pipeline: Pipeline,
    semantic: Semantic,
}

#[derive(Deserialize)]
struct Model {
    inputs: Vec<End>,
    outputs: Vec<End>,
}

/// An input or output of the network.
#[derive(Deserialize)]
struct End {
    name: String,
    #[serde(default)]
    kind: String,
    #[serde(default)]
    element_names: Vec<Vec<String>>,
    /// It is memory.
    #[serde(default)]
    is_state: bool,
}

#[derive(Deserialize)]
struct Pipeline {
    /// From `MODEL/output` to each `MODEL/input`.
    #[serde(default, alias = "feedback_flow")]
    feedback_connections: BTreeMap<String, Vec<String>>,
    /// The memory at the start, if it is not 0.
    #[serde(default)]
    initial_values: Option<IgnoredAny>,
}

#[derive(Deserialize)]
struct Semantic {
    scene: Scene,
}

#[derive(Deserialize)]
struct Scene {
    dt: f64,
}

impl Leapp {
    pub fn training(self, file: &str, robot: &Robot) -> Result<Training> {
        let bad = |field: String, value: &str, problem: &str, accepted: &str| {
            Error::value(file, field, value, problem, accepted)
        };
        let names: Vec<&String> = self.models.keys().collect();
        let [(_, model)] = self.models.iter().collect::<Vec<_>>()[..] else {
            let names = format!("{names:?}");
            return Err(bad(
                "models".into(),
                &names,
                "are several networks",
                "one network",
            ));
        };
        if self.pipeline.initial_values.is_some() {
            let problem = "starts its memory at other values than 0, which is not taken";
            return Err(bad(
                "pipeline.initial_values".into(),
                "(some)",
                problem,
                "none",
            ));
        }
        let base = &robot.links[0].name;
        let mut terms = Vec::new();
        let mut observed: Option<&[String]> = None;
        for input in model.inputs.iter().filter(|input| !input.is_state) {
            let field = |key: &str| format!("inputs.{}.{key}", input.name);
            // World axes have the ending _w, those of the body _b.
            let is_world = input.name.ends_with("_w");
            let term = match &input.kind[..] {
                "state/body/rotation" => Quantity::Orientation,
                "state/body/angular_velocity" if !is_world => Quantity::BaseAngularVelocity,
                "state/body/linear_velocity" if !is_world => Quantity::BaseLinearVelocity,
                "velocity_command" => Quantity::Command,
                "state/joint/position" => Quantity::JointPositions,
                "state/joint/velocity" => Quantity::JointVelocities,
                kind => {
                    let accepted = "state/body/rotation, state/body/angular_velocity and linear_velocity in axes of the body, \
                                    velocity_command, state/joint/position, state/joint/velocity";
                    return Err(bad(field("kind"), kind, "is not known here", accepted));
                }
            };
            let elements = input.element_names.last().map(Vec::as_slice);
            let bodies = match &input.element_names[..] {
                [bodies, _] if input.kind.starts_with("state/body/") => Some(bodies),
                _ => None,
            };
            if let Some(bodies) = bodies.filter(|bodies| bodies[..] != *std::slice::from_ref(base))
            {
                let accepted = format!("[{base}], the first link of {}", robot.name);
                let (value, problem) = (format!("{bodies:?}"), "is another body than the base");
                return Err(bad(field("element_names"), &value, problem, &accepted));
            }
            match term {
                Quantity::Orientation
                    if elements.is_some_and(|names| names != ["w", "x", "y", "z"]) =>
                {
                    let value = format!("{elements:?}");
                    return Err(bad(
                        field("element_names"),
                        &value,
                        "is another order",
                        "[w, x, y, z]",
                    ));
                }
                Quantity::JointPositions | Quantity::JointVelocities => {
                    let joints = elements.unwrap_or_default();
                    if **observed.get_or_insert(joints) != *joints || joints.is_empty() {
                        let accepted = "the same joints at each input that observes joints";
                        let problem = "are no joints, or other ones than before";
                        let value = format!("{joints:?}");
                        return Err(bad(field("element_names"), &value, problem, accepted));
                    }
                }
                _ => {}
            }
            terms.push(Term {
                input: Some(input.name.clone()),
                ..plain(term)
            });
        }
        let output = |kind: &str| model.outputs.iter().find(|output| output.kind == kind);
        // One output has all targets, and the gains are in its order.
        for (i, other) in model.outputs.iter().enumerate() {
            let targets = output("target/joint/position").map(|targets| &targets.element_names);
            let again = model.outputs[..i]
                .iter()
                .any(|former| former.kind == other.kind);
            let is_gain = ["kp", "kd"].contains(&&other.kind[..]);
            if !other.is_state && (again || (is_gain && Some(&other.element_names) != targets)) {
                let accepted = "one output of each kind, all of the same joints in one order";
                let field = format!("outputs.{}", other.name);
                return Err(bad(
                    field,
                    &other.kind,
                    "does not fit the other outputs",
                    accepted,
                ));
            }
        }
        let Some(action) = output("target/joint/position") else {
            let accepted = "an output of the kind target/joint/position";
            return Err(bad(
                "outputs".into(),
                "(none)",
                "has no targets of joints",
                accepted,
            ));
        };
        let joints = action.element_names.last().cloned().unwrap_or_default();
        let mut memory = BTreeMap::new();
        let last = |path: &str| path.rsplit('/').next().unwrap_or_default().to_string();
        for (from, to) in &self.pipeline.feedback_connections {
            for to in to {
                memory.insert(last(to), last(from));
            }
        }
        if let Some(lost) = model
            .inputs
            .iter()
            .find(|input| input.is_state && !memory.contains_key(&input.name))
        {
            let problem = "is memory, to which no output is fed back";
            let accepted = "pipeline.feedback_connections with each input that is_state";
            return Err(bad(
                format!("inputs.{}", lost.name),
                "is_state",
                problem,
                accepted,
            ));
        }
        let [stiffness, damping] =
            [output("kp"), output("kd")].map(|output| output.map(|output| output.name.clone()));
        if stiffness.is_none() || damping.is_none() {
            let accepted = "outputs of the kinds kp and kd";
            return Err(bad(
                "outputs".into(),
                "(none)",
                "has no gains of servos",
                accepted,
            ));
        }
        let outputs = Outputs {
            action: Some(action.name.clone()),
            stiffness,
            damping,
            memory,
        };
        let count = joints.len();
        let absolute = "its outputs are the targets themselves";
        Ok(Training {
            by: format!("LEAPP, {file}"),
            period_s: Figure::read(self.semantic.scene.dt),
            joints: Figure::read(joints),
            default_rad: Figure::inferred(vec![0.0; count], absolute),
            action_scale: Figure::inferred(vec![1.0; count], absolute),
            observed: observed.map(|joints| {
                let zeros = ObservedJoints {
                    joints: joints.to_vec(),
                    default_rad: vec![0.0; joints.len()],
                };
                Figure::read(zeros)
            }),
            network: Some(Figure::read(outputs)),
            observation: Figure::read(terms),
            ..Training::default()
        })
    }
}
