//! The configurations with which HumanoidVerse runs a policy on a robot (`sim2real` of ASAP and FALCON).

use super::known::{Figure, Training};
use super::lists::motors;
use crate::terms::{Gait, Quantity, Scale, Sizes, Stack, Term};
use crate::{ActionClip, ObservedJoints};
use indexmap::IndexMap;
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use std::f64::consts::PI;

/// Numbers of terms, or lengths of histories, by the names of terms.
type Counts = IndexMap<String, usize>;

/// A configuration. Lists are in the order of the policy. FALCON states the terms (`obs_dict`); ASAP states the lengths of
/// their histories.
#[derive(Deserialize)]
pub struct HumanoidVerse {
    #[serde(rename = "JOINT_KP")]
    stiffness: Vec<f64>,
    #[serde(rename = "JOINT_KD")]
    damping: Vec<f64>,
    #[serde(rename = "DEFAULT_DOF_ANGLES")]
    default_rad: Vec<f64>,
    #[serde(rename = "NUM_UPPER_BODY_JOINTS")]
    upper: usize,
    #[serde(rename = "GAIT_PERIOD")]
    gait_period_s: Option<f64>,
    #[serde(rename = "DESIRED_BASE_HEIGHT")]
    height_m: Option<f64>,
    #[serde(default)]
    residual_upper_body_action: bool,
    dof_names: Option<Vec<String>>,
    #[serde(default)]
    dof_names_upper_body: Vec<String>,
    #[serde(default)]
    motor_pos_lower_limit_list: Vec<f64>,
    #[serde(default)]
    motor_pos_upper_limit_list: Vec<f64>,
    motor_effort_limit_list: Option<Vec<f64>>,
    obs_dict: Option<IndexMap<String, Vec<String>>>,
    #[serde(default)]
    history_length_dict: Counts,
    obs_dims: Counts,
    obs_loco_dims: Option<Counts>,
    obs_scales: IndexMap<String, f64>,
    history_loco_height_config: Option<Counts>,
    history_loco_config: Option<Counts>,
    history_config: Option<Counts>,
}

impl HumanoidVerse {
    pub fn training(self, file: &str, robot: &Robot) -> Result<Training> {
        let count = self.stiffness.len();
        let bad = |field: &str, value: String, problem: &str, accepted: String| {
            Error::value(file, field, value, problem, accepted)
        };
        let lists = [
            ("JOINT_KD", Some(&self.damping)),
            ("DEFAULT_DOF_ANGLES", Some(&self.default_rad)),
            (
                "motor_effort_limit_list",
                self.motor_effort_limit_list.as_ref(),
            ),
        ];
        for (field, list) in lists {
            if let Some(list) = list.filter(|list| list.len() != count) {
                let value = format!("{} numbers", list.len());
                let accepted = format!("{count}, as many as JOINT_KP has");
                return Err(bad(field, value, "has another length", accepted));
            }
        }
        let observed = self.joints(file, robot)?;
        let is_upper = self.is_upper(file)?;
        let dims = self.obs_loco_dims.as_ref().unwrap_or(&self.obs_dims);
        let actions = dims.get("actions").copied().unwrap_or(count);
        let is_driven = |i: &usize| actions == count || !is_upper[*i];
        let driven: Vec<usize> = (0..count).filter(is_driven).collect();
        if driven.len() != actions {
            let accepted = format!("{count}, or {} without the upper body", count - self.upper);
            return Err(bad(
                "obs_dims.actions",
                actions.to_string(),
                "is no number of joints",
                accepted,
            ));
        }
        // A policy that does not drive the upper body sees where that is held, counted from its default angles.
        let mut reference_rad = Vec::new();
        for i in (0..count).filter(|&i| is_upper[i]) {
            let held = robot
                .joints
                .iter()
                .position(|joint| joint.name == observed.value[i]);
            reference_rad.push(match held.filter(|_| !self.residual_upper_body_action) {
                Some(joint) => robot.home_rad[joint] - self.default_rad[i],
                None => self.default_rad[i],
            });
        }
        let sizes = Sizes {
            driven: actions,
            observed: count,
        };
        let (terms, frames) = self.terms(file, dims, sizes, &reference_rad)?;
        let clock = terms
            .iter()
            .any(|term| matches!(term.term, Quantity::PhaseLeftSin | Quantity::PhaseLeftCos));
        let gait = match (clock, self.gait_period_s) {
            (false, _) => None,
            (true, Some(period_s)) => Some(Figure::inferred(
                Gait {
                    hz: 1.0 / period_s,
                    start_rad: [0.0, PI],
                    standing_rad: Some([0.0, PI]),
                    standing_zero: false,
                },
                "GAIT_PERIOD; while it stands, its program keeps the phase at 0",
            )),
            (true, None) => {
                let accepted = "the period of its gait (s)".into();
                return Err(bad("GAIT_PERIOD", "(none)".into(), "is missing", accepted));
            }
        };
        let of_driven = |list: &[f64]| driven.iter().map(|&i| list[i]).collect::<Vec<f64>>();
        let program = "that of its program";
        Ok(Training {
            by: format!("HumanoidVerse, {file}"),
            period_s: Figure::assumed(0.02, "that of its program, 50 actions a second"),
            joints: Figure {
                value: driven.iter().map(|&i| observed.value[i].clone()).collect(),
                origin: observed.origin.clone(),
            },
            default_rad: Figure::read(of_driven(&self.default_rad)),
            action_scale: Figure::assumed(vec![0.25; actions], program),
            action_clip: Some(Figure::assumed(ActionClip::Magnitude(100.0), program)),
            stiffness: Figure::read(of_driven(&self.stiffness)),
            damping: Figure::read(of_driven(&self.damping)),
            torque_n_m: self
                .motor_effort_limit_list
                .as_deref()
                .map(|list| Figure::read(of_driven(list))),
            rotor_inertia_kg_m2: Some(Figure::assumed(
                vec![0.001; actions],
                "those of HumanoidVerse's robots in Isaac Gym",
            )),
            gait,
            observed: (actions != count).then(|| {
                let value = ObservedJoints {
                    joints: observed.value,
                    default_rad: self.default_rad,
                };
                Figure {
                    value,
                    origin: observed.origin,
                }
            }),
            observation: Figure::assumed(
                terms,
                "its program sorts the terms by name. The constants are those of standing: to walk, command_stand is 1",
            ),
            frames,
            ..Training::default()
        })
    }

    /// Whether each joint is one of the upper body.
    fn is_upper(&self, file: &str) -> Result<Vec<bool>> {
        let count = self.stiffness.len();
        let is_upper: Vec<bool> = match self.dof_names.as_deref() {
            Some(names) if !self.dof_names_upper_body.is_empty() => names
                .iter()
                .map(|name| self.dof_names_upper_body.contains(name))
                .collect(),
            _ => (0..count)
                .map(|i| i >= count.saturating_sub(self.upper))
                .collect(),
        };
        if is_upper.len() == count && is_upper.iter().filter(|&&upper| upper).count() == self.upper
        {
            return Ok(is_upper);
        }
        let accepted =
            "the number of joints in dof_names_upper_body, each of them one of dof_names";
        let problem = "is another number";
        Err(Error::value(
            file,
            "NUM_UPPER_BODY_JOINTS",
            self.upper,
            problem,
            accepted,
        ))
    }

    /// The names of the joints. The names of a file may be in another order than its figures, so that its limits of the
    /// motors decide between that order and the one of the robot.
    fn joints(&self, file: &str, robot: &Robot) -> Result<Figure<Vec<String>>> {
        let count = self.stiffness.len();
        let mut in_order = motors(file, "JOINT_KP", count, robot)?;
        in_order.truncate(count);
        let misfits = |names: &[String]| {
            let limits = [
                &self.motor_pos_lower_limit_list,
                &self.motor_pos_upper_limit_list,
            ];
            let mut misfits = 0;
            for (i, name) in names.iter().enumerate() {
                let joint = robot.joints.iter().find(|joint| joint.name == *name);
                let own = joint.map_or([f64::INFINITY; 2], |joint| {
                    [joint.lower_rad, joint.upper_rad]
                });
                for (stated, own) in limits.iter().zip(own) {
                    let differs = |stated: &f64| (stated - own).abs() >= 0.01;
                    misfits += usize::from(stated.get(i).is_none_or(differs));
                }
            }
            misfits
        };
        let beside = misfits(&in_order);
        let as_robot = format!("in the order of the joints of {}", robot.name);
        Ok(match &self.dof_names {
            Some(named) if named.len() != count => {
                let value = format!("{} names", named.len());
                let accepted = format!("{count}, as many as JOINT_KP has");
                return Err(Error::value(
                    file,
                    "dof_names",
                    value,
                    "has another length",
                    accepted,
                ));
            }
            Some(named) if *named == in_order || misfits(named) < beside => {
                Figure::read(named.clone())
            }
            Some(named) if misfits(named) == beside => {
                let why = format!("its dof_names, which are not {as_robot}");
                Figure::assumed(named.clone(), why)
            }
            Some(_) => Figure::inferred(
                in_order,
                format!(
                    "{as_robot} its motors have the limits that it states, in that of dof_names they do not"
                ),
            ),
            None if beside == 0 => Figure::inferred(
                in_order,
                format!("{as_robot} its motors have the limits that it states"),
            ),
            None => Figure::assumed(in_order, format!("they are {as_robot}")),
        })
    }

    /// The terms, and how many frames of them the network sees. Values from before the start are 0.
    fn terms(
        &self,
        file: &str,
        dims: &Counts,
        sizes: Sizes,
        reference_rad: &[f64],
    ) -> Result<(Vec<Term>, Stack)> {
        /// The height (m) that ASAP's program asks for.
        const HEIGHT_M: f64 = 0.78;
        let of_zeros = |count| Stack {
            zero_before: true,
            ..Stack::of(count)
        };
        let present = |names: &[&String]| -> Vec<(String, Stack)> {
            names
                .iter()
                .map(|name| (name.to_string(), Stack::default()))
                .collect()
        };
        let (mut named, frames) = match &self.obs_dict {
            Some(inputs) => {
                let (Some(names), 1) = (inputs.get("actor_obs"), inputs.len()) else {
                    let keys: Vec<&str> = inputs.keys().map(String::as_str).collect();
                    return Err(Error::value(
                        file,
                        "obs_dict",
                        keys.join(", "),
                        "is not known here",
                        "actor_obs alone",
                    ));
                };
                let count = self.history_length_dict.get("actor_obs").copied();
                let names: Vec<&String> = names.iter().collect();
                let frames = match count.unwrap_or(1) {
                    1 => Stack::default(),
                    count => of_zeros(count),
                };
                (present(&names), frames)
            }
            None => {
                let histories = [
                    &self.history_loco_height_config,
                    &self.history_loco_config,
                    &self.history_config,
                ];
                let Some(history) = histories.into_iter().flatten().next() else {
                    let accepted =
                        "lists of terms: obs_dict of FALCON, or history_loco_config of ASAP";
                    return Err(Error::value(
                        file,
                        "obs_dict",
                        "(none)",
                        "is missing",
                        accepted,
                    ));
                };
                let mut named = present(&history.keys().collect::<Vec<_>>());
                let scale = self.obs_scales.get("history").copied().unwrap_or(1.0);
                if scale != 1.0 {
                    let problem = "scales the past otherwise than the present, which is not taken";
                    return Err(Error::value(
                        file,
                        "obs_scales.history",
                        scale,
                        problem,
                        "1.0",
                    ));
                }
                // The past of all terms is one term for its program, of the name "history".
                let mut past: Vec<(String, Stack)> = history
                    .iter()
                    .map(|(name, &count)| (format!("history {name}"), of_zeros(count)))
                    .collect();
                for (_, stack) in &mut past {
                    (stack.newest_first, stack.past_only) = (true, true);
                }
                named.extend(past);
                (named, Stack::default())
            }
        };
        named.sort_by(|(one, _), (other, _)| one.cmp(other));
        let mut terms = Vec::new();
        for (sorted, history) in named {
            let name = sorted.strip_prefix("history ").unwrap_or(&sorted);
            let constant = |values: &[f64]| Term {
                values: values.into(),
                ..Term::of(Quantity::Constant)
            };
            let term = match name {
                "base_lin_vel" => Term::of(Quantity::BaseLinearVelocity),
                "base_ang_vel" => Term::of(Quantity::BaseAngularVelocity),
                "projected_gravity" => Term::of(Quantity::ProjectedGravity),
                "command_lin_vel" => Term::of(Quantity::CommandWalk),
                "command_ang_vel" => Term::of(Quantity::CommandTurn),
                "command_stand" => constant(&[0.0]),
                "command_base_height" => constant(&[self.height_m.unwrap_or(HEIGHT_M)]),
                "command_waist_dofs" => constant(&[0.0; 3]),
                "ref_upper_dof_pos" => constant(reference_rad),
                "dof_pos" => Term::of(Quantity::JointPositions),
                "dof_vel" => Term::of(Quantity::JointVelocities),
                "actions" => Term::of(Quantity::LastAction),
                "sin_phase" => Term::of(Quantity::PhaseLeftSin),
                "cos_phase" => Term::of(Quantity::PhaseLeftCos),
                _ => {
                    let accepted = "base_lin_vel, base_ang_vel, projected_gravity, command_lin_vel, command_ang_vel, \
                         command_stand, command_base_height, command_waist_dofs, ref_upper_dof_pos, dof_pos, dof_vel, \
                         actions, sin_phase, cos_phase";
                    let problem = "is no term that is known here";
                    return Err(Error::value(file, "obs_dict", name, problem, accepted));
                }
            };
            let numbers = term.length(sizes);
            if let Some(stated) = dims.get(name).filter(|stated| **stated != numbers) {
                let field = format!("obs_dims.{name}");
                return Err(Error::value(
                    file,
                    field,
                    stated,
                    "does not fit its joints",
                    numbers.to_string(),
                ));
            }
            let Some(scale) = self.obs_scales.get(name) else {
                let field = format!("obs_scales.{name}");
                return Err(Error::value(
                    file,
                    field,
                    "(none)",
                    "is missing",
                    "a number",
                ));
            };
            terms.push(Term {
                scale: Scale::All(*scale),
                history,
                ..term
            });
        }
        Ok((terms, frames))
    }
}
