//! Plant and controller in a closed loop. At every tick the controller reads the sensors and decides; servos and
//! physics then run until the next tick.

use super::config::{Disturbance, EpisodeConfig};
use super::tick::{Controlled, Tick};
use crate::control::{Controller, Design};
use crate::robot::{Command, Robot, Sensed};
use crate::sim::{Ground, Plant, Pull, Push, Truth};
use nalgebra::Vector2;
use std::panic::{AssertUnwindSafe, catch_unwind};

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
        self.pilot.failure = caught(|| self.plant.advance(self.pilot.command.clone(), &self.pushes)).err();
    }
}

/// What `work` gives or, if it panics, the message of the panic: a numerical failure ends an episode, never a campaign.
/// What `work` has changed must not be used after that.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| text.to_string());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let line: String = text.iter().flat_map(|text| text.lines()).take(1).collect();
        format!("panic: {:.120}", if line.is_empty() { "without a message" } else { &line })
    })
}

/// A controller in an episode, with its last command.
#[derive(Clone)]
pub(super) struct Pilot<'a> {
    robot: &'a Robot,
    design: &'a Design,
    controller: Controller,
    pub command: Command,
    /// What went wrong in the controller or in the simulation, if anything did. Then the episode is over.
    pub failure: Option<String>,
}

impl<'a> Pilot<'a> {
    /// Starts at home and at rest, with a design that is made for `robot`.
    pub fn new(robot: &'a Robot, design: &'a Design) -> Self {
        let (controller, command) = (Controller::new(design.clone()), design.home_command().clone());
        Self { robot, design, controller, command, failure: None }
    }

    /// Decides from the readings of this tick. `truth` is the state at which they were taken.
    pub fn tick<'t>(&'t mut self, sensed: &Sensed, truth: &'t Truth) -> Tick<'t> {
        // If the controller refuses its readings, the last command holds. A state with a NaN ends the episode as
        // diverged.
        if self.failure.is_none() {
            match caught(|| self.controller.tick(sensed, &mut self.command)) {
                Ok(Ok(())) => {}
                Ok(Err(error)) => log::debug!("{:.3} s: {error}", truth.time_s),
                Err(panic) => self.failure = Some(panic),
            }
        }
        let omega = self.design.family.pendulum.omega;
        let failure = self.failure.as_deref();
        Tick { failure, ..Tick::new(self.robot, omega, truth, self.controller.account(), &self.command) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::config::Until;
    use crate::episode::record::Outcome;
    use crate::episode::run::judged;
    use crate::lipm::GainSet;
    use crate::robot::Units;

    #[test]
    fn a_panic_is_told_with_its_message() {
        let told = |message: &'static str| caught(|| -> () { panic!("{message} at {}", 3) });
        assert_eq!(told("no pivot"), Err("panic: no pivot at 3".into()));
        assert_eq!(caught(|| 1), Ok(1));
    }

    #[test]
    fn what_fails_ends_the_episode_with_its_cause() {
        let robot = Robot::load("ut-mu2").unwrap();
        let config = EpisodeConfig::of(&Units::of(&robot));
        let design = Design::new(&robot, &GainSet::load("hold").unwrap(), config.control_period_s).unwrap();
        let mut closed_loop = ClosedLoop::new(&robot, &robot, &design, &config, Disturbance::default());
        closed_loop.pilot.failure = Some("panic: no pivot".into());
        let record = judged(closed_loop, &robot, &config, (Until::Horizon, 1.0), &mut |_, _| {});
        assert_eq!((record.outcome, record.end_s), (Outcome::Diverged, 0.0));
        assert_eq!(record.fall_cause.as_deref(), Some("panic: no pivot"));
    }
}
