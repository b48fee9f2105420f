//! An episode recorded with all data that pictures and replays show.

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::Record;
use super::snapshot::Snapshot;
use super::tick::Tick;
use crate::{Engine, Ground, Push};
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use std::f64::consts::TAU;

/// Distance from the origin, in COM heights, beyond which the robot counts as flown off.
const FARTHEST: f64 = 16.0;

#[derive(Debug, Clone)]
pub struct Film {
    /// The simulated robot, with the variation of the disturbance.
    pub robot: Robot,
    /// The physics engine that simulated the robot.
    pub engine: Engine,
    /// Name of the controller, and names of the regions of its promise. The regions of gains are in the order from slow
    /// to fast.
    pub controller: String,
    pub regions: Vec<String>,
    pub control_period_s: f64,
    pub pushes: Vec<Push>,
    /// The ground, on its slope at the end. Each snapshot has the slope of its own time.
    pub ground: Ground,
    /// The record of the episode, without the time that follows its end.
    pub record: Record,
    /// One snapshot for each control tick, from the start to some time after the end of the episode.
    pub snapshots: Vec<Snapshot>,
}

impl Film {
    /// Usual time (s) for which a film continues after the episode is decided, because a fall takes a while.
    pub const AFTERMATH_S: f64 = 1.0;

    /// Runs an episode as [`super::run()`] does, until it is decided and for `aftermath_s` (s) after that, but not
    /// beyond its horizon. `observe` is called at every tick. Errors are those of [`ClosedLoop::finish`].
    pub fn take(
        robot: &Robot,
        factory: &PreparedController,
        config: &EpisodeConfig,
        disturbance: Disturbance,
        (until, aftermath_s): (Until, f64),
        observe: &mut dyn FnMut(&Tick),
    ) -> Result<Self> {
        let (variation, pushes) = (disturbance.variation, disturbance.pushes.clone());
        let simulated = variation.robot(robot);
        let mut snapshots = Vec::new();
        let closed_loop =
            ClosedLoop::new(robot, [factory], config, disturbance).until(until, aftermath_s);
        let mut records = closed_loop.watched(&mut |_, tick| {
            observe(tick);
            if tick.truth.is_finite() {
                snapshots.push(Snapshot::of(&simulated, tick));
            }
        })?;
        let (controller, regions) = (factory.name.clone(), factory.regions.clone());
        let (engine, control_period_s, record) =
            (config.engine, config.control_period_s, records.remove(0));
        let ground = Ground::new(robot, &variation);
        Ok(Self {
            robot: simulated,
            engine,
            ground,
            controller,
            regions,
            control_period_s,
            pushes,
            record,
            snapshots,
        })
    }

    /// Time (s) at which a film can end. A plot ends at a fall, since COM and ZMP of a body on the ground tell nothing. A
    /// film goes on, and shows how the robot comes to lie.
    pub fn end_of_interest_s(&self) -> f64 {
        let aftermath_s = match self.record.fell_at_s {
            Some(_) => Self::AFTERMATH_S,
            None => 0.0,
        };
        self.record.end_of_interest_s() + aftermath_s
    }

    /// Distance from the origin beyond which the robot counts as flown off (m).
    pub fn farthest_m(&self) -> f64 {
        FARTHEST * self.robot.home_com_height()
    }

    /// The number of snapshots that can be shown: those before the robot has flown off or its numbers run away (beyond
    /// [`farthest_m`](Self::farthest_m), or with a joint beyond a full turn). It is at least 1 unless the film is
    /// empty.
    pub fn near(&self) -> usize {
        let farthest_m = self.farthest_m();
        let near = self.snapshots.iter().take_while(|snapshot| {
            let base = snapshot.posture.base.translation.vector;
            let far_m = [
                base.norm(),
                snapshot.com.coords.norm(),
                snapshot.dcm.coords.norm(),
            ];
            far_m.iter().all(|far| *far <= farthest_m)
                && snapshot.posture.q.iter().all(|q| q.abs() <= TAU)
        });
        near.count().max(1).min(self.snapshots.len())
    }

    /// Removes the snapshots after `end_s` (s).
    pub fn cut_at(mut self, end_s: f64) -> Self {
        self.snapshots.retain(|snapshot| snapshot.time_s <= end_s);
        self
    }
}
