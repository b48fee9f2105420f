//! The looks at a campaign that ends when decided: at fixed numbers of trials it is asked what is still open, and gain
//! sets of which nothing open takes trials stop. So neither the end nor the trials of a set depend on threads, shards,
//! or interruptions: whoever looks at the same parts finds the same.

use crate::campaign::store::folder::Folder;
use crate::campaign::verdict::digest::Digest;
use crate::campaign::verdict::gates::{Gates, Open};
use crate::error::Result;
use crate::stats::looks::Looks;
use std::ops::Range;

/// How far a campaign was looked at.
pub struct Looking<'a> {
    folder: &'a Folder,
    gates: &'a Gates,
    planned: Looks,
    /// Numbers of trials at the last look and at the next one.
    last: u64,
    pub next: u64,
    /// All trials up to the last look.
    rows: Digest,
    /// Number of trials of each gain set, as far as it is known.
    pub set_trials: Vec<u64>,
    /// Whether all is decided, or there are no more trials.
    pub is_over: bool,
}

/// What a look has found.
pub struct Look<'a> {
    /// All trials so far.
    pub rows: &'a Digest,
    /// What is still to be decided.
    pub open: &'a [Open],
    /// Names of the gain sets that stop here while others go on: nothing that is open takes their trials.
    pub stopping: Vec<&'a str>,
    /// Number of trials of each gain set from now on, at most.
    pub set_trials: &'a [u64],
}

impl<'a> Looking<'a> {
    /// Before the first look; None if the campaign has a fixed number of trials. `gates` say when it is decided.
    pub fn at(folder: &'a Folder, gates: &'a Gates) -> Option<Self> {
        let (planned, most) = (folder.manifest.looks()?, folder.manifest.campaign.trials);
        let set_trials = vec![most; folder.manifest.sets.len()];
        let next = planned.after(0).min(most);
        let rows = Digest::new(&folder.manifest.sets, &folder.manifest.campaign.episode);
        Some(Self { folder, gates, planned, last: 0, next, rows, set_trials, is_over: false })
    }

    /// Looks as often as there are trials for it.
    pub fn go_on(&mut self, on_look: &dyn Fn(&Look)) -> Result<()> {
        let (most, sets) = (self.folder.manifest.campaign.trials, &self.folder.manifest.sets);
        while !self.is_over {
            let blocks = self.blocks(self.last..self.next);
            if blocks.clone().any(|block| self.lacks(block)) {
                return Ok(());
            }
            for block in blocks {
                self.rows.push(&self.folder.rows_of(block..block + 1, &self.set_trials)?);
            }
            self.last = self.next;
            let open = self.gates.open(&self.rows);
            self.is_over = open.is_empty() || self.last == most;
            let mut stopping = Vec::new();
            for (set, trials) in self.set_trials.iter_mut().enumerate().filter(|(_, trials)| **trials > self.last) {
                if self.is_over || open.iter().all(|open| !open.sets.contains(&set)) {
                    *trials = self.last;
                    stopping.extend((!self.is_over).then_some(sets[set].as_str()));
                }
            }
            on_look(&Look { rows: &self.rows, open: &open, stopping, set_trials: &self.set_trials });
            self.next = self.planned.after(self.last).min(most);
        }
        Ok(())
    }

    /// The blocks that a shard lacks for the next look or, if it lacks none, for the first look after that for which it
    /// lacks any: it need not wait for the other shards. Empty if it lacks nothing.
    pub fn lacking(&self, is_own: impl Fn(u64) -> bool) -> Vec<u64> {
        let (mut from, mut to) = (self.last, self.next);
        while !self.is_over && from < to {
            let own = self.blocks(from..to).filter(|&block| is_own(block) && self.lacks(block));
            let own: Vec<u64> = own.collect();
            if !own.is_empty() {
                return own;
            }
            (from, to) = (to, self.planned.after(to).min(self.folder.manifest.campaign.trials));
        }
        Vec::new()
    }

    fn lacks(&self, block: u64) -> bool {
        self.folder.lacks(block, &self.set_trials).contains(&true)
    }

    /// The blocks with these trials, which begin and end with a block.
    fn blocks(&self, trials: Range<u64>) -> Range<u64> {
        let part_trials = self.folder.manifest.part_trials.get();
        trials.start / part_trials..trials.end.div_ceil(part_trials)
    }
}
