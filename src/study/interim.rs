//! Looks at a campaign that ends when decided. After fixed numbers of trials, the gates are asked what is still open. A
//! controller stops if no open question needs more of its trials. The same parts always lead to the same decisions. So
//! neither the end of the campaign nor the trials of a controller depend on threads, shards or interruptions.

use crate::store::folder::Folder;
use crate::verdict::gates::{Gates, Open};
use crate::verdict::trial_columns::TrialColumns;
use standfast_core::error::Result;
use standfast_stats::looks::Looks;
use std::ops::Range;

/// The state of the looks at a campaign.
pub struct InterimLooks<'a> {
    folder: &'a Folder,
    gates: &'a Gates,
    planned: Looks,
    /// Number of trials at the last look.
    last: u64,
    /// Number of trials at the next look.
    pub next: u64,
    /// All trials up to the last look.
    rows: TrialColumns,
    /// Number of trials of each controller: the final one if it is decided, else the largest possible one.
    pub set_trials: Vec<u64>,
    /// Whether everything is decided, or there are no more trials.
    pub is_over: bool,
}

/// The findings of one look.
pub struct InterimLook<'a> {
    /// All trials so far.
    pub rows: &'a TrialColumns,
    /// The questions that are still open.
    pub open: &'a [Open],
    /// Names of the controllers that stop here while others continue, because no open question needs their trials.
    pub stopping: Vec<&'a str>,
    /// The largest number of trials that each controller may still reach.
    pub set_trials: &'a [u64],
}

impl<'a> InterimLooks<'a> {
    /// The state before the first look. It is None if the campaign has a fixed number of trials. `gates` state what the
    /// campaign has to decide.
    pub fn new(folder: &'a Folder, gates: &'a Gates) -> Option<Self> {
        let (planned, most) = (folder.manifest.looks()?, folder.manifest.campaign.trials);
        let set_trials = vec![most; folder.manifest.sets.len()];
        let next = planned.after(0).min(most);
        let rows = TrialColumns::new(&folder.manifest.sets, &folder.manifest.campaign.episode);
        Some(Self {
            folder,
            gates,
            planned,
            last: 0,
            next,
            rows,
            set_trials,
            is_over: false,
        })
    }

    /// Takes all looks for which there are enough trials.
    pub fn go_on(&mut self, on_look: &dyn Fn(&InterimLook)) -> Result<()> {
        let most = self.folder.manifest.campaign.trials;
        let sets = &self.folder.manifest.sets;
        while !self.is_over {
            let blocks = self.blocks(self.last..self.next);
            if blocks.clone().any(|block| self.lacks(block)) {
                return Ok(());
            }
            for block in blocks {
                self.rows
                    .push(&self.folder.rows_of(block..block + 1, &self.set_trials)?);
            }
            self.last = self.next;
            let open = self.gates.open(&self.rows);
            self.is_over = open.is_empty() || self.last == most;
            let mut stopping = Vec::new();
            for (set, trials) in self
                .set_trials
                .iter_mut()
                .enumerate()
                .filter(|(_, trials)| **trials > self.last)
            {
                if self.is_over || open.iter().all(|open| !open.sets.contains(&set)) {
                    *trials = self.last;
                    stopping.extend((!self.is_over).then_some(sets[set].as_str()));
                }
            }
            on_look(&InterimLook {
                rows: &self.rows,
                open: &open,
                stopping,
                set_trials: &self.set_trials,
            });
            self.next = self.planned.after(self.last).min(most);
        }
        Ok(())
    }

    /// The blocks that a shard has to run before the next look. If the shard lacks none of them, they are the blocks
    /// before the first later look for which it lacks any, so that the shard need not wait for the others. It is empty
    /// if the shard lacks no block.
    pub fn lacking(&self, is_own: impl Fn(u64) -> bool) -> Vec<u64> {
        let (mut from, mut to) = (self.last, self.next);
        while !self.is_over && from < to {
            let own = self
                .blocks(from..to)
                .filter(|&block| is_own(block) && self.lacks(block));
            let own: Vec<u64> = own.collect();
            if !own.is_empty() {
                return own;
            }
            (from, to) = (
                to,
                self.planned
                    .after(to)
                    .min(self.folder.manifest.campaign.trials),
            );
        }
        Vec::new()
    }

    fn lacks(&self, block: u64) -> bool {
        self.folder.lacks(block, &self.set_trials).contains(&true)
    }

    /// The blocks with these trials. The range must begin and end at the border of a block.
    fn blocks(&self, trials: Range<u64>) -> Range<u64> {
        let part_trials = self.folder.manifest.part_trials.get();
        trials.start / part_trials..trials.end.div_ceil(part_trials)
    }
}
