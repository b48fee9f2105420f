//! Finds where the traces of two physics engines part: trials with different outcomes are simulated again in both
//! engines.

use crate::ask::spec::{Campaign, Overrides};
use crate::ask::trial;
use crate::plan::PreparedCampaign;
use crate::store::folder::Folder;
use crate::verdict::agreement::{Agreement, PartedTrial};
use rayon::prelude::*;
use standfast_core::error::{Error, Result};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::parting::{half_sole_width_m, parting};
use std::sync::atomic::{AtomicBool, Ordering};

/// The trials to be simulated again.
pub struct Partings<'a> {
    plans: [PreparedCampaign; 2],
    factories: Vec<PreparedController>,
    /// The distance beyond which two traces have parted (m).
    limit_m: f64,
    /// The trials, each with the number of its controller.
    trials: Vec<(usize, &'a mut PartedTrial)>,
}

impl<'a> Partings<'a> {
    /// Takes for each controller the first `most` trials on which the results of the two `folders` do not agree. It
    /// fails if an input is gone, or if the program lacks an engine.
    pub fn new(folders: [&Folder; 2], agreement: &'a mut Agreement, most: usize) -> Result<Self> {
        let plan = |folder: &Folder| {
            let file = folder.path.join("campaign.toml").display().to_string();
            PreparedCampaign::new(&Campaign::load(&file, &Overrides::default())?)
        };
        let plans = [plan(folders[0])?, plan(folders[1])?];
        let limit_m = half_sole_width_m(&plans[0].robot);
        agreement.part_beyond_m = Some(limit_m);
        let mut trials = Vec::new();
        for (set, agreement) in agreement.sets.iter_mut().enumerate() {
            for trial in agreement.parted.iter_mut().take(most) {
                trials.push((set, trial));
            }
        }
        let factories = plans[0].factories()?;
        Ok(Self {
            plans,
            factories,
            limit_m,
            trials,
        })
    }

    /// Number of trials.
    pub fn count(&self) -> u64 {
        self.trials.len() as u64
    }

    /// Simulates the trials on all cores, and notes where their traces part. Calls `on_trial` after each trial, from
    /// any thread. Fails if `stop` is set meanwhile.
    pub fn run(self, stop: &AtomicBool, on_trial: &(dyn Fn() + Sync)) -> Result<()> {
        let Self {
            plans,
            factories,
            limit_m,
            trials,
        } = self;
        let [in_a, in_b] = plans.each_ref().map(|plan| &plan.manifest.campaign);
        let robot = &plans[0].robot;
        trials.into_par_iter().try_for_each(|(set, parted)| {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            parted.parting = parting(
                robot,
                &factories[set],
                [&in_a.episode, &in_b.episode],
                || trial::disturbance(in_a, parted.trial),
                limit_m,
            )?;
            parted.traced = true;
            on_trial();
            Ok(())
        })
    }
}
