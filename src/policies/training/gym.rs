//! The configurations of unitree_rl_gym.

use super::known::{Figure, Training, one_phase, plain, scale_of, scaled};
use super::lists::motors;
use crate::terms::{Quantity, Scale};
use serde::Deserialize;
use standfast_core::error::Result;
use standfast_core::robot::Robot;

/// A configuration of unitree_rl_gym. The terms are fixed in its program.
#[derive(Deserialize)]
pub struct Gym {
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
    pub const KEYS: [&str; 10] = [
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

    pub fn training(self, file: &str, robot: &Robot) -> Result<Training> {
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
