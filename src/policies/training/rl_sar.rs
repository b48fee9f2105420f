//! The configurations of rl_sar: a policy's `config.yaml`, and its robot's `base.yaml` beside it or in the folder above.

use super::known::{Figure, Training, scale_of};
use super::lists::{OneOrMany, parsed};
use crate::ActionClip;
use crate::terms::{Quantity, Scale, Sizes, Stack, Term};
use indexmap::IndexMap;
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_files::assets;
use std::path::Path;

/// Largest size of `base.yaml` (bytes).
const MOST_BYTES: u64 = 1_000_000;

/// The content of `config.yaml`, below the name of the policy. Lists of joints are in the order of the policy.
#[derive(Deserialize)]
pub struct RlSar {
    rl_kp: Vec<f64>,
    rl_kd: Vec<f64>,
    default_dof_pos: Vec<f64>,
    action_scale: OneOrMany,
    #[serde(default)]
    clip_actions_lower: Vec<f64>,
    #[serde(default)]
    clip_actions_upper: Vec<f64>,
    torque_limits: Option<Vec<f64>>,
    /// Joints that are driven by velocity.
    #[serde(default)]
    wheel_indices: Vec<usize>,
    num_observations: usize,
    observations: Vec<String>,
    /// The frames that the network sees, 0 for the present one.
    #[serde(default)]
    observations_history: Vec<usize>,
    observations_history_priority: Option<String>,
    clip_obs: Option<f64>,
    lin_vel_scale: Option<f64>,
    ang_vel_scale: Option<f64>,
    dof_pos_scale: Option<f64>,
    dof_vel_scale: Option<f64>,
    commands_scale: Option<Vec<f64>>,
    #[serde(flatten)]
    robot: Base,
}

/// What `base.yaml` states, below the name of the robot. A policy may state other figures.
#[derive(Default, Deserialize)]
struct Base {
    joint_names: Option<Vec<String>>,
    /// The place in `joint_names` of each joint of the policy.
    joint_mapping: Option<Vec<usize>>,
    dt: Option<f64>,
    decimation: Option<u32>,
}

/// The value of the only key of a file.
fn only<T>(file: &str, map: IndexMap<String, T>) -> Result<T> {
    let names = map.keys().cloned().collect::<Vec<_>>().join(", ");
    let mut values = map.into_values();
    match (values.next(), values.next()) {
        (Some(value), None) => Ok(value),
        _ => Err(Error::value(
            file,
            "keys",
            names,
            "are not those of rl_sar",
            "one key, the name of the robot and the policy",
        )),
    }
}

impl RlSar {
    pub fn training(file: &str, text: &str) -> Result<Training> {
        let config: Self = only(file, parsed(file, text)?)?;
        let bad = |field: &str, value: String, problem: &str, accepted: &str| {
            Error::value(file, field, value, problem, accepted)
        };
        let folder = Path::new(file).parent().unwrap_or(Path::new(""));
        let places = [folder.join("base.yaml"), folder.join("../base.yaml")];
        let base: Base = match places.iter().find(|path| path.is_file()) {
            Some(path) => {
                let text = String::from_utf8_lossy(&assets::read(path, MOST_BYTES)?).into_owned();
                let path = path.to_string_lossy();
                only(&path, parsed(&path, &assets::without_mark(text))?)?
            }
            None => Base::default(),
        };
        let missing = |field: &str| {
            let accepted = "in this file, or in base.yaml beside it or in the folder above";
            bad(field, "(none)".into(), "is missing", accepted)
        };
        let own = config.robot;
        let names = own.joint_names.or(base.joint_names);
        let names = names.ok_or_else(|| missing("joint_names"))?;
        let mapping = own.joint_mapping.or(base.joint_mapping);
        let mapping = mapping.ok_or_else(|| missing("joint_mapping"))?;
        let dt_s = own.dt.or(base.dt).ok_or_else(|| missing("dt"))?;
        let decimation = own.decimation.or(base.decimation);
        let decimation = decimation.ok_or_else(|| missing("decimation"))?;
        let mut joints = Vec::new();
        for place in mapping {
            let Some(name) = names.get(place) else {
                let accepted = "places in joint_names, the first of them 0";
                return Err(bad(
                    "joint_mapping",
                    place.to_string(),
                    "is out of range",
                    accepted,
                ));
            };
            joints.push(name.clone());
        }
        let count = joints.len();
        if !config.wheel_indices.is_empty() {
            let value = format!("{:?}", config.wheel_indices);
            let problem = "are driven by velocity, which no policy does here";
            return Err(bad("wheel_indices", value, problem, "[]"));
        }
        let scale = |field: &str, scale: Option<f64>| {
            scale
                .map(Scale::All)
                .ok_or_else(|| bad(field, "(none)".into(), "is missing", "a number"))
        };
        let mut terms = Vec::new();
        for name in &config.observations {
            let (term, scale) = match &name[..] {
                "lin_vel" => (
                    Quantity::BaseLinearVelocity,
                    scale("lin_vel_scale", config.lin_vel_scale)?,
                ),
                // The sensor that gives it in the world's axes is in a simulator; the network sees it in those of the base.
                "ang_vel" | "ang_vel_body" | "ang_vel_world" => (
                    Quantity::BaseAngularVelocity,
                    scale("ang_vel_scale", config.ang_vel_scale)?,
                ),
                "gravity_vec" => (Quantity::ProjectedGravity, Scale::default()),
                "commands" => (
                    Quantity::Command,
                    scale_of(config.commands_scale.clone().unwrap_or(vec![1.0; 3])),
                ),
                "dof_pos" => (
                    Quantity::JointPositions,
                    scale("dof_pos_scale", config.dof_pos_scale)?,
                ),
                "dof_vel" => (
                    Quantity::JointVelocities,
                    scale("dof_vel_scale", config.dof_vel_scale)?,
                ),
                "actions" => (Quantity::LastAction, Scale::default()),
                _ => {
                    let accepted =
                        "lin_vel, ang_vel, gravity_vec, commands, dof_pos, dof_vel, actions";
                    let problem = "is no term that is known here";
                    return Err(bad("observations", name.clone(), problem, accepted));
                }
            };
            terms.push(Term {
                scale,
                clip: config.clip_obs,
                ..Term::of(term)
            });
        }
        let sizes = Sizes {
            driven: count,
            observed: count,
        };
        let numbers: usize = terms.iter().map(|term| term.length(sizes)).sum();
        if numbers != config.num_observations {
            let accepted = format!("{numbers}, as its terms have with {count} joints");
            return Err(bad(
                "num_observations",
                config.num_observations.to_string(),
                "does not fit observations",
                &accepted,
            ));
        }
        let mut frames = Stack::default();
        if !config.observations_history.is_empty() {
            let history = stack(file, &config.observations_history)?;
            match config.observations_history_priority.as_deref() {
                None | Some("time") => frames = history,
                Some("term") => terms.iter_mut().for_each(|term| term.history = history),
                Some(other) => {
                    return Err(bad(
                        "observations_history_priority",
                        other.into(),
                        "is not known",
                        "time, term",
                    ));
                }
            }
        }
        let (lower, upper) = (config.clip_actions_lower, config.clip_actions_upper);
        for (field, list) in [
            ("clip_actions_lower", &lower),
            ("clip_actions_upper", &upper),
        ] {
            if !(list.is_empty() || list.len() == count) {
                let value = format!("{} numbers", list.len());
                let accepted = format!("{count}, one for each joint, or []");
                return Err(bad(field, value, "has another length", &accepted));
            }
        }
        Ok(Training {
            by: format!("a trainer that rl_sar knows, {file}"),
            period_s: Figure::inferred(dt_s * f64::from(decimation), "dt times decimation"),
            joints: Figure::read(joints),
            default_rad: Figure::read(config.default_dof_pos),
            action_scale: Figure::read(config.action_scale.each(count)),
            action_clip: (!lower.is_empty() && !upper.is_empty())
                .then(|| Figure::read(ActionClip::Each { lower, upper })),
            stiffness: Figure::read(config.rl_kp),
            damping: Figure::read(config.rl_kd),
            torque_n_m: config.torque_limits.map(Figure::read),
            observation: Figure::read(terms),
            frames,
            ..Training::default()
        })
    }
}

/// The frames of these ages, as its buffer keeps them: zeros from before the start.
fn stack(file: &str, ages: &[usize]) -> Result<Stack> {
    let count = ages.len();
    let newest_first = ages.iter().copied().eq(0..count);
    if newest_first || ages.iter().copied().eq((0..count).rev()) {
        return Ok(Stack {
            newest_first,
            zero_before: true,
            ..Stack::of(count)
        });
    }
    let accepted = "all ages from 0, up or down, such as [0, 1, 2]";
    Err(Error::value(
        file,
        "observations_history",
        format!("{ages:?}"),
        "leaves some out",
        accepted,
    ))
}
