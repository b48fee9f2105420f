//! The descriptors of inputs and outputs that Isaac Lab writes of a task (`IO_descriptors.yaml`).

use super::known::{Figure, Training, quantity, scale_of};
use super::lists::OneOrMany;
use crate::terms::{Quantity, Scale, Sizes, Stack, Term};
use crate::{ActionClip, ObservedJoints};
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::IgnoredAny;
use standfast_core::error::{Error, Result};

/// The content of the file.
#[derive(Deserialize)]
pub struct Descriptors {
    actions: Vec<Action>,
    articulations: IndexMap<String, Articulation>,
    observations: IndexMap<String, Vec<Observed>>,
    scene: Scene,
}

#[derive(Deserialize)]
struct Action {
    full_path: String,
    #[serde(default)]
    joint_names: Vec<String>,
    scale: Option<OneOrMany>,
    offset: Option<OneOrMany>,
    /// Limits of the targets.
    clip: Option<Vec<[f64; 2]>>,
}

/// The joints of a robot, in an order of their own.
#[derive(Deserialize)]
struct Articulation {
    joint_names: Vec<String>,
    default_joint_pos: Vec<f64>,
    default_joint_stiffness: Vec<f64>,
    default_joint_damping: Vec<f64>,
    default_joint_armature: Option<Vec<f64>>,
}

#[derive(Deserialize)]
struct Observed {
    name: String,
    observation_type: Option<String>,
    shape: Vec<usize>,
    joint_names: Option<Vec<String>>,
    joint_pos_offsets: Option<Vec<f64>>,
    joint_vel_offsets: Option<Vec<f64>>,
    overloads: Overloads,
    #[serde(default)]
    extras: Extras,
}

#[derive(Deserialize)]
struct Overloads {
    clip: Option<[f64; 2]>,
    scale: Option<OneOrMany>,
    #[serde(default)]
    history_length: usize,
    flatten_history_dim: Option<bool>,
}

#[derive(Default, Deserialize)]
struct Extras {
    modifiers: Option<IgnoredAny>,
}

#[derive(Deserialize)]
struct Scene {
    dt: f64,
}

impl Descriptors {
    pub fn training(self, file: &str) -> Result<Training> {
        let bad = |field: &str, value: String, problem: &str, accepted: &str| {
            Error::value(file, field, value, problem, accepted)
        };
        let names = |map: &[&str]| map.join(", ");
        let group: Vec<&str> = self.observations.keys().map(String::as_str).collect();
        let Some(observed) = self.observations.get("policy") else {
            let problem = "has no group of the policy";
            return Err(bad("observations", names(&group), problem, "policy"));
        };
        let articulations: Vec<&str> = self.articulations.keys().map(String::as_str).collect();
        let Some(articulation) = self.articulations.get("robot") else {
            let problem = "has no robot";
            return Err(bad(
                "articulations",
                names(&articulations),
                problem,
                "robot",
            ));
        };
        let driven = Driven::of(file, self.actions)?;
        let of_driven = |field: &str, list: &[f64]| {
            let field = format!("articulations.robot.{field}");
            of_joints(file, &field, articulation, list, &driven.joints)
        };
        let [stiffness, damping] = [
            of_driven(
                "default_joint_stiffness",
                &articulation.default_joint_stiffness,
            )?,
            of_driven("default_joint_damping", &articulation.default_joint_damping)?,
        ];
        let armature = match &articulation.default_joint_armature {
            Some(list) => Some(Figure::read(of_driven("default_joint_armature", list)?)),
            None => None,
        };
        let mut terms = Vec::new();
        // The joints of the terms of joints, and the angles from which they are seen.
        let (mut seen, mut from): (Option<Vec<String>>, Option<Vec<f64>>) = (None, None);
        for observed in observed {
            let field = format!("observations.policy.{}", observed.name);
            let (term, offsets) = observed.term(file, &field)?;
            if matches!(
                term.term,
                Quantity::JointPositions | Quantity::JointVelocities
            ) {
                let joints = observed.joint_names.as_ref();
                let joints = joints.unwrap_or(&articulation.joint_names);
                if let Some(other) = seen.as_ref().filter(|other| *other != joints) {
                    let accepted = format!("those of the terms before: {}", other.join(", "));
                    let problem = "are other joints than another term has";
                    return Err(bad(&field, joints.join(", "), problem, &accepted));
                }
                seen = Some(joints.clone());
                if term.term == Quantity::JointPositions {
                    let offsets = match offsets {
                        _ if observed.name == "joint_pos" => vec![0.0; joints.len()],
                        Some(offsets) => offsets,
                        None => {
                            let list = &articulation.default_joint_pos;
                            of_joints(file, &field, articulation, list, joints)?
                        }
                    };
                    if offsets.len() != joints.len() {
                        let value = format!("{} offsets", offsets.len());
                        let accepted = format!("{}, one for each of its joints", joints.len());
                        return Err(bad(&field, value, "has another length", &accepted));
                    }
                    from = Some(offsets);
                }
            }
            let sizes = Sizes {
                driven: driven.joints.len(),
                observed: seen.as_ref().map_or(0, Vec::len),
            };
            let numbers = Term {
                history: Stack::default(),
                ..term.clone()
            }
            .length(sizes);
            if observed.shape != [numbers] {
                let accepted = format!("[{numbers}]");
                let value = format!("{:?}", observed.shape);
                return Err(bad(
                    &format!("{field}.shape"),
                    value,
                    "is not that of this term",
                    &accepted,
                ));
            }
            terms.push(term);
        }
        let seen = seen.unwrap_or_else(|| driven.joints.clone());
        let from_rad = from.unwrap_or_else(|| vec![0.0; seen.len()]);
        let same = seen == driven.joints && from_rad == driven.default_rad;
        Ok(Training {
            by: format!("Isaac Lab, {file}"),
            period_s: Figure::read(self.scene.dt),
            joints: Figure::read(driven.joints),
            default_rad: Figure::read(driven.default_rad),
            action_scale: Figure::read(driven.scale),
            action_clip: driven.clip,
            stiffness: Figure::read(stiffness),
            damping: Figure::read(damping),
            rotor_inertia_kg_m2: armature,
            observed: (!same).then(|| {
                Figure::read(ObservedJoints {
                    joints: seen,
                    default_rad: from_rad,
                })
            }),
            observation: Figure::read(terms),
            ..Training::default()
        })
    }
}

/// Numbers with the digits of float32, which they have in Isaac Lab.
fn short(numbers: Vec<f64>) -> Vec<f64> {
    let short = |number: f64| (number as f32).to_string().parse().unwrap_or(number);
    numbers.into_iter().map(short).collect()
}

/// The figures of a list of the robot for these joints.
fn of_joints(
    file: &str,
    field: &str,
    robot: &Articulation,
    list: &[f64],
    joints: &[String],
) -> Result<Vec<f64>> {
    let picked = joints.iter().map(|name| {
        let place = robot.joint_names.iter().position(|known| known == name);
        place
            .and_then(|place| list.get(place))
            .copied()
            .ok_or_else(|| {
                let accepted = "one for each joint of articulations.robot.joint_names";
                Error::value(file, field, name, "has no number", accepted)
            })
    });
    picked.collect::<Result<Vec<f64>>>().map(short)
}

/// What the actions drive.
#[derive(Default)]
struct Driven {
    joints: Vec<String>,
    default_rad: Vec<f64>,
    scale: Vec<f64>,
    clip: Option<Figure<ActionClip>>,
}

impl Driven {
    fn of(file: &str, actions: Vec<Action>) -> Result<Self> {
        /// Limits of targets (rad) that no joint comes to.
        const WIDE_RAD: f64 = std::f64::consts::TAU;
        /// The limit of an action that has none.
        const NONE: f64 = 1e6;
        let mut driven = Self::default();
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for action in actions {
            let kind = action.full_path.rsplit('.').next().unwrap_or_default();
            if kind != "JointPositionAction" {
                let accepted = "JointPositionAction";
                let problem = "is not known here";
                return Err(Error::value(file, "actions", kind, problem, accepted));
            }
            let count = action.joint_names.len();
            let scale = action.scale.unwrap_or(OneOrMany::One(1.0));
            let offset = action.offset.unwrap_or(OneOrMany::One(0.0));
            let [scale, offset] = [scale, offset].map(|list| short(list.each(count)));
            let clip = action.clip.unwrap_or(vec![[-WIDE_RAD, WIDE_RAD]; count]);
            for (field, length) in [
                ("scale", scale.len()),
                ("offset", offset.len()),
                ("clip", clip.len()),
            ] {
                if length != count {
                    let field = format!("actions.{field}");
                    let accepted = format!("{count}, one for each of its joint_names");
                    let problem = "has another length";
                    return Err(Error::value(file, field, length, problem, accepted));
                }
            }
            for (i, [low, high]) in clip.into_iter().enumerate() {
                let wide = low <= -WIDE_RAD && high >= WIDE_RAD;
                let ends = [low, high].map(|end| (end - offset[i]) / scale[i]);
                lower.push(if wide { -NONE } else { ends[0].min(ends[1]) });
                upper.push(if wide { NONE } else { ends[0].max(ends[1]) });
            }
            driven.joints.extend(action.joint_names);
            driven.default_rad.extend(offset);
            driven.scale.extend(scale);
        }
        if lower.iter().any(|lower| *lower != -NONE) {
            let why = "its clip limits the targets, and so do these limits of the action; but the last action is seen \
                       within them, too, which is not so in Isaac Lab";
            driven.clip = Some(Figure::assumed(ActionClip::Each { lower, upper }, why));
        }
        Ok(driven)
    }
}

impl Observed {
    /// The term, and the angles from which it sees joints (rad), if it states them.
    fn term(&self, file: &str, field: &str) -> Result<(Term, Option<Vec<f64>>)> {
        let bad = |key: &str, value: String, problem: &str, accepted: &str| {
            let field = format!("{field}.{key}");
            Err(Error::value(file, field, value, problem, accepted))
        };
        if self.extras.modifiers.is_some() {
            return bad("extras.modifiers", "(some)".into(), "are not taken", "null");
        }
        if let Some(offset) = self
            .joint_vel_offsets
            .iter()
            .flatten()
            .find(|offset| **offset != 0.0)
        {
            return bad("joint_vel_offsets", offset.to_string(), "is not taken", "0");
        }
        let of_command = self.observation_type.as_deref() == Some("Command") && self.shape == [3];
        let term = match of_command {
            true => Quantity::Command,
            false => quantity(file, field, &self.name)?,
        };
        let Overloads {
            clip,
            scale,
            history_length,
            flatten_history_dim,
        } = &self.overloads;
        if *history_length > 1 && *flatten_history_dim == Some(false) {
            let key = "overloads.flatten_history_dim";
            return bad(key, "false".into(), "is not taken with a history", "true");
        }
        let scale = scale
            .clone()
            .map_or_else(Scale::default, |scale| scale_of(short(scale.each(1))));
        // Isaac Lab clips before it scales.
        let clip = match (clip, &scale) {
            (None, _) => None,
            (Some([low, high]), Scale::All(factor)) if *low == -*high => Some(high * factor.abs()),
            (Some(clip), _) => {
                let accepted = "null, or the same limit on both sides with one scale";
                return bad(
                    "overloads.clip",
                    format!("{clip:?}"),
                    "is not taken",
                    accepted,
                );
            }
        };
        let offsets = self.joint_pos_offsets.clone().map(short);
        let term = Term {
            scale,
            clip,
            history: Stack::of((*history_length).max(1)),
            ..Term::of(term)
        };
        Ok((term, offsets))
    }
}
