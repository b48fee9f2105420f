//! Plant and controller in a closed loop, one tick at a time: [`ClosedLoop::tick`] (sense, estimate, decide), then
//! [`ClosedLoop::advance`] (servos and physics, up to the next tick).

use super::{Disturbance, EpisodeConfig, Tick, support_on_ground};
use crate::control::{Controller, Design};
use crate::robot::{Command, Robot};
use crate::sim::plant::Clock;
use crate::sim::{Ground, Plant, Pull, Push};

/// A robot under control.
pub struct ClosedLoop<'a> {
    robot: &'a Robot,
    design: &'a Design,
    plant: Plant<'a>,
    pub controller: Controller<'a>,
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
        Self { robot, design, plant, controller: Controller::new(robot, design), command, pushes }
    }

    /// What the sensors read now, and what the controller makes of it. Once a control period.
    pub fn tick(&mut self) -> Tick<'_> {
        let sensed = self.plant.sense();
        // A controller is not asked what to do about numbers that are none.
        if self.plant.truth().is_finite() {
            self.command = self.controller.tick(&sensed);
        }
        let truth = self.plant.truth();
        let dcm = truth.com.xy() + truth.com_vel.xy() / self.design.family.pendulum.omega;
        let support = support_on_ground(self.robot, truth);
        let dcm_outside_m = support.map_or(f64::INFINITY, |polygon| polygon.signed_distance(dcm));
        Tick { truth, dcm, dcm_outside_m, controller: &self.controller, command: &self.command }
    }

    /// Simulates a control period under the last command.
    pub fn advance(&mut self) {
        self.plant.advance(self.command.clone(), &self.pushes);
    }

    /// Pulls at a link from the coming physics step on; None lets go.
    pub fn pull(&mut self, pull: Option<Pull>) {
        self.plant.pull = pull;
    }

    /// Goes on with another gain set, designed for the same robot.
    pub fn switch_to(&mut self, design: &'a Design) {
        self.design = design;
        self.controller.switch_to(design);
    }
}
