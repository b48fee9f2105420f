//! A running simulation of one entrant.

use super::plots::{Plotted, Trail};
use super::world::LiveSetup;
use standfast_core::robot::Kinematics;
use standfast_sim::episode::{ClosedLoop, EpisodeConfig, Outcome, Record, Snapshot, Until};
use standfast_sim::{Pull, Push};

/// The one controller of the closed loop.
const ONLY: usize = 0;

pub struct Simulation<'a> {
    world: &'a LiveSetup,
    pub config: &'a EpisodeConfig,
    /// Index into `world.factories`.
    pub acting: usize,
    closed_loop: ClosedLoop<'a>,
    pub now: Snapshot,
    /// Kinematics of the present posture.
    pub kinematics: Kinematics,
    pub trail: Trail,
}

impl<'a> Simulation<'a> {
    /// Starts at rest at home, with settings of `world` and the controller `acting`.
    pub fn start(world: &'a LiveSetup, config: &'a EpisodeConfig, acting: usize) -> Self {
        let simulated = &world.simulated;
        let closed_loop = ClosedLoop::new(
            &world.robot,
            [&world.factories[acting]],
            config,
            world.disturbance(),
        );
        let mut closed_loop = closed_loop.until(Until::Horizon, 0.0);
        let mut now = None;
        closed_loop.decide(&mut |_, tick| now = Some(Snapshot::of(simulated, tick)));
        let now = now.expect("a closed loop starts with a tick");
        let kinematics = Kinematics::at(simulated, &now.posture);
        let trail = std::iter::once(Plotted::of(&now)).collect();
        Self {
            world,
            config,
            acting,
            closed_loop,
            now,
            kinematics,
            trail,
        }
    }

    /// Simulates one control period, with a pull at a link. Returns false if the simulation cannot continue, because it
    /// has diverged or its controller failed.
    pub fn advance(&mut self, pull: Option<Pull>) -> bool {
        if matches!(self.record().outcome, Outcome::Diverged | Outcome::Failed) {
            return false;
        }
        self.closed_loop.pull(pull);
        self.closed_loop.advance();
        let mut now = None;
        self.closed_loop.decide(&mut |_, tick| {
            now = Some(Snapshot::of(&self.world.simulated, tick)).filter(|_| !tick.is_broken())
        });
        let Some(now) = now else { return false };
        self.now = now;
        self.kinematics
            .update(&self.world.simulated, &self.now.posture);
        self.trail.push(Plotted::of(&self.now));
        true
    }

    pub fn push(&mut self, push: Push) {
        self.closed_loop.push(push);
        self.judge_anew();
    }

    /// Continues with the controller of this index in `world.factories`.
    pub fn switch_to(&mut self, acting: usize) {
        self.acting = acting;
        let (factory, seed) = (&self.world.factories[acting], self.world.disturbance().seed);
        for controller in self.closed_loop.controllers() {
            standfast_controllers::replace(controller, factory, seed);
        }
        self.judge_anew();
    }

    /// Judges anew after a push, a pull or a change of controllers, unless the robot has fallen. The judge waits for
    /// the last push to end.
    pub fn judge_anew(&mut self) {
        if matches!(
            self.record().outcome,
            Outcome::TimedOut | Outcome::Survived | Outcome::Recovered
        ) {
            self.closed_loop.judge_anew();
        }
    }

    pub fn record(&self) -> &Record {
        self.closed_loop.record(ONLY)
    }
}
