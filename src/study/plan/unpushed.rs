//! Tries each controller without a push, before any trial of a campaign runs.

use super::PreparedCampaign;
use crate::ask::trial;
use rayon::prelude::*;
use standfast_core::error::{Error, Result};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::unpushed::UnpushedEpisode;

impl PreparedCampaign {
    /// Prepares all controllers, and runs an episode without a push with each. Fails if a robot falls in its episode,
    /// because recovery rates of a robot that falls without a push would mean nothing. `untried` leaves the episodes
    /// out.
    pub(crate) fn tried_factories(&self, untried: bool) -> Result<Vec<PreparedController>> {
        let (factories, campaign) = (self.factories()?, &self.manifest.campaign);
        if untried || campaign.synthetic {
            return Ok(factories);
        }
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
        Error::all(falls)?;
        Ok(factories)
    }
}
