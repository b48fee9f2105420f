//! Runs an episode from its start to its record.

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::Record;
use super::referee::Referee;
use super::tick::{Tick, drive};
use crate::control::Design;
use crate::robot::Robot;
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
    let closed_loop = ClosedLoop::new(robot, simulated, design, config, disturbance);
    judged(closed_loop, simulated, config, (until, 0.0), &mut |tick, _| observe(tick))
}

/// Runs a closed loop until the episode ends, and then for a further `aftermath_s` (s), but not beyond the horizon.
/// `observe` sees every tick, and whether it lies after the end. The record is that of the episode itself.
pub(super) fn judged(
    mut closed_loop: ClosedLoop,
    simulated: &Robot,
    config: &EpisodeConfig,
    (until, aftermath_s): (Until, f64),
    observe: &mut dyn FnMut(&Tick, bool),
) -> Record {
    let mut referee = Referee::new(simulated, config, &closed_loop.pushes);
    let mut ended_at_s: Option<f64> = None;
    drive(&mut closed_loop, config, |tick| {
        observe(tick, ended_at_s.is_some());
        if ended_at_s.is_none() {
            referee.watch(tick);
            ended_at_s = referee.is_over(until).then_some(tick.truth.time_s);
        }
        let is_over = ended_at_s.is_some_and(|end_s| tick.truth.time_s >= end_s + aftermath_s);
        if is_over || tick.is_broken() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    referee.finish()
}
