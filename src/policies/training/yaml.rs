//! The descriptions of policies in YAML: `deploy.yaml` of unitree_rl_lab, and the configurations of unitree_rl_gym.

use super::known::{
    Figure, Training, inertias_of_gains, one_phase, plain, quantity, scale_of, scaled,
};
use crate::terms::{Quantity, Scale, Stack, Term};
use indexmap::IndexMap;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;

/// The training that this file describes.
pub fn training(file: &str, text: &str, robot: &Robot) -> Result<Training> {
    // Whether the file has a key at the start of a line. Each of the two formats has a key that the other lacks.
    let states = |key: &str| text.lines().any(|line| line.starts_with(key));
    if states("joint_ids_map:") {
        Deploy::training(parsed(file, text)?, file, robot)
    } else if states("kps:") {
        let missing: Vec<&str> = Gym::KEYS
            .into_iter()
            .filter(|key| !states(&format!("{key}:")))
            .collect();
        if missing.is_empty() {
            return Gym::training(parsed(file, text)?, file, robot);
        }
        let what = match states("control_dt:") {
            true => "a configuration of unitree_rl_gym for the robot itself (deploy_real)",
            false => "a configuration with kps",
        };
        let accepted = "that for the simulation (deploy_mujoco of unitree_rl_gym), which states it";
        Err(Error::value(
            file,
            "description",
            what,
            format!("does not state {}", missing.join(", ")),
            accepted,
        ))
    } else {
        let other = OTHERS
            .iter()
            .find(|(key, _)| text.lines().any(|line| line.trim_start().starts_with(key)));
        let what = other.map_or(file, |(_, what)| what);
        let accepted = "a deploy.yaml of unitree_rl_lab (with joint_ids_map) or a configuration of unitree_rl_gym (with kps); the \
             guide's chapter onnx.md has the file of a policy to write by hand";
        Err(Error::value(
            file,
            "description",
            what,
            "describes no policy that is known here",
            accepted,
        ))
    }
}

/// Formats that are not read, each with a key that no other format has.
const OTHERS: [(&str, &str); 5] = [
    (
        "JOINT_KP:",
        "a configuration of HumanoidVerse (ASAP, FALCON)",
    ),
    ("rl_kp:", "a configuration of rl_sar"),
    ("default_qpos:", "a configuration of Booster"),
    ("articulations:", "the descriptors of Isaac Lab"),
    ("pipeline:", "a pipeline of WBC-AGILE"),
];

fn parsed<T: DeserializeOwned>(file: &str, text: &str) -> Result<T> {
    serde_saphyr::from_str(text).map_err(|e| Error::Syntax {
        file: file.into(),
        message: e.to_string(),
    })
}

/// The names of the robot's joints, which a file numbers as its motors. Fails if the file has more motors than the
/// robot has joints.
fn motors(file: &str, field: &str, count: usize, robot: &Robot) -> Result<Vec<String>> {
    let names: Vec<String> = robot
        .joints
        .iter()
        .map(|joint| joint.name.clone())
        .collect();
    if count <= names.len() {
        return Ok(names);
    }
    let accepted = format!(
        "at most one for each of the {} joints of {}",
        names.len(),
        robot.name
    );
    Err(Error::value(
        file,
        field,
        format!("{count} numbers"),
        "is for more joints than the robot has",
        accepted,
    ))
}

/// `deploy.yaml` of unitree_rl_lab. Stiffness and damping are in the order of the motors, the rest in the order of the
/// policy.
#[derive(Deserialize)]
struct Deploy {
    /// The motor of each joint of the policy.
    joint_ids_map: Vec<usize>,
    step_dt: f64,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    default_joint_pos: Vec<f64>,
    actions: IndexMap<String, Action>,
    observations: IndexMap<String, Observed>,
}

#[derive(Deserialize)]
struct Action {
    scale: OneOrMany,
    offset: Option<Vec<f64>>,
    clip: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct Observed {
    #[serde(default)]
    params: IndexMap<String, Param>,
    scale: Option<OneOrMany>,
    clip: Option<[f64; 2]>,
    #[serde(default)]
    history_length: usize,
}

/// A parameter of a term. Only numbers are used.
#[derive(Deserialize)]
#[serde(untagged)]
enum Param {
    Number(f64),
    Other(serde::de::IgnoredAny),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrMany {
    One(f64),
    Many(Vec<f64>),
}

impl OneOrMany {
    fn each(self, count: usize) -> Vec<f64> {
        match self {
            Self::One(value) => vec![value; count],
            Self::Many(values) => values,
        }
    }
}

impl Deploy {
    fn training(self, file: &str, robot: &Robot) -> Result<Training> {
        let Self {
            joint_ids_map,
            step_dt,
            stiffness,
            damping,
            default_joint_pos,
            actions,
            observations,
        } = self;
        let names = motors(file, "stiffness", stiffness.len(), robot)?;
        let bad = |field: &str, value: String, problem: &str, accepted: &str| {
            Error::value(file, field, value, problem, accepted)
        };
        let of_motor = |field: &'static str, list: &[f64]| {
            let picked = joint_ids_map.iter().map(|&motor| {
                list.get(motor).copied().ok_or_else(|| {
                    bad(
                        field,
                        format!("{} numbers", list.len()),
                        "has none for a motor",
                        "one for each motor",
                    )
                })
            });
            picked.collect::<Result<Vec<f64>>>()
        };
        let mut joints: Vec<String> = Vec::new();
        for &motor in &joint_ids_map {
            joints.push(names.get(motor).cloned().ok_or_else(|| {
                bad(
                    "joint_ids_map",
                    motor.to_string(),
                    "is no joint of the robot",
                    "the number of a joint",
                )
            })?);
        }
        let names = actions.keys().cloned().collect::<Vec<_>>().join(", ");
        let mut actions = actions.into_values();
        let (
            Some(Action {
                scale,
                offset,
                clip,
            }),
            None,
            "JointPositionAction",
        ) = (actions.next(), actions.next(), &names[..])
        else {
            return Err(bad(
                "actions",
                names,
                "is not known here",
                "JointPositionAction alone",
            ));
        };
        if offset
            .as_ref()
            .is_some_and(|offset| *offset != default_joint_pos)
        {
            let accepted = "that of default_joint_pos, from which joint positions are seen";
            return Err(bad(
                "actions.offset",
                format!("{offset:?}"),
                "is another posture",
                accepted,
            ));
        }
        if let Some(clip) = clip {
            let problem =
                "limits the targets, which no policy does here; leave it out if it is wide";
            return Err(bad("actions.clip", format!("{clip:?}"), problem, "null"));
        }
        let mut gait = None;
        let mut terms = Vec::new();
        for (name, observed) in observations {
            let field = format!("observations.{name}");
            let term = quantity(file, &field, &name)?;
            if term == Quantity::Phase {
                let Some(Param::Number(gait_period_s)) = observed.params.get("period") else {
                    return Err(bad(
                        &field,
                        "(no period)".into(),
                        "has no period",
                        "params: {period: 0.8}",
                    ));
                };
                gait = Some(Figure::inferred(
                    one_phase(*gait_period_s, step_dt),
                    "its period",
                ));
            }
            let scale = observed
                .scale
                .map_or_else(Scale::default, |scale| scale_of(scale.each(1)));
            let clip = match observed.clip {
                None => None,
                // unitree_rl_lab clips before it scales.
                Some([low, high]) if low == -high => match scale {
                    Scale::All(factor) => Some(high * factor.abs()),
                    Scale::Each(_) => {
                        return Err(bad(
                            &field,
                            "(a clip)".into(),
                            "clips before scales that differ",
                            "null",
                        ));
                    }
                },
                Some(clip) => {
                    return Err(bad(
                        &field,
                        format!("{clip:?}"),
                        "is not the same on both sides",
                        "[-a, a]",
                    ));
                }
            };
            terms.push(Term {
                scale,
                clip,
                history: Stack::of(observed.history_length.max(1)),
                ..Term::of(term)
            });
        }
        let (stiffness, damping) = (
            of_motor("stiffness", &stiffness)?,
            of_motor("damping", &damping)?,
        );
        Ok(Training {
            by: format!("unitree_rl_lab, {file}"),
            period_s: Figure::read(step_dt),
            default_rad: Figure::read(default_joint_pos),
            action_scale: Figure::read(scale.each(joints.len())),
            rotor_inertia_kg_m2: Some(inertias_of_gains(&stiffness, &damping).unwrap_or_else(
                || {
                    Figure::assumed(
                        vec![0.01; stiffness.len()],
                        "those of unitree_rl_lab's robots",
                    )
                },
            )),
            stiffness: Figure::read(stiffness),
            damping: Figure::read(damping),
            joints: Figure::assumed(
                joints,
                format!(
                    "joint_ids_map counts the joints of {} in their order",
                    robot.name
                ),
            ),
            gait,
            observation: Figure::read(terms),
            ..Training::default()
        })
    }
}

/// A configuration of unitree_rl_gym. The terms are fixed in its program.
#[derive(Deserialize)]
struct Gym {
    simulation_dt: f64,
    control_decimation: u32,
    kps: Vec<f64>,
    kds: Vec<f64>,
    default_angles: Vec<f64>,
    ang_vel_scale: f64,
    dof_pos_scale: f64,
    dof_vel_scale: f64,
    action_scale: f64,
    cmd_scale: [f64; 3],
}

impl Gym {
    const KEYS: [&str; 10] = [
        "simulation_dt",
        "control_decimation",
        "kps",
        "kds",
        "default_angles",
        "ang_vel_scale",
        "dof_pos_scale",
        "dof_vel_scale",
        "action_scale",
        "cmd_scale",
    ];

    fn training(self, file: &str, robot: &Robot) -> Result<Training> {
        /// Period of the gait in its program (s).
        const GAIT_PERIOD_S: f64 = 0.8;
        let count = self.kps.len();
        let joints = motors(file, "kps", count, robot)?
            .into_iter()
            .take(count)
            .collect();
        let period_s = self.simulation_dt * f64::from(self.control_decimation);
        let terms = vec![
            scaled(
                Quantity::BaseAngularVelocity,
                Scale::All(self.ang_vel_scale),
            ),
            plain(Quantity::ProjectedGravity),
            scaled(Quantity::Command, scale_of(self.cmd_scale.into())),
            scaled(Quantity::JointPositions, Scale::All(self.dof_pos_scale)),
            scaled(Quantity::JointVelocities, Scale::All(self.dof_vel_scale)),
            plain(Quantity::LastAction),
            plain(Quantity::Phase),
        ];
        Ok(Training {
            by: format!("unitree_rl_gym, {file}"),
            period_s: Figure::inferred(period_s, "simulation_dt times control_decimation"),
            joints: Figure::assumed(
                joints,
                format!("the first {count} joints of {}", robot.name),
            ),
            default_rad: Figure::read(self.default_angles),
            action_scale: Figure::read(vec![self.action_scale; count]),
            stiffness: Figure::read(self.kps),
            damping: Figure::read(self.kds),
            gait: Some(Figure::assumed(
                one_phase(GAIT_PERIOD_S, period_s),
                "that of its program, with a period of 0.8 s",
            )),
            observation: Figure::assumed(terms, "the terms of its program; the scales are read"),
            ..Training::default()
        })
    }
}
