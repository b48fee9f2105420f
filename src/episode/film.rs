//! An episode with all that there is to see of it, for pictures and replays.

use super::referee::Referee;
use super::{ClosedLoop, Disturbance, EpisodeConfig, Record, Snapshot, Tick, Until};
use crate::control::Design;
use crate::robot::Robot;
use crate::sim::{Ground, Push, Variation};

/// A recorded episode.
#[derive(Debug, Clone)]
pub struct Film {
    /// As the episode had it: with the disturbance's variation.
    pub robot: Robot,
    /// Name of the gain set, and of its gains, slow to fast.
    pub gain_set: String,
    pub gains: Vec<String>,
    pub control_period_s: f64,
    pub pushes: Vec<Push>,
    pub variation: Variation,
    /// Under the robot, on its slope in the end: a snapshot has that of its moment.
    pub ground: Ground,
    /// The record of the episode itself, without what follows it.
    pub record: Record,
    /// One for each control tick, from the start to some time after the episode's end.
    pub snapshots: Vec<Snapshot>,
}

impl Film {
    /// Runs an episode as [`super::run`] does, and goes on for `aftermath_s` after its end (a fall takes a while), not
    /// beyond its horizon. `observe` sees the ticks of the episode itself.
    pub fn take(
        robot: &Robot,
        design: &Design,
        config: &EpisodeConfig,
        disturbance: Disturbance,
        (until, aftermath_s): (Until, f64),
        observe: &mut dyn FnMut(&Tick),
    ) -> Self {
        let variation = disturbance.variation;
        let ground = Ground::new(robot, &variation);
        let simulated = &variation.robot(robot);
        let mut closed_loop = ClosedLoop::new(robot, simulated, design, config, disturbance);
        let mut referee = Referee::new(simulated, config, &closed_loop.pushes);
        let mut snapshots = Vec::new();
        let mut ended_at_s: Option<f64> = None;
        let ticks = (config.horizon_s / config.control_period_s).round() as u64;
        for k in 0..=ticks {
            let tick = closed_loop.tick();
            if ended_at_s.is_none() {
                observe(&tick);
                referee.watch(&tick);
                ended_at_s = referee.is_over(until).then_some(tick.truth.time_s);
            }
            if !tick.truth.is_finite() {
                break;
            }
            snapshots.push(Snapshot::of(simulated, &tick));
            if k == ticks || ended_at_s.is_some_and(|end_s| tick.truth.time_s >= end_s + aftermath_s) {
                break;
            }
            closed_loop.advance();
        }
        let pushes = closed_loop.pushes;
        let record = referee.finish();
        let family = &design.family;
        let gains = family.gains.iter().map(|gain| gain.name.clone()).collect();
        let (gain_set, control_period_s) = (family.name.clone(), config.control_period_s);
        let robot = simulated.clone();
        Self { robot, gain_set, gains, control_period_s, pushes, variation, ground, record, snapshots }
    }
    /// Takes away what comes after `end_s`.
    pub fn cut_at(&mut self, end_s: f64) {
        self.snapshots.retain(|snapshot| snapshot.time_s <= end_s);
    }
}
