//! Tries each controller without a push, before any trial of a campaign runs.

use super::PreparedCampaign;
use crate::ask::trial;
use rayon::prelude::*;
use standfast_core::error::{Error, Result};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::unpushed::UnpushedEpisode;

impl PreparedCampaign {
    /// All controllers, ready to run. The first call prepares them, and runs an episode without a push with each. Fails if
    /// a robot falls in its episode, because recovery rates of a robot that falls without a push would mean nothing.
    /// `untried` leaves the episodes out.
    pub(crate) fn tried_factories(&self, untried: bool) -> Result<&[PreparedController]> {
        if let Some(tried) = self.tried.get() {
            return Ok(tried);
        }
        let factories = self.factories()?;
        if !untried && !self.manifest.campaign.synthetic {
            self.try_unpushed(&factories)?;
        }
        Ok(self.tried.get_or_init(|| factories))
    }

    /// Fails if the robot falls without a push with one of these controllers.
    fn try_unpushed(&self, factories: &[PreparedController]) -> Result<()> {
        let campaign = &self.manifest.campaign;
        let episodes: Vec<UnpushedEpisode> = factories
            .par_iter()
            .enumerate()
            .map(|(entrant, factory)| {
                UnpushedEpisode::run(
                    &self.robot,
                    factory,
                    &self.episode(entrant),
                    trial::as_designed(campaign),
                )
            })
            .collect::<Result<_>>()?;
        let mut falls = Vec::new();
        for (factory, episode) in factories.iter().zip(episodes) {
            if episode.is_lost() {
                falls.push(Error::Falls {
                    name: factory.name.clone(),
                    how: episode.how_lost(&self.robot),
                });
            }
        }
        Error::all(falls)
    }
}
