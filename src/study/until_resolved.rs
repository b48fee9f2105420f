//! The end of a campaign that ends when decided. After fixed numbers of trials, the gates are asked what is still open,
//! and a controller stops if no open question needs more of its trials. The same parts always lead to the same
//! decisions. So neither the end of the campaign nor the trials of a controller depend on threads, shards or
//! interruptions.

use crate::store::folder::Folder;
use crate::verdict::gates::{Gates, Open};
use crate::verdict::trial_columns::TrialColumns;
use standfast_core::error::Result;
use standfast_stats::sequential::next_look;
use std::ops::Range;

/// How far a campaign that ends when decided is.
pub struct UntilResolved<'a> {
    folder: &'a Folder,
    gates: &'a Gates,
    /// All trials up to the last look.
    rows: TrialColumns,
    /// Number of trials of each controller: the final one if it is decided, else the largest possible one.
    pub controller_trials: Vec<u64>,
    /// Whether everything is decided, or there are no more trials.
    pub is_over: bool,
}

/// The findings of one look.
pub struct Look<'a> {
    /// All trials so far.
    pub rows: &'a TrialColumns,
    /// The questions that are still open.
    pub open: &'a [Open],
    /// Names of the controllers that stop here while others continue, because no open question needs their trials.
    pub stopping: Vec<&'a str>,
    /// The largest number of trials that each controller may still reach.
    pub controller_trials: &'a [u64],
}

impl<'a> UntilResolved<'a> {
    /// The state before the first look. It is None if the campaign has a fixed number of trials. `gates` state what the
    /// campaign has to decide.
    pub fn new(folder: &'a Folder, gates: &'a Gates) -> Option<Self> {
        let (campaign, controllers) = (&folder.manifest.campaign, &folder.manifest.controllers);
        campaign.stopping.until_resolved.then(|| Self {
            folder,
            gates,
            rows: TrialColumns::new(controllers, &campaign.episode),
            controller_trials: vec![campaign.trials; controllers.len()],
            is_over: false,
        })
    }

    /// Takes all looks for which there are enough trials.
    pub fn go_on(&mut self, on_look: &dyn Fn(&Look)) -> Result<()> {
        let controllers = &self.folder.manifest.controllers;
        while !self.is_over {
            let blocks = self.blocks_to_look(self.rows.trials());
            if blocks.clone().any(|block| self.lacks(block)) {
                return Ok(());
            }
            for block in blocks {
                self.rows.push(
                    &self
                        .folder
                        .rows_of(block..block + 1, &self.controller_trials)?,
                );
            }
            let trials = self.rows.trials();
            let open = self.gates.open(&self.rows);
            self.is_over = open.is_empty() || trials == self.most();
            let mut stopping = Vec::new();
            for (controller, of_controller) in self.controller_trials.iter_mut().enumerate() {
                let needs_more = !self.is_over
                    && open
                        .iter()
                        .any(|open| open.controllers.contains(&controller));
                if *of_controller > trials && !needs_more {
                    *of_controller = trials;
                    stopping.extend((!self.is_over).then_some(controllers[controller].as_str()));
                }
            }
            on_look(&Look {
                rows: &self.rows,
                open: &open,
                stopping,
                controller_trials: &self.controller_trials,
            });
        }
        Ok(())
    }

    /// The blocks that a shard has to run before the next look. If the shard lacks none of them, they are the blocks
    /// before the first later look for which it lacks any, so that the shard need not wait for the others. It is empty
    /// if the shard lacks no block.
    pub fn lacking(&self, is_own: impl Fn(u64) -> bool) -> Vec<u64> {
        let mut from = self.rows.trials();
        while !self.is_over && from < self.most() {
            let own = self
                .blocks_to_look(from)
                .filter(|&block| is_own(block) && self.lacks(block));
            let own: Vec<u64> = own.collect();
            if !own.is_empty() {
                return own;
            }
            from = next_look(from);
        }
        Vec::new()
    }

    fn most(&self) -> u64 {
        self.folder.manifest.campaign.trials
    }

    fn lacks(&self, block: u64) -> bool {
        self.folder
            .lacks(block, &self.controller_trials)
            .contains(&true)
    }

    /// The blocks with the trials from `from`, which is a look, to the next look.
    fn blocks_to_look(&self, from: u64) -> Range<u64> {
        let part_trials = self.folder.manifest.part_trials.get();
        let to = next_look(from).min(self.most());
        from / part_trials..to.div_ceil(part_trials)
    }
}
