//! `deploy.yaml` of unitree_rl_lab and unitree_rl_mjlab.

use super::known::{Figure, Training, inertias_of_gains, one_phase, quantity, scale_of};
use super::lists::{OneOrMany, motors};
use crate::ObservedJoints;
use crate::terms::{Gait, Quantity, Scale, Stack, Term};
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
    observations: IndexMap<String, Entry>,
}

/// A term, a switch of all terms, or the terms of one input of the network.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "accepted: true or false, a term with params, scale, clip, history_length, or the terms of an input"
)]
enum Entry {
    Switch(bool),
    Term(Observed),
    Input(IndexMap<String, Entry>),
}

#[derive(Deserialize)]
struct Action {
    scale: OneOrMany,
    offset: Option<Vec<f64>>,
    clip: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Observed {
    #[serde(default)]
    params: IndexMap<String, Param>,
    scale: Option<OneOrMany>,
    clip: Option<[f64; 2]>,
    #[serde(default)]
    history_length: usize,
}

/// A parameter of a term. Numbers are used, and joints are refused.
#[derive(Deserialize)]
#[serde(untagged)]
enum Param {
    Number(f64),
    Part(PartOfJoints),
    Other(serde::de::IgnoredAny),
}

#[derive(Deserialize)]
struct PartOfJoints {
    joint_ids: Option<Vec<usize>>,
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
        let mut seen = Seen {
            file,
            step_dt,
            terms: Vec::new(),
            gait: None,
            by_frames: false,
            angles_alone: None,
        };
        seen.add("observations", None, observations)?;
        let frames = seen.frames()?;
        let zeros = || ObservedJoints {
            joints: joints.clone(),
            default_rad: vec![0.0; joints.len()],
        };
        let observed = seen
            .angles_alone
            .unwrap_or(false)
            .then(|| Figure::inferred(zeros(), "joint_pos has the angles themselves"));
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
            gait: seen.gait,
            observed,
            frames,
            observation: Figure::read(seen.terms),
            ..Training::default()
        })
    }
}

/// The terms that are read so far.
struct Seen<'a> {
    file: &'a str,
    step_dt: f64,
    terms: Vec<Term>,
    gait: Option<Figure<Gait>>,
    /// Whole frames of all terms follow each other, rather than the history of one term the next one's.
    by_frames: bool,
    /// Joint positions are the angles themselves.
    angles_alone: Option<bool>,
}

impl Seen<'_> {
    fn bad(&self, field: &str, value: &str, problem: &str, accepted: &str) -> Error {
        Error::value(self.file, field, value, problem, accepted)
    }

    /// Adds the terms of an input of the network, None for its only one.
    fn add(
        &mut self,
        field: &str,
        input: Option<&str>,
        entries: IndexMap<String, Entry>,
    ) -> Result<()> {
        // unitree_rl_lab clips before it scales, as Isaac Lab does, unless the file says otherwise.
        let scale_first = matches!(entries.get("scale_first"), Some(Entry::Switch(true)));
        for (name, entry) in entries {
            let field = format!("{field}.{name}");
            match entry {
                Entry::Switch(_) if name == "scale_first" => {}
                Entry::Switch(on) if name == "use_gym_history" => self.by_frames |= on,
                Entry::Switch(_) => {
                    let accepted = "use_gym_history, scale_first";
                    return Err(self.bad(&field, "(a switch)", "is not known here", accepted));
                }
                Entry::Input(entries) if input.is_none() => {
                    self.add(&field, Some(&name), entries)?;
                }
                Entry::Input(_) => {
                    let problem = "has terms within the terms of an input";
                    return Err(self.bad(&field, "(terms)", problem, "a term"));
                }
                Entry::Term(observed) => {
                    let term = self.term(&field, &name, observed, scale_first)?;
                    self.terms.push(Term {
                        input: input.map(str::to_string),
                        ..term
                    });
                }
            }
        }
        Ok(())
    }

    fn term(
        &mut self,
        field: &str,
        name: &str,
        observed: Observed,
        scale_first: bool,
    ) -> Result<Term> {
        let term = quantity(self.file, field, name)?;
        if let Some(Param::Part(PartOfJoints {
            joint_ids: Some(joints),
        })) = observed.params.get("asset_cfg")
        {
            let problem = "observes these joints alone, which is not taken";
            return Err(self.bad(field, &format!("{joints:?}"), problem, "all joints, null"));
        }
        if term == Quantity::JointPositions {
            let is_angle = name == "joint_pos";
            if *self.angles_alone.get_or_insert(is_angle) != is_angle {
                let problem = "are there both";
                return Err(self.bad(field, "joint_pos, joint_pos_rel", problem, "one of them"));
            }
        }
        if term == Quantity::Phase {
            let Some(Param::Number(gait_period_s)) = observed.params.get("period") else {
                return Err(self.bad(
                    field,
                    "(no period)",
                    "has no period",
                    "params: {period: 0.8}",
                ));
            };
            let gait = one_phase(*gait_period_s, self.step_dt);
            self.gait = Some(Figure::inferred(gait, "its period"));
        }
        let scale = observed
            .scale
            .map_or_else(Scale::default, |scale| scale_of(scale.each(1)));
        let clip = match observed.clip {
            None => None,
            Some([low, high]) if low == -high => match scale {
                _ if scale_first => Some(high),
                Scale::All(factor) => Some(high * factor.abs()),
                Scale::Each(_) => {
                    let problem = "clips before scales that differ";
                    return Err(self.bad(field, "(a clip)", problem, "null"));
                }
            },
            Some(clip) => {
                let value = format!("{clip:?}");
                return Err(self.bad(field, &value, "is not the same on both sides", "[-a, a]"));
            }
        };
        Ok(Term {
            scale,
            clip,
            history: Stack::of(observed.history_length.max(1)),
            ..Term::of(term)
        })
    }

    /// How many frames the network sees. Their number is that of the terms' histories.
    fn frames(&mut self) -> Result<Stack> {
        let Some(first) = self.terms.first().filter(|_| self.by_frames) else {
            return Ok(Stack::default());
        };
        let frames = first.history;
        if self.terms.iter().any(|term| term.history != frames) {
            let accepted = "the same history_length in all terms";
            let problem = "needs frames of all terms";
            return Err(self.bad("observations.use_gym_history", "true", problem, accepted));
        }
        for term in &mut self.terms {
            term.history = Stack::default();
        }
        Ok(frames)
    }
}
