//! An episode with all that there is to see of it, for pictures and replays.

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::Record;
use super::run::judged;
use super::snapshot::Snapshot;
use super::tick::Tick;
use crate::control::Design;
use crate::robot::Robot;
use crate::sim::{Ground, Push};
use std::f64::consts::TAU;

/// A robot farther from home than this (m) has flown off.
pub const FARTHEST_M: f64 = 5.0;

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
    /// Under the robot, on its slope in the end: a snapshot has that of its moment.
    pub ground: Ground,
    /// The record of the episode itself, without what follows it.
    pub record: Record,
    /// One for each control tick, from the start to some time after the episode's end.
    pub snapshots: Vec<Snapshot>,
}

impl Film {
    /// How long one goes on after the episode is decided (s): a fall takes a while.
    pub const AFTERMATH_S: f64 = 1.0;

    /// Runs an episode as [`super::run()`] does, and goes on for a time (s) after its end (a fall takes a while), not beyond
    /// its horizon. `observe` sees the ticks of the episode itself.
    pub fn take(
        robot: &Robot,
        design: &Design,
        config: &EpisodeConfig,
        disturbance: Disturbance,
        how_long: (Until, f64),
        observe: &mut dyn FnMut(&Tick),
    ) -> Self {
        let (variation, pushes) = (disturbance.variation, disturbance.pushes.clone());
        let simulated = variation.robot(robot);
        let closed_loop = ClosedLoop::new(robot, &simulated, design, config, disturbance);
        let mut snapshots = Vec::new();
        let record = judged(closed_loop, &simulated, config, how_long, &mut |tick, is_after| {
            if !is_after {
                observe(tick);
            }
            if tick.truth.is_finite() {
                snapshots.push(Snapshot::of(&simulated, tick));
            }
        });
        let family = &design.family;
        let gains = family.gains.iter().map(|gain| gain.name.clone()).collect();
        let (gain_set, control_period_s) = (family.name.clone(), config.control_period_s);
        let ground = Ground::new(robot, &variation);
        Self { robot: simulated, ground, gain_set, gains, control_period_s, pushes, record, snapshots }
    }

    /// How many moments there are until the robot has flown off or its numbers run away (beyond [`FARTHEST_M`], or a joint
    /// beyond a turn): those that can be shown, one at least of a film that has any.
    pub fn near(&self) -> usize {
        let is_near = |snapshot: &Snapshot| {
            let base = snapshot.posture.base.translation.vector;
            let far_m = [base.norm(), snapshot.com.coords.norm(), snapshot.dcm.coords.norm()];
            far_m.iter().all(|far| *far <= FARTHEST_M) && snapshot.posture.q.iter().all(|q| q.abs() <= TAU)
        };
        let count = self.snapshots.len();
        self.snapshots.iter().position(|snapshot| !is_near(snapshot)).unwrap_or(count).max(1).min(count)
    }

    /// Takes away what comes after `end_s`.
    pub fn cut_at(mut self, end_s: f64) -> Self {
        self.snapshots.retain(|snapshot| snapshot.time_s <= end_s);
        self
    }
}
