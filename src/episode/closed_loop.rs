//! Plant and controller in a closed loop. At every tick the controller reads the sensors and decides; servos and
//! physics then run until the next tick.

use super::config::{Disturbance, EpisodeConfig};
use super::tick::{Controlled, Tick};
use crate::control::{Controller, Design};
use crate::robot::{Command, Robot};
use crate::sim::plant::Clock;
use crate::sim::{Ground, Plant, Pull, Push};
use nalgebra::Vector2;

/// A robot and its controller in a closed loop.
#[derive(Clone)]
pub struct ClosedLoop<'a> {
    robot: &'a Robot,
    design: &'a Design,
    plant: Plant<'a>,
    controller: Controller,
    command: Command,
    /// The pushes on the robot. More may be added during the episode.
    pub pushes: Vec<Push>,
}

impl<'a> ClosedLoop<'a> {
    /// Starts at home and at rest. The controller is designed for `robot`; `simulated` is its variation in this
    /// episode.
    pub fn new(
        robot: &'a Robot,
        simulated: &'a Robot,
        design: &'a Design,
        config: &EpisodeConfig,
        disturbance: Disturbance,
    ) -> Self {
        let Disturbance { pushes, sensor_errors, variation } = disturbance;
        let ground = Ground::new(robot, &variation);
        let clock = Clock { physics_step_s: config.physics_step_s, control_period_s: config.control_period_s };
        let command = design.home_command().clone();
        let plant = Plant::on(ground, simulated, clock, sensor_errors, command.clone());
        Self { robot, design, plant, controller: Controller::new(design.clone()), command, pushes }
    }

    /// Pulls at a link from the next physics step on; None lets go.
    pub fn pull(&mut self, pull: Option<Pull>) {
        self.plant.pull = pull;
    }

    /// Adds `probe` (m, world frame) to the ZMP that the acting gain asks for, from the next tick on. It serves to
    /// measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.controller.probe_zmp(probe);
    }

    /// Continues with another gain set, which must be designed for the same robot.
    pub fn switch_to(&mut self, design: &'a Design) {
        self.design = design;
        self.controller.switch_to(design.clone());
    }
}

impl Controlled for ClosedLoop<'_> {
    fn tick(&mut self) -> Tick<'_> {
        let sensed = self.plant.sense();
        // If the controller refuses its readings, the last command holds. A state with a NaN ends the episode as
        // diverged.
        if let Err(error) = self.controller.tick(&sensed, &mut self.command) {
            log::debug!("{:.3} s: {error}", self.plant.truth().time_s);
        }
        let omega = self.design.family.pendulum.omega;
        Tick::new(self.robot, omega, self.plant.truth(), self.controller.account(), &self.command)
    }

    fn advance(&mut self) {
        self.plant.advance(self.command.clone(), &self.pushes);
    }
}
