//! How two gain sets stand to each other on the same trials: the one place where a campaign decides between them, for its
//! lines while it runs, for its end, and for its result.

use crate::campaign::store::row::{TrialRow, by_trial};
use crate::stats::decision::{Decision, alpha_of_each};
use crate::stats::looks::Looks;
use crate::stats::mcnemar::PairedCounts;
use crate::stats::sign_test::first_decision;

/// When it may be decided that one set is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Once, after a count of trials that was fixed in advance.
    Once,
    /// At any time, as often as one likes, by intervals alone.
    AnyTime,
    /// At these looks, by the exact test.
    At(Looks),
}

/// Two sets, trial by trial. The better one is a; if neither is known to be better, the one that recovers more often, or
/// the first of two that recover equally often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Places in the campaign.
    pub a: usize,
    pub b: usize,
    pub counts: PairedCounts,
    pub decision: Decision,
    /// Count of trials at the look that found a better. Later ones may say otherwise: then the difference is not positive.
    pub better_after: Option<u64>,
}

impl Standing {
    /// Of two sets (places in the campaign), one of so many `pairs`. `rows` are those of whole trials, by set, of `sets` sets.
    /// Looks count as long as trials are there without a gap from the first on. Sets that differ by less than `margin` (a
    /// share) are the same.
    pub fn of(rows: &[TrialRow], sets: usize, (a, b): (usize, usize), pairs: usize, when: When, margin: f64) -> Self {
        let (counts, at_looks) = counts(rows, sets, (a, b), when);
        let winner = match when {
            When::At(looks) => first_decision(&at_looks, looks, alpha_of_each(pairs)),
            When::Once | When::AnyTime => None,
        };
        let a_is_first = winner.map_or(counts.only_a >= counts.only_b, |winner| winner.is_a);
        let (a, b, counts) = if a_is_first { (a, b, counts) } else { (b, a, counts.swapped()) };
        let decision = match when {
            When::Once => Decision::once(&counts, pairs, margin),
            When::AnyTime => Decision::at_any_time(&counts, pairs, margin),
            When::At(_) => Decision::at_looks(&counts, winner.is_some(), pairs, margin),
        };
        Self { a, b, counts, decision, better_after: winner.map(|winner| winner.trials) }
    }
}

/// Who recovered, in all trials and up to each look.
fn counts(rows: &[TrialRow], sets: usize, (a, b): (usize, usize), when: When) -> (PairedCounts, Vec<PairedCounts>) {
    let (mut counts, mut at_looks) = (PairedCounts::default(), Vec::new());
    let mut look = match when {
        When::At(looks) => Some((looks, looks.after(0))),
        When::Once | When::AnyTime => None,
    };
    for trial in by_trial(rows, sets) {
        look = look.filter(|_| trial[a].trial == counts.trials());
        counts.add(trial[a].has_recovered(), trial[b].has_recovered());
        if let Some((looks, next)) = &mut look
            && counts.trials() == *next
        {
            at_looks.push(counts);
            *next = looks.after(*next);
        }
    }
    (counts, at_looks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::rows;
    use crate::episode::Outcome::{Fell, Recovered};
    use crate::stats::decision::PairVerdict;

    /// Of a campaign with 100 planned trials, in which only the first set ever recovers.
    fn standing(rows: &[TrialRow]) -> Standing {
        Standing::of(rows, 2, (0, 1), 1, When::At(Looks::up_to(100)), 0.02)
    }

    #[test]
    fn looks_are_where_they_were_planned_and_need_all_trials_up_to_there() {
        let all = rows(&[[Recovered, Fell]; 60]);
        let found = standing(&all);
        assert_eq!((found.better_after, found.decision.verdict), (Some(25), PairVerdict::Better));
        assert_eq!(standing(&all[..48]).decision.verdict, PairVerdict::Open, "before the first look");
        // Trials that are there without those before them may be any: those that end soon.
        assert_eq!(standing(&all[2..]).better_after, None);
        let with_a_gap = [&all[..40], &all[42..]].concat();
        assert_eq!((standing(&with_a_gap).better_after, standing(&with_a_gap).counts.trials()), (None, 59));
        // It takes no look: the interval holds at any time.
        let by_intervals = Standing::of(&with_a_gap, 2, (0, 1), 1, When::AnyTime, 0.02);
        assert_eq!((by_intervals.decision.verdict, by_intervals.better_after), (PairVerdict::Better, None));
    }

    #[test]
    fn the_better_set_is_the_first_whichever_comes_first() {
        let rows = rows(&[[Recovered, Fell]; 60]);
        let (found, other) = (standing(&rows), Standing::of(&rows, 2, (1, 0), 1, When::At(Looks::up_to(100)), 0.02));
        assert_eq!(found, other);
        assert_eq!((found.a, found.counts.only_a), (0, 60));
    }
}
