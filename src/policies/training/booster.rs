//! The configurations of booster_gym's deployment. The terms are fixed in its program.

use super::known::{Figure, Training, plain, scale_of, scaled};
use super::lists::motors;
use crate::ActionClip;
use crate::terms::{Gait, Quantity, Scale};
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use std::f64::consts::PI;

/// Lists are in the order of the robot's motors. The policy drives the last `num_actions` of them, the legs.
#[derive(Deserialize)]
pub struct Booster {
    common: Common,
    policy: Policy,
}

#[derive(Deserialize)]
struct Common {
    dt: f64,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    default_qpos: Vec<f64>,
    torque_limit: Vec<f64>,
}

#[derive(Deserialize)]
struct Policy {
    num_actions: usize,
    gait_frequency: f64,
    normalization: Normalization,
    control: Control,
}

#[derive(Deserialize)]
struct Normalization {
    gravity: f64,
    lin_vel: f64,
    ang_vel: f64,
    dof_pos: f64,
    dof_vel: f64,
    clip_actions: f64,
}

#[derive(Deserialize)]
struct Control {
    action_scale: f64,
    decimation: u32,
}

impl Booster {
    pub fn training(self, file: &str, robot: &Robot) -> Result<Training> {
        let Self { common, policy } = self;
        let (motors_count, count) = (common.default_qpos.len(), policy.num_actions);
        let names = motors(file, "common.default_qpos", motors_count, robot)?;
        if count > motors_count || names.len() != motors_count {
            let accepted = format!(
                "a number for each of the {} joints of {}, of which the policy drives the last ones",
                names.len(),
                robot.name
            );
            let value = format!("{motors_count} numbers, {count} actions");
            let problem = "does not fit the robot";
            return Err(Error::value(
                file,
                "common.default_qpos",
                value,
                problem,
                accepted,
            ));
        }
        let last = |list: Vec<f64>| list.into_iter().skip(motors_count - count).collect();
        let of = &policy.normalization;
        let terms = vec![
            scaled(Quantity::ProjectedGravity, Scale::All(of.gravity)),
            scaled(Quantity::BaseAngularVelocity, Scale::All(of.ang_vel)),
            scaled(
                Quantity::Command,
                scale_of(vec![of.lin_vel, of.lin_vel, of.ang_vel]),
            ),
            plain(Quantity::PhaseLeftCos),
            plain(Quantity::PhaseLeftSin),
            scaled(Quantity::JointPositions, Scale::All(of.dof_pos)),
            scaled(Quantity::JointVelocities, Scale::All(of.dof_vel)),
            plain(Quantity::LastAction),
        ];
        let gait = Gait {
            hz: policy.gait_frequency,
            start_rad: [0.0, PI],
            standing_rad: None,
            standing_zero: true,
        };
        let why = format!("the last {count} joints of {}", robot.name);
        Ok(Training {
            by: format!("booster_gym, {file}"),
            period_s: Figure::inferred(
                common.dt * f64::from(policy.control.decimation),
                "dt times decimation",
            ),
            joints: Figure::assumed(names[motors_count - count..].to_vec(), why),
            default_rad: Figure::read(last(common.default_qpos)),
            action_scale: Figure::read(vec![policy.control.action_scale; count]),
            action_clip: Some(Figure::read(ActionClip::Magnitude(of.clip_actions))),
            stiffness: Figure::read(last(common.stiffness)),
            damping: Figure::read(last(common.damping)),
            torque_n_m: Some(Figure::read(last(common.torque_limit))),
            gait: Some(Figure::read(gait)),
            observation: Figure::assumed(terms, "the terms of its program; the scales are read"),
            ..Training::default()
        })
    }
}
