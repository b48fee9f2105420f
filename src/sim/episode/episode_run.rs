//! One controller on one robot, ready to run an episode.

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig};
use super::film::Film;
use super::record::Record;
use super::tick::Tick;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;

/// Robot, controller and settings of an episode.
#[derive(Clone, Copy)]
pub struct EpisodeRun<'a> {
    pub robot: &'a Robot,
    pub factory: &'a PreparedController,
    pub config: &'a EpisodeConfig,
}

impl EpisodeRun<'_> {
    /// Runs the episode until it is decided and for `aftermath_s` (s) after that, but not beyond its horizon. `observe`
    /// is called at every tick. Errors are those of [`ClosedLoop::finish`].
    pub fn record(
        &self,
        disturbance: Disturbance,
        aftermath_s: f64,
        observe: &mut dyn FnMut(&Tick),
    ) -> Result<Record> {
        let closed_loop = ClosedLoop::new(self.robot, [self.factory], self.config, disturbance);
        Ok(closed_loop
            .until(self.config.until(), aftermath_s)
            .watched(&mut |_, tick| observe(tick))?
            .remove(0))
    }

    /// Films the episode, for as long as [`Self::record`] runs it.
    pub fn film(
        &self,
        disturbance: Disturbance,
        aftermath_s: f64,
        observe: &mut dyn FnMut(&Tick),
    ) -> Result<Film> {
        let until = (self.config.until(), aftermath_s);
        Film::take(
            self.robot,
            self.factory,
            self.config,
            disturbance,
            until,
            observe,
        )
    }
}
