//! What the finished trials of a campaign say while it runs: how often each gain set has recovered, and which sets can be
//! told apart. It may be looked at as often as one likes, since its intervals hold at every look.

use crate::campaign::store::row::{TrialRow, by_trial, success_count};
use crate::campaign::verdict::pairs::{by_what_they_tell, every_pair};
use crate::campaign::verdict::standing::{Standing, When};
use crate::stats::decision::{Decision, PairVerdict};
use crate::stats::rate::SuccessCount;
use crate::stats::sequential::rate_interval;

/// Of more sets than this each is compared with the one that recovers most, not with every other.
const FEW: usize = 4;
/// Of the interval of a rate.
const LEVEL: f64 = 0.95;

/// Counts of trials that are finished with every set.
pub struct SoFar {
    pub trials: u64,
    /// In the order of the campaign. The intervals hold at every look.
    pub sets: Vec<(String, SuccessCount)>,
    /// In the order of what they tell.
    pub pairs: Vec<PairSoFar>,
}

/// Two sets on the same trials, in the order of a [`Pair`](super::pairs::Pair).
pub struct PairSoFar {
    pub a: String,
    pub b: String,
    /// Rate of a less rate of b (a share).
    pub difference: f64,
    /// All pairs together with 95 %, at every look.
    pub ci95: [f64; 2],
    pub verdict: PairVerdict,
}

impl SoFar {
    /// `rows` are those of whole trials, by set in the order of `names`. Sets that differ by less than `margin` (a share)
    /// are the same.
    pub fn of(rows: &[TrialRow], names: &[String], when: When, margin: f64) -> Self {
        let count = |set: usize| {
            let count = success_count(by_trial(rows, names.len()).map(|trial| &trial[set]));
            SuccessCount { ci95: rate_interval(count.recovered, count.trials, LEVEL), ..count }
        };
        let sets: Vec<(String, SuccessCount)> = names.iter().cloned().zip((0..names.len()).map(count)).collect();
        let recovered = |set: usize| sets[set].1.recovered;
        // The first of equals.
        let best = (0..sets.len()).rev().max_by_key(|&set| recovered(set)).unwrap_or_default();
        let every = every_pair(sets.len());
        let shown = every.iter().filter(|&&(a, b)| sets.len() <= FEW || a == best || b == best);
        let pair = |&sets: &(usize, usize)| {
            let Standing { a, b, counts, decision, .. } =
                Standing::of(rows, names.len(), sets, every.len(), when, margin);
            let Decision { ci95, verdict, .. } = decision;
            PairSoFar { a: names[a].clone(), b: names[b].clone(), difference: counts.difference(), ci95, verdict }
        };
        let mut pairs: Vec<PairSoFar> = shown.map(pair).collect();
        pairs.sort_by(|x, y| by_what_they_tell((x.verdict, x.difference), (y.verdict, y.difference)));
        Self { trials: (rows.len() / names.len().max(1)) as u64, sets, pairs }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::campaign::store::row::tests::row;
    use crate::episode::Outcome::{Fell, Recovered};

    /// Of so many trials and sets: set i recovers from all but every (i + 2)nd of them.
    pub(crate) fn so_far(sets: usize, trials: u64, name: impl Fn(usize) -> String) -> SoFar {
        let names: Vec<String> = (0..sets).map(name).collect();
        let outcome = |trial: u64, set: usize| if trial.is_multiple_of(set as u64 + 2) { Fell } else { Recovered };
        let rows = (0..trials).flat_map(|trial| {
            let row = move |(set, name): (usize, &String)| row(trial, name, 1.0, outcome(trial, set));
            names.iter().enumerate().map(row).collect::<Vec<_>>()
        });
        SoFar::of(&rows.collect::<Vec<_>>(), &names, When::AnyTime, 0.02)
    }

    #[test]
    fn every_pair_of_few_sets_and_those_with_the_best_of_many() {
        let pairs = |sets: usize| {
            let found = so_far(sets, 60, |set| set.to_string()).pairs;
            found.into_iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>()
        };
        assert_eq!(pairs(4).len(), 6);
        assert_eq!(pairs(5), ["0", "1", "2", "3"].map(|other| ("4".to_string(), other.to_string())));
    }

    /// At the same counts the intervals are wider than those for a fixed count of trials: one may look often.
    #[test]
    fn it_may_be_looked_at_often() {
        let found = so_far(2, 300, |set| set.to_string());
        let (_, count) = &found.sets[1];
        assert_eq!((count.recovered, count.trials, found.trials), (200, 300, 300));
        let fixed = SuccessCount::new(200, 300).ci95;
        assert!(count.ci95[0] < fixed[0] && fixed[1] < count.ci95[1], "{:?} {fixed:?}", count.ci95);
        let pair = &found.pairs[0];
        assert_eq!((&pair.a[..], pair.verdict, pair.difference), ("1", PairVerdict::Better, 50.0 / 300.0));
        assert_eq!(so_far(2, 10, |set| set.to_string()).pairs[0].verdict, PairVerdict::Open);
    }
}
