//! Decides between two controllers on the same trials. The lines of a running campaign, its end and its result all use
//! this same decision.
//!
//! A betting interval contains the truth at all looks together with its confidence. So does the intersection of the
//! intervals of all looks, from which the verdicts are taken. A question that is decided at one look stays decided,
//! even if more trials are run because another question is still open.

use crate::verdict::trial_columns::TrialColumns;
use standfast_stats::decision::{ALPHA, Decision, alpha_of_each, each_of};
use standfast_stats::looks::Looks;
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::sign_test::first_decision;

/// The times at which a campaign may decide that one controller is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecisionTiming {
    /// Once, after a number of trials that was fixed in advance.
    Once,
    /// At any time and any number of times, by intervals alone.
    AnyTime,
    /// At each of these looks, by the exact test.
    At(Looks),
}

/// Two controllers on the trials that both have. Controller a is the better one. If neither is known to be better, a is
/// the one that recovers more often, or the first of two that recover equally often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairDecision {
    /// Numbers of the controllers in the campaign.
    pub a: usize,
    pub b: usize,
    pub counts: PairedCounts,
    pub decision: Decision,
    /// The number of trials at the look at which a was found better. Later trials may contradict this, and then the
    /// difference is not positive.
    pub better_after: Option<u64>,
}

impl PairDecision {
    /// Compares two controllers, given by their numbers, as one of `pairs` pairs. Controllers that differ by less than
    /// `margin` (a share) are the same.
    pub fn of(
        rows: &TrialColumns,
        sets: (usize, usize),
        pairs: usize,
        when: DecisionTiming,
        margin: f64,
    ) -> Self {
        let next = |trials: u64| match when {
            DecisionTiming::At(looks) => looks.after(trials),
            DecisionTiming::Once | DecisionTiming::AnyTime => u64::MAX,
        };
        let (mut counts, mut at_looks, mut look) = (PairedCounts::default(), Vec::new(), next(0));
        for (a, b) in rows.common(sets.0, sets.1) {
            counts.add(a.has_recovered(), b.has_recovered());
            if counts.trials() == look {
                at_looks.push(counts);
                look = next(look);
            }
        }
        Self::new(sets, counts, &at_looks, pairs, when, margin)
    }

    /// Compares two controllers at any time, from counts of trials in any order.
    pub fn at_any_time(
        sets: (usize, usize),
        counts: PairedCounts,
        pairs: usize,
        margin: f64,
    ) -> Self {
        Self::new(sets, counts, &[], pairs, DecisionTiming::AnyTime, margin)
    }

    fn new(
        (a, b): (usize, usize),
        counts: PairedCounts,
        at_looks: &[PairedCounts],
        pairs: usize,
        when: DecisionTiming,
        margin: f64,
    ) -> Self {
        let winner = match when {
            DecisionTiming::At(looks) => first_decision(at_looks, looks, alpha_of_each(pairs)),
            DecisionTiming::Once | DecisionTiming::AnyTime => None,
        };
        let a_is_first = winner.map_or(counts.only_a >= counts.only_b, |winner| winner.is_a);
        let ordered = |counts: PairedCounts| if a_is_first { counts } else { counts.swapped() };
        let (a, b) = if a_is_first { (a, b) } else { (b, a) };
        let betting =
            |counts: &PairedCounts| ordered(*counts).interval(each_of(pairs, 1.0 - ALPHA), true);
        let decision = match when {
            DecisionTiming::Once => Decision::once(&ordered(counts), pairs, margin),
            DecisionTiming::AnyTime => Decision::by_interval(betting(&counts), margin),
            DecisionTiming::At(_) => Decision::at_looks(
                narrowed(at_looks.iter().chain([&counts]).map(betting)),
                winner.is_some(),
                margin,
            ),
        };
        Self {
            a,
            b,
            counts: ordered(counts),
            decision,
            better_after: winner.map(|winner| winner.trials),
        }
    }
}

/// The intersection of the intervals of all looks, in their order. An interval that does not overlap the intersection
/// of the earlier ones is left out: at least one interval then misses the truth, and it cannot be known which one.
pub fn narrowed(intervals: impl IntoIterator<Item = [f64; 2]>) -> [f64; 2] {
    intervals.into_iter().fold(
        [f64::NEG_INFINITY, f64::INFINITY],
        |[low, high], [least, most]| {
            let common = [low.max(least), high.min(most)];
            if common[0] <= common[1] {
                common
            } else {
                [low, high]
            }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_sim::episode::Outcome::{self, Fell, Recovered};
    use standfast_stats::decision::PairVerdict;

    /// A look at 300 trials decides the pair. The later trials alone would leave it open.
    #[test]
    fn sets_that_were_found_to_be_the_same_stay_so() {
        let mut outcomes = vec![[Recovered; 2]; 300];
        let verdict = |outcomes: &[[Outcome; 2]]| {
            let rows = crate::fixtures::columns_of_outcomes(outcomes);
            PairDecision::of(
                &rows,
                (0, 1),
                1,
                DecisionTiming::At(Looks::up_to(100)),
                0.05,
            )
            .decision
            .verdict
        };
        assert_eq!(verdict(&outcomes), PairVerdict::Same);
        outcomes.extend([[Recovered, Fell], [Fell, Recovered]].repeat(50));
        assert_eq!(verdict(&outcomes), PairVerdict::Same);
        assert_eq!(verdict(&outcomes[300..]), PairVerdict::Open);
    }

    #[test]
    fn what_a_look_has_left_out_stays_out() {
        assert_eq!(narrowed([[-0.2, 0.4], [0.1, 0.5], [-0.1, 0.3]]), [0.1, 0.3]);
        assert_eq!(narrowed([[0.1, 0.5], [-0.2, 0.0], [0.2, 0.6]]), [0.2, 0.5]);
    }
}
