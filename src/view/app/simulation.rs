//! A running simulation of the robot in one engine.

use super::plots::{Plotted, Trail};
use super::world::World;
use crate::episode::{ClosedLoop, Controlled, EpisodeConfig, Outcome, Record, Referee, Snapshot};
use crate::robot::Kinematics;
use crate::sim::{Pull, Push};

pub struct Simulation<'a> {
    world: &'a World,
    pub config: &'a EpisodeConfig,
    closed_loop: ClosedLoop<'a>,
    referee: Referee<'a>,
    pub now: Snapshot,
    /// Kinematics of the present posture.
    pub kinematics: Kinematics,
    pub trail: Trail,
}

impl<'a> Simulation<'a> {
    /// Starts at rest at home. `acting` is the index of the controller in `world.designs`.
    pub fn start(world: &'a World, config: &'a EpisodeConfig, acting: usize) -> Self {
        let (robot, simulated) = (&world.robot, &world.simulated);
        let mut closed_loop = ClosedLoop::new(robot, simulated, &world.designs[acting], config, world.disturbance());
        let mut referee = Referee::new(simulated, config, &closed_loop.pushes);
        let tick = closed_loop.tick();
        referee.watch(&tick);
        let now = Snapshot::of(simulated, &tick);
        let kinematics = Kinematics::at(simulated, &now.posture);
        let trail = std::iter::once(Plotted::of(&now)).collect();
        Self { world, config, closed_loop, referee, now, kinematics, trail }
    }

    /// Simulates one control period, with a pull at a link. False if the simulation cannot go on, since it has diverged.
    pub fn advance(&mut self, pull: Option<Pull>) -> bool {
        if self.record().outcome == Outcome::Diverged {
            return false;
        }
        self.closed_loop.pull(pull);
        self.closed_loop.advance();
        let tick = self.closed_loop.tick();
        self.referee.watch(&tick);
        if tick.is_broken() {
            return false;
        }
        self.now = Snapshot::of(&self.world.simulated, &tick);
        self.kinematics.update(&self.world.simulated, &self.now.posture);
        self.trail.push(Plotted::of(&self.now));
        true
    }

    pub fn push(&mut self, push: Push) {
        self.closed_loop.pushes.push(push);
        self.judge_anew();
    }

    /// Goes on with the controller of this index in `world.designs`.
    pub fn switch_to(&mut self, acting: usize) {
        self.closed_loop.switch_to(&self.world.designs[acting]);
        self.judge_anew();
    }

    /// Judges anew after a push, a pull or a change of gains, unless the robot has fallen. The referee waits for the
    /// last push to end.
    pub fn judge_anew(&mut self) {
        if matches!(self.record().outcome, Outcome::TimedOut | Outcome::Recovered) {
            self.referee = Referee::new(&self.world.simulated, self.config, &self.closed_loop.pushes);
        }
    }

    pub fn record(&self) -> &Record {
        &self.referee.record
    }
}
