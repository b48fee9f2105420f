//! The largest recoverable impulse by heading, beside what the pendulum allows ([`crate::lipm::capture`]).
//!
//! For each gain set and heading a [psychometric search](crate::stats::psychometric) finds the impulse of 50 % recovery.
//! Each of its trials is a trial of the campaign in everything but the push's impulse and heading. Trial k at a heading is
//! the same disturbance for every gain set, so that sets are compared on the same robot, noise and variations. Searches
//! run side by side and know nothing of each other: the result does not depend on the count of threads.

mod search;
mod yardstick;

use crate::campaign::ask::bounds::in_range;
use crate::campaign::ask::spec::Campaign;
use crate::campaign::limit::search::{Search, is_random};
use crate::campaign::run::{Plan, pool};
use crate::control::Design;
use crate::error::Result;
use crate::stats::psychometric::Rule;
use rayon::ThreadPool;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

pub use search::SetLimit;
pub use yardstick::{Heading, ReachM, Yardstick};

/// Between the first trials of two headings. Part of what a seed means.
const TRIALS_APART: u64 = 1 << 20;
/// Most headings, and most trials of one search.
pub const MOST_HEADINGS: usize = 360;
pub const MOST_TRIALS: u64 = 100_000;
/// Impulses are looked for up to this multiple of the bound with any number of footsteps.
const BEYOND_THE_BOUND: f64 = 3.0;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct LimitOptions {
    /// Headings from 0, evenly spaced.
    pub headings: usize,
    /// Half width of the 95 % interval at which a search ends (N s),
    pub precision_n_s: f64,
    /// or after so many trials.
    pub max_trials: u64,
    /// 0: one per core.
    pub threads: usize,
}

/// Searches to run, with all that they need: one for each gain set and heading.
pub struct Searches<'a> {
    campaign: &'a Campaign,
    options: LimitOptions,
    plan: Plan,
    yardstick: Yardstick,
    headings: Vec<Heading>,
    pool: ThreadPool,
    designs: Vec<Design>,
}

/// The result. Lengths in the control frame: origin midway between the soles' centres, x forward, y left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    pub campaign: String,
    pub robot: String,
    pub seed: u64,
    pub precision_n_s: f64,
    pub max_trials: u64,
    /// Whether trials differ in anything but the impulse.
    pub random: bool,
    /// Episodes in all.
    pub episodes: u64,
    #[serde(flatten)]
    pub yardstick: Yardstick,
    pub headings: Vec<Heading>,
}

impl<'a> Searches<'a> {
    /// Reads and designs, and runs nothing. Errors: a wrong option or input, or a robot whose reach is not known.
    pub fn new(campaign: &'a Campaign, options: LimitOptions) -> Result<Self> {
        check(&options)?;
        let plan = Plan::new(campaign)?;
        let yardstick = Yardstick::new(&plan.robot, campaign)?;
        let heading = |i: usize| yardstick.heading(360.0 * i as f64 / options.headings as f64);
        let headings = (0..options.headings).map(heading).collect::<Result<_>>()?;
        let pool = pool(options.threads)?;
        let designs = pool.install(|| plan.designs())?;
        Ok(Self { campaign, options, plan, yardstick, headings, pool, designs })
    }

    pub fn count(&self) -> u64 {
        (self.headings.len() * self.designs.len()) as u64
    }

    /// Runs all of them; `on_episode` is called after each episode, `on_search` after each search, from any thread. Errors:
    /// `stop` was set from outside.
    pub fn run(
        self,
        stop: &AtomicBool,
        on_episode: &(dyn Fn() + Sync),
        on_search: &(dyn Fn() + Sync),
    ) -> Result<Limits> {
        let Self { campaign, options, plan, yardstick, mut headings, pool, designs } = self;
        let sets = &plan.manifest.sets;
        let random = is_random(campaign);
        let jobs: Vec<(usize, usize)> =
            (0..headings.len()).flat_map(|h| (0..sets.len()).map(move |s| (h, s))).collect();
        let search = |&(h, s): &(usize, usize)| {
            let heading: &Heading = &headings[h];
            let rule = Rule {
                most_n_s: (BEYOND_THE_BOUND * heading.bound_n_step_n_s).max(10.0 * options.precision_n_s),
                precision_n_s: options.precision_n_s,
                max_trials: options.max_trials,
                random,
            };
            let search = Search {
                campaign,
                robot: &plan.robot,
                heading_deg: heading.heading_deg,
                bound_one_step_n_s: heading.bound_one_step_n_s,
                first_trial: h as u64 * TRIALS_APART,
                stop,
                on_episode,
            };
            let limit = search.run(&sets[s], &designs[s], rule)?;
            on_search();
            Ok(limit)
        };
        // One by one, so that no core is left with several searches at the end.
        let found = pool.install(|| jobs.par_iter().with_max_len(1).map(search).collect::<Result<Vec<SetLimit>>>())?;
        let mut found = found.into_iter();
        headings.iter_mut().for_each(|heading| heading.sets = found.by_ref().take(sets.len()).collect());
        Ok(Limits {
            campaign: campaign.name.clone(),
            robot: campaign.robot.clone(),
            seed: campaign.seed,
            precision_n_s: options.precision_n_s,
            max_trials: options.max_trials,
            random,
            episodes: headings.iter().flat_map(|heading| &heading.sets).map(|set| set.trials).sum(),
            yardstick,
            headings,
        })
    }
}

fn check(options: &LimitOptions) -> Result<()> {
    in_range("arguments", "--headings", options.headings as f64, [1.0, MOST_HEADINGS as f64])?;
    in_range("arguments", "--precision", options.precision_n_s, [0.005, 100.0])?;
    in_range("arguments", "--max-trials", options.max_trials as f64, [1.0, MOST_TRIALS as f64])
}
