//! Plant and controller in a closed loop, one tick at a time: [`ClosedLoop::tick`] (sense, estimate, decide), then
//! [`ClosedLoop::advance`] (servos and physics, up to the next tick).

use super::{Disturbance, EpisodeConfig, Tick, support_on_ground};
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

    /// What the sensors read now, and what the controller makes of it. Once a control period.
    pub fn tick(&mut self) -> Tick<'_> {
        let sensed = self.plant.sense();
        // One that is refused what it senses keeps to its last command; a plant without numbers ends the episode.
        if let Err(error) = self.controller.tick(&sensed, &mut self.command) {
            log::debug!("{:.3} s: {error}", self.plant.truth().time_s);
        }
        let truth = self.plant.truth();
        let dcm = truth.com.xy() + truth.com_vel.xy() / self.design.family.pendulum.omega;
        let support = support_on_ground(self.robot, truth);
        let dcm_outside_m = support.map_or(f64::INFINITY, |polygon| polygon.signed_distance(dcm));
        Tick { truth, dcm, dcm_outside_m, account: self.controller.account(), command: &self.command }
    }

    /// Simulates a control period under the last command.
    pub fn advance(&mut self) {
        self.plant.advance(self.command.clone(), &self.pushes);
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
