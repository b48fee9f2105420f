//! The rows of a campaign by gain set. A campaign that ends when decided stops running a set early once everything that
//! the set takes part in is decided, so sets may have different numbers of trials. Each has its first ones, without a
//! gap.

use crate::campaign::store::row::TrialRow;
use std::collections::HashMap;

/// The rows of each gain set, in the order of trials.
pub struct BySet<'a> {
    /// Names of the gain sets, in the order of the campaign.
    pub names: &'a [String],
    sets: Vec<Vec<&'a TrialRow>>,
}

impl<'a> BySet<'a> {
    /// Sorts `rows` by the sets that are named, and leaves out those of other sets. They must be in the order of
    /// trials, and each set must have its first trials without a gap.
    pub fn new(rows: &'a [TrialRow], names: &'a [String]) -> Self {
        let places: HashMap<&str, usize> = names.iter().enumerate().map(|(set, name)| (name.as_str(), set)).collect();
        let mut sets = vec![Vec::new(); names.len()];
        for row in rows {
            if let Some(&set) = places.get(row.set.as_str()) {
                sets[set].push(row);
            }
        }
        Self { names, sets }
    }

    /// The rows of set number `set`.
    pub fn of(&self, set: usize) -> &[&'a TrialRow] {
        &self.sets[set]
    }

    /// Of each trial that sets `a` and `b` both have, the rows of a and of b.
    pub fn common(&self, a: usize, b: usize) -> impl Iterator<Item = (&'a TrialRow, &'a TrialRow)> {
        self.sets[a].iter().copied().zip(self.sets[b].iter().copied())
    }

    /// A row of each trial, which tells what was drawn for it: that is the same for every set.
    pub fn drawn(&self) -> &[&'a TrialRow] {
        self.sets.iter().rev().max_by_key(|rows| rows.len()).map_or(&[], Vec::as_slice)
    }

    /// Number of trials of the campaign: that of the set that has most.
    pub fn trials(&self) -> u64 {
        self.drawn().len() as u64
    }
}
