//! Counts outcomes by the number of footsteps, to show how often footsteps were taken and whether they helped.

use crate::verdict::trial_columns::{EpisodeEnd, success_count_of};
use serde::Serialize;
use standfast_stats::rate::SuccessCount;

/// The trials of one controller, by the number of footsteps that were begun.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ByFootsteps {
    /// Trials with no footstep, with one, with two, and with three or more.
    pub by_footsteps: [SuccessCount; 4],
}

impl ByFootsteps {
    /// It is None for a controller that took no footstep.
    pub fn new(trials: &[EpisodeEnd]) -> Option<Self> {
        let begun = |ended: &EpisodeEnd| ended.footsteps as usize + usize::from(ended.in_swing);
        if trials.iter().all(|ended| begun(ended) == 0) {
            return None;
        }
        Some(Self {
            by_footsteps: [0, 1, 2, 3]
                .map(|n| success_count_of(trials, |ended| begun(ended).min(3) == n)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Changed as _;
    use crate::fixtures::row;
    use standfast_core::robot::Foot::{Left, Right};
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn trials_are_counted_by_footsteps() {
        let rows = [
            (Recovered, 0, None),
            (Fell, 0, None),
            (Fell, 0, Some(Left)),
            (Recovered, 1, None),
            (Fell, 2, None),
            (Fell, 4, Some(Right)),
        ];
        let rows = rows.map(|(outcome, footsteps, in_the_air)| {
            EpisodeEnd::of(&row(0, "paper", 3.0, outcome).with(|row| {
                row.record.footsteps.count = footsteps;
                row.record.footsteps.unfinished_footstep = in_the_air;
            }))
        });
        let counts = ByFootsteps::new(&rows)
            .unwrap()
            .by_footsteps
            .map(|count| (count.recovered, count.trials));
        assert_eq!(counts, [(1, 2), (1, 2), (0, 1), (0, 1)]);
        assert_eq!(ByFootsteps::new(&rows[..2]), None, "a set that only stands");
    }
}
