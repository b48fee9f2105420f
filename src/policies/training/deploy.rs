//! `deploy.yaml` of unitree_rl_lab and unitree_rl_mjlab.

use super::known::{Figure, Training, inertias_of_gains, one_phase, quantity, scale_of};
use super::yaml::{OneOrMany, motors};
use crate::terms::{Quantity, Scale, Stack, Term};
use indexmap::IndexMap;
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;

/// `deploy.yaml` of unitree_rl_lab. Stiffness and damping are in the order of the motors, the rest in the order of the
/// policy.
#[derive(Deserialize)]
pub struct Deploy {
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

impl Deploy {
    pub fn training(self, file: &str, robot: &Robot) -> Result<Training> {
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
