//! Decides between two controllers on the same trials. The lines of a running campaign, its end and its result all use
//! this same decision.

use crate::verdict::trial_columns::TrialColumns;
use standfast_stats::decision::{ALPHA, Decision, each_of};
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::sequential::{looks_until, narrowed};

/// Two controllers on the trials that both have. Controller a is the better one. If neither is known to be better, a is
/// the one that recovers more often, or the first of two that recover equally often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairDecision {
    /// Numbers of the controllers in the campaign.
    pub a: usize,
    pub b: usize,
    pub counts: PairedCounts,
    pub decision: Decision,
}

impl PairDecision {
    /// Compares two controllers, given by their numbers, as one of `pairs` pairs. The campaign ends when decided
    /// (`until_resolved`), or has a fixed number of trials. Controllers that differ by less than `margin` (a share) are
    /// the same.
    pub fn of(
        rows: &TrialColumns,
        controllers: (usize, usize),
        pairs: usize,
        until_resolved: bool,
        margin: f64,
    ) -> Self {
        let mut ends = rows.common(controllers.0, controllers.1);
        let trials = rows.common(controllers.0, controllers.1).count() as u64;
        let mut counts = PairedCounts::default();
        let mut count_up_to = |look: u64| {
            let more = ends.by_ref().take((look - counts.trials()) as usize);
            more.for_each(|(a, b)| counts.add(a.has_recovered(), b.has_recovered()));
            counts
        };
        if !until_resolved {
            let counts = count_up_to(trials);
            let a_is_first = counts.only_a >= counts.only_b;
            return Self::ordered(controllers, counts, a_is_first, |counts| {
                Decision::once(counts, pairs, margin)
            });
        }
        let intervals = looks_until(trials).map(|look| betting(&count_up_to(look), pairs));
        let interval = narrowed(intervals);
        Self::by_interval(controllers, counts, interval, margin)
    }

    /// Compares two controllers at any time, from counts of trials in any order.
    pub fn at_any_time(
        controllers: (usize, usize),
        counts: PairedCounts,
        pairs: usize,
        margin: f64,
    ) -> Self {
        Self::by_interval(controllers, counts, betting(&counts, pairs), margin)
    }

    fn by_interval(
        controllers: (usize, usize),
        counts: PairedCounts,
        [least, most]: [f64; 2],
        margin: f64,
    ) -> Self {
        // Later trials may contradict what an earlier look has decided.
        let is_tied_or_ahead = counts.only_a >= counts.only_b;
        let a_is_first = least > 0.0 || (is_tied_or_ahead && most >= 0.0);
        let interval = if a_is_first {
            [least, most]
        } else {
            [0.0 - most, 0.0 - least]
        };
        Self::ordered(controllers, counts, a_is_first, |_| {
            Decision::at_any_time(interval, margin)
        })
    }

    fn ordered(
        (a, b): (usize, usize),
        counts: PairedCounts,
        a_is_first: bool,
        decide: impl Fn(&PairedCounts) -> Decision,
    ) -> Self {
        let (a, b, counts) = if a_is_first {
            (a, b, counts)
        } else {
            (b, a, counts.swapped())
        };
        Self {
            a,
            b,
            counts,
            decision: decide(&counts),
        }
    }
}

/// The interval of the difference of one of `pairs` pairs that holds at any time, at 95 % for all pairs together.
fn betting(counts: &PairedCounts, pairs: usize) -> [f64; 2] {
    counts.interval(each_of(pairs, 1.0 - ALPHA), true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_sim::episode::Outcome::{self, Fell, Recovered};
    use standfast_stats::decision::PairVerdict;

    fn decided(outcomes: &[[Outcome; 2]]) -> PairDecision {
        let rows = crate::fixtures::columns_of_outcomes(outcomes);
        PairDecision::of(&rows, (0, 1), 1, true, 0.05)
    }

    /// A look at 300 trials decides the pair. The later trials alone would leave it open.
    #[test]
    fn what_a_look_has_decided_stays_decided() {
        let mut outcomes = vec![[Recovered; 2]; 300];
        let verdict = |outcomes: &[[Outcome; 2]]| decided(outcomes).decision.verdict;
        assert_eq!(verdict(&outcomes), PairVerdict::Same);
        outcomes.extend([[Recovered, Fell], [Fell, Recovered]].repeat(50));
        assert_eq!(verdict(&outcomes), PairVerdict::Same);
        assert_eq!(verdict(&outcomes[300..]), PairVerdict::Open);
    }

    /// The second controller is better by the first trials, and stays so although it falls behind.
    #[test]
    fn a_controller_that_was_found_better_stays_so() {
        let early = vec![[Fell, Recovered]; 25];
        for late in [0, 25, 75] {
            let all = [early.clone(), vec![[Recovered, Fell]; late]].concat();
            let found = decided(&all);
            assert_eq!((found.a, found.b, found.counts.only_b), (1, 0, late as u64));
            let Decision { ci95, p, verdict } = found.decision;
            assert!(ci95[0] > 0.0 && p.is_none() && verdict == PairVerdict::Better);
        }
    }
}
