//! Plant and controller in a closed loop. At every tick the controller reads the sensors and decides; servos and
//! physics then run until the next tick.

use super::config::{Disturbance, EpisodeConfig};
use super::tick::{Controlled, Tick};
use crate::control::{Controller, Design};
use crate::robot::{Command, Robot, Sensed};
use crate::sim::{Ground, Plant, Pull, Push, Truth};
use nalgebra::Vector2;

/// A robot and its controller in a closed loop.
pub struct ClosedLoop<'a> {
    plant: Plant<'a>,
    pilot: Pilot<'a>,
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
        let pilot = Pilot::new(robot, design);
        let plant = Plant::on(ground, simulated, config.clock(), sensor_errors, pilot.command.clone());
        Self { plant, pilot, pushes }
    }

    /// Pulls at a link from the next physics step on; None lets go.
    pub fn pull(&mut self, pull: Option<Pull>) {
        self.plant.pull = pull;
    }

    /// Adds `probe` (m, world frame) to the ZMP that the acting gain asks for, from the next tick on. It serves to
    /// measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.pilot.controller.probe_zmp(probe);
    }

    /// Continues with another gain set, which must be designed for the same robot.
    pub fn switch_to(&mut self, design: &'a Design) {
        self.pilot.design = design;
        self.pilot.controller.switch_to(design.clone());
    }
}

impl Controlled for ClosedLoop<'_> {
    fn tick(&mut self) -> Tick<'_> {
        let sensed = self.plant.sense();
        self.pilot.tick(&sensed, self.plant.truth())
    }

    fn advance(&mut self) {
        self.plant.advance(self.pilot.command.clone(), &self.pushes);
    }
}

/// A controller in an episode, with its last command.
#[derive(Clone)]
pub(super) struct Pilot<'a> {
    robot: &'a Robot,
    design: &'a Design,
    controller: Controller,
    pub command: Command,
}

impl<'a> Pilot<'a> {
    /// Starts at home and at rest, with a design that is made for `robot`.
    pub fn new(robot: &'a Robot, design: &'a Design) -> Self {
        let (controller, command) = (Controller::new(design.clone()), design.home_command().clone());
        Self { robot, design, controller, command }
    }

    /// Decides from the readings of this tick. `truth` is the state at which they were taken.
    pub fn tick<'t>(&'t mut self, sensed: &Sensed, truth: &'t Truth) -> Tick<'t> {
        // If the controller refuses its readings, the last command holds. A state with a NaN ends the episode as
        // diverged.
        if let Err(error) = self.controller.tick(sensed, &mut self.command) {
            log::debug!("{:.3} s: {error}", truth.time_s);
        }
        let omega = self.design.family.pendulum.omega;
        Tick::new(self.robot, omega, truth, self.controller.account(), &self.command)
    }
}
