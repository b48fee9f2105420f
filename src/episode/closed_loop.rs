//! Plant and controller in a closed loop: sense, estimate, decide at every tick, then servos and physics up to the next.

use super::config::{Disturbance, EpisodeConfig};
use super::tick::{Controlled, Tick};
use crate::control::{Controller, Design};
use crate::robot::{Command, Robot};
use crate::sim::plant::Clock;
use crate::sim::{Ground, Plant, Pull, Push};
use nalgebra::Vector2;

/// A robot under control.
pub struct ClosedLoop<'a> {
    robot: &'a Robot,
    design: &'a Design,
    plant: Plant<'a>,
    controller: Controller,
    command: Command,
    /// More may be added on the way.
    pub pushes: Vec<Push>,
}

impl<'a> ClosedLoop<'a> {
    /// At home, at rest. The controller is made for `robot`; `simulated` is that robot as the disturbance varies it.
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

    /// Pulls at a link from the coming physics step on; None lets go.
    pub fn pull(&mut self, pull: Option<Pull>) {
        self.plant.pull = pull;
    }

    /// Adds to what the acting gain wants of the ZMP (m, world) from the coming tick on: to measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.controller.probe_zmp(probe);
    }

    /// Goes on with another gain set, designed for the same robot.
    pub fn switch_to(&mut self, design: &'a Design) {
        self.design = design;
        self.controller.switch_to(design.clone());
    }
}

impl Controlled for ClosedLoop<'_> {
    fn tick(&mut self) -> Tick<'_> {
        let sensed = self.plant.sense();
        // One that is refused what it senses keeps to its last command; a plant without numbers ends the episode.
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
