//! Runs an episode from its start to its record. Episodes that differ in their pushes alone begin alike, so their
//! beginning can be run once: see [`Opening`].

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::Record;
use super::referee::Referee;
use super::tick::{Controlled, Tick, drive_from};
use crate::control::Design;
use crate::robot::Robot;
use crate::sim::Push;
use std::ops::ControlFlow;

/// Runs one episode of `robot`, for which `design` is made, with the variation and the pushes of `disturbance`. The
/// same arguments give the same record, to the bit.
pub fn run(
    robot: &Robot,
    design: &Design,
    config: &EpisodeConfig,
    disturbance: Disturbance,
    until: Until,
    observe: &mut dyn FnMut(&Tick),
) -> Record {
    let simulated = &disturbance.variation.robot(robot);
    let start = Opening::new(robot, simulated, design, config, disturbance);
    start.finish((until, 0.0), &mut |tick, _| observe(tick))
}

/// An episode up to some tick: robot, controller and referee.
#[derive(Clone)]
pub struct Opening<'a> {
    closed_loop: ClosedLoop<'a>,
    referee: Referee<'a>,
    config: &'a EpisodeConfig,
    /// The next tick to run.
    tick: u64,
}

impl<'a> Opening<'a> {
    /// The start of the episode. `simulated` is `robot` with the variation of the disturbance.
    pub fn new(
        robot: &'a Robot,
        simulated: &'a Robot,
        design: &'a Design,
        config: &'a EpisodeConfig,
        disturbance: Disturbance,
    ) -> Self {
        let closed_loop = ClosedLoop::new(robot, simulated, design, config, disturbance);
        let referee = Referee::new(simulated, config, &closed_loop.pushes);
        Self { closed_loop, referee, config, tick: 0 }
    }

    /// Runs the ticks that no push from `push_s` (s) on can affect.
    pub fn before(mut self, push_s: f64) -> Self {
        // One tick to spare, for the rounding of times.
        let last = (push_s / self.config.control_period_s).floor() as u64;
        while self.tick + 1 < last && !self.referee.is_over(Until::Decided) {
            self.referee.watch(&self.closed_loop.tick());
            self.closed_loop.advance();
            self.tick += 1;
        }
        self
    }

    /// A copy that goes on with `pushes`. None of them may start before the time to which this one has been run.
    pub fn with(&self, pushes: Vec<Push>) -> Self {
        let mut copy = self.clone();
        copy.referee.expect(&pushes);
        copy.closed_loop.pushes = pushes;
        copy
    }

    /// Runs the rest of the episode until it ends, and then for a further `aftermath_s` (s), but not beyond the
    /// horizon. `observe` sees every tick from here on, and whether it lies after the end. The record is that of the
    /// episode itself, with its beginning.
    pub fn finish(self, (until, aftermath_s): (Until, f64), observe: &mut dyn FnMut(&Tick, bool)) -> Record {
        let Self { mut closed_loop, mut referee, config, tick } = self;
        let mut ended_at_s: Option<f64> = None;
        drive_from(tick, &mut closed_loop, config, |tick| {
            observe(tick, ended_at_s.is_some());
            if ended_at_s.is_none() {
                referee.watch(tick);
                ended_at_s = referee.is_over(until).then_some(tick.truth.time_s);
            }
            let is_over = ended_at_s.is_some_and(|end_s| tick.truth.time_s >= end_s + aftermath_s);
            if is_over || !tick.truth.is_finite() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        referee.finish()
    }
}
