//! Two gain sets compared on the same pushes: where they end differently, and which is better.

use crate::campaign::store::row::{TrialRow, by_trial};
use crate::campaign::verdict::evidence::Evidence;
use crate::campaign::verdict::strata::Stratum;
use crate::stats::mcnemar::{PairedCounts, holm};
use crate::stats::ranks::{Shift, signed_rank};
use crate::stats::sequential::{self, PairVerdict, each_of};
use serde::Serialize;

/// How many trials are named as examples.
const EXAMPLES: usize = 5;
/// A difference is claimed if chance alone makes one as large less often than this; and the level of intervals.
const ALPHA: f64 = 0.05;
const LEVEL: f64 = 0.95;
/// With this chance the trials that are asked for would resolve a pair.
const POWER: f64 = 0.8;

/// Two sets, trial by trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    pub a: String,
    pub b: String,
    #[serde(flatten)]
    pub counts: PairedCounts,
    /// Rate of a less rate of b (a share).
    pub difference: f64,
    /// Of the difference: Tango's score interval or, where the campaign ended when decided, one that holds at every look
    /// (all pairs together with 95 %).
    pub ci95: [f64; 2],
    /// Exact, two-sided, for a count of trials that was fixed in advance.
    pub mcnemar_p: f64,
    /// The same, adjusted for the count of pairs (Holm).
    pub holm_p: f64,
    pub verdict: PairVerdict,
    /// The verdict in a sentence.
    pub words: String,
    /// About how many trials that are still to be run would tell sets apart that differ as these seem to: of this campaign
    /// if it ends when decided, else of a new one with another seed. None where they are told apart, or no difference
    /// was seen.
    pub more_trials: Option<u64>,
    /// The first trials that only one of them recovered from.
    pub first_only_a: Vec<u64>,
    pub first_only_b: Vec<u64>,
    /// Time to standing (s), a less b, over the trials that both recovered from.
    pub settling_s: Option<Shift>,
    /// Time to the COM being home for good (s), over trials in which it was with both; None for episodes that end early.
    pub homing_s: Option<Shift>,
    /// Footsteps that were finished, a less b, over the trials that both recovered from.
    pub footsteps: Option<Shift>,
    pub strata: Vec<PairStratum>,
}

/// Two sets over some of the trials. To look at, not to claim: nothing is adjusted for how many there are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairStratum {
    pub by: &'static str,
    pub label: String,
    pub trials: u64,
    #[serde(flatten)]
    pub counts: PairedCounts,
    pub difference: f64,
    pub ci95: [f64; 2],
}

/// How a campaign decides between two sets.
#[derive(Debug, Clone, Copy)]
pub struct DecisionRule {
    /// Whether it ended when decided.
    pub sequential: bool,
    /// Sets that differ by less than this share are the same.
    pub margin: f64,
    /// Whether episodes ended as soon as they had settled or fallen, so that nothing is known of getting home.
    pub end_early: bool,
}

impl Pair {
    /// Each pair of sets that is asked for; `rows` are sorted by trial, then by set in the order of `names`.
    pub fn all(
        rows: &[TrialRow],
        names: &[String],
        pairs: &[(usize, usize)],
        strata: &[Stratum],
        deciding: DecisionRule,
    ) -> Vec<Self> {
        let level = if deciding.sequential { each_of(pairs.len(), LEVEL) } else { LEVEL };
        let pair = |&(a, b): &(usize, usize)| Self::new(rows, names, (a, b), strata, level, deciding);
        let mut all: Vec<Self> = pairs.iter().map(pair).collect();
        let adjusted = holm(&all.iter().map(|pair| pair.mcnemar_p).collect::<Vec<_>>());
        for (pair, holm_p) in all.iter_mut().zip(adjusted) {
            pair.holm_p = holm_p;
            pair.decide(deciding, pairs.len());
        }
        all
    }

    fn new(
        rows: &[TrialRow],
        names: &[String],
        (a, b): (usize, usize),
        strata: &[Stratum],
        level: f64,
        deciding: DecisionRule,
    ) -> Self {
        let sets = names.len();
        let counts = counts(by_trial(rows, sets), a, b);
        let first = |wins: usize, loses: usize| {
            let only =
                by_trial(rows, sets).filter(|trial| trial[wins].has_recovered() && !trial[loses].has_recovered());
            only.take(EXAMPLES).map(|trial| trial[0].trial).collect()
        };
        let shift = |get: &dyn Fn(&TrialRow) -> Option<f64>| {
            let both = by_trial(rows, sets).filter(|trial| trial[a].has_recovered() && trial[b].has_recovered());
            let differences = both.filter_map(|trial| Some(get(&trial[a])? - get(&trial[b])?));
            signed_rank(&differences.collect::<Vec<_>>())
        };
        let stratum = |stratum: &Stratum| {
            let counts = self::counts(stratum.trials(rows, sets), a, b);
            let (by, label, trials) = (stratum.by, stratum.label.clone(), counts.trials());
            let (difference, ci95) = (counts.difference(), counts.difference_interval(LEVEL));
            PairStratum { by, label, trials, counts, difference, ci95 }
        };
        Self {
            a: names[a].clone(),
            b: names[b].clone(),
            counts,
            difference: counts.difference(),
            ci95: counts.interval(level, deciding.sequential),
            mcnemar_p: counts.mcnemar_p(),
            holm_p: 1.0,
            verdict: PairVerdict::Open,
            words: String::new(),
            more_trials: None,
            first_only_a: first(a, b),
            first_only_b: first(b, a),
            settling_s: shift(&TrialRow::settling_s),
            homing_s: if deciding.end_early { None } else { shift(&TrialRow::homing_s) },
            footsteps: shift(&|row| Some(row.footsteps.into())),
            strata: strata.iter().map(stratum).collect(),
        }
    }

    /// Which is better. At a fixed count of trials by the exact test, adjusted for all pairs; else by the interval. That
    /// they are the same, by an interval at a level adjusted for all pairs, for either.
    fn decide(&mut self, DecisionRule { sequential, margin, .. }: DecisionRule, pairs: usize) {
        let (counts, level) = (self.counts, each_of(pairs, LEVEL));
        self.verdict = match sequential::verdict(counts.interval(level, false), margin) {
            _ if sequential => at_a_look(counts, pairs, margin).1,
            PairVerdict::Same => PairVerdict::Same,
            _ if self.holm_p >= ALPHA => PairVerdict::Open,
            _ if self.difference > 0.0 => PairVerdict::ABetter,
            _ => PairVerdict::BBetter,
        };
        if self.verdict == PairVerdict::Open {
            self.more_trials = match sequential {
                true => Evidence::difference(&counts, level, true).more_trials(0.0, level),
                false => counts.trials_to_resolve(POWER, ALPHA / pairs as f64),
            };
        }
        self.words = self.verdict_in_words(margin, sequential);
    }

    fn verdict_in_words(&self, margin: f64, sequential: bool) -> String {
        let points = |share: f64| format!("{:.1}", 100.0 * share);
        let (a, b, [least, most]) = (&self.a, &self.b, self.ci95);
        let p = if sequential { String::new() } else { format!(", {}", p_value(self.holm_p)) };
        let seen = |by: f64, [least, most]: [f64; 2]| {
            format!("{} points ({} to {}{p})", points(by), points(least), points(most))
        };
        let better = |a: &str, b: &str, seen: String| format!("{a} is better than {b} by {seen}");
        let observed = seen(self.difference, self.ci95);
        match (self.verdict, self.more_trials) {
            (PairVerdict::ABetter, _) => better(a, b, observed),
            (PairVerdict::BBetter, _) => better(b, a, seen(-self.difference, [-most, -least])),
            (PairVerdict::Same, _) => format!(
                "{a} and {b} differ by less than {} points ({} to {})",
                points(margin),
                points(least),
                points(most)
            ),
            (PairVerdict::Open, Some(more)) if sequential => format!(
                "{a} and {b}: not resolved, {observed}; if that is what they differ by, about {} more trials would show it",
                rounded(more)
            ),
            (PairVerdict::Open, Some(more)) => format!(
                "{a} and {b}: not resolved, {observed}; if that is what they differ by, a new campaign of about {} pushes \
                 (another seed) would show it",
                rounded(more)
            ),
            (PairVerdict::Open, None) => format!("{a} and {b}: not resolved, no difference seen: {observed}"),
        }
    }
}

/// Interval and verdict of one of so many pairs, of which all hold together at every look.
pub fn at_a_look(counts: PairedCounts, pairs: usize, margin: f64) -> ([f64; 2], PairVerdict) {
    let interval = counts.interval(each_of(pairs, LEVEL), true);
    (interval, sequential::verdict(interval, margin))
}

/// A p-value as it is told: four digits are enough.
pub fn p_value(p: f64) -> String {
    if p < 1e-4 { "p < 0.0001".into() } else { format!("p = {p:.4}") }
}

/// Two digits are enough of a guess.
pub fn rounded(count: u64) -> u64 {
    let unit = 10u64.pow(count.max(1).ilog10().saturating_sub(1));
    count.div_ceil(unit) * unit
}

/// Who recovered, over trials that are the rows of all sets each.
pub fn counts<'a>(trials: impl Iterator<Item = &'a [TrialRow]>, a: usize, b: usize) -> PairedCounts {
    PairedCounts::of(trials.map(|trial| (trial[a].has_recovered(), trial[b].has_recovered())))
}

/// Every pair of so many sets, the earlier one first.
pub fn every_pair(sets: usize) -> Vec<(usize, usize)> {
    (0..sets).flat_map(|a| (a + 1..sets).map(move |b| (a, b))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::{row, rows};
    use crate::episode::Outcome::{self, Fell, Recovered, TimedOut};

    #[test]
    fn a_pair_counts_every_trial_once_and_names_the_first_that_differ() {
        let mut outcomes = vec![[Recovered, Recovered], [Fell, TimedOut], [Fell, Recovered]];
        outcomes.extend([[Recovered, Fell]; 7]);
        let pair = pair(&outcomes, AT_ONCE);
        assert_eq!(pair.counts, PairedCounts { both: 1, only_a: 7, only_b: 1, neither: 1 });
        assert_eq!((&pair.first_only_a[..], &pair.first_only_b[..]), (&[3, 4, 5, 6, 7][..], &[2][..]));
        assert_eq!(pair.difference, 0.6);
    }

    const AT_ONCE: DecisionRule = DecisionRule { sequential: false, margin: 0.02, end_early: true };

    /// Sets "a" and "b".
    fn pair(outcomes: &[[Outcome; 2]], deciding: DecisionRule) -> Pair {
        let names = ["a".to_string(), "b".to_string()];
        Pair::all(&rows(outcomes), &names, &[(0, 1)], &[], deciding).remove(0)
    }

    #[test]
    fn a_verdict_is_what_the_trials_support() {
        let outcomes = |both: usize, only_a: usize, only_b: usize| {
            let parts = [vec![[Recovered; 2]; both], vec![[Recovered, Fell]; only_a], vec![[Fell, Recovered]; only_b]];
            parts.concat()
        };
        let found = |counts: [usize; 3], deciding| pair(&outcomes(counts[0], counts[1], counts[2]), deciding);
        let better = found([80, 18, 2], AT_ONCE);
        assert_eq!((better.verdict, better.more_trials), (PairVerdict::ABetter, None));
        assert!(better.words.starts_with("a is better than b by 16.0 points ("), "{}", better.words);
        let worse = found([80, 2, 18], AT_ONCE);
        assert_eq!(worse.words, better.words.replace("a is better than b", "b is better than a"));
        // 5 : 0 has p = 0.0625.
        let open = found([95, 5, 0], AT_ONCE);
        assert_eq!(open.verdict, PairVerdict::Open);
        assert!(open.more_trials.is_some_and(|more| (100..300).contains(&more)), "{}", open.words);
        assert_eq!(found([98, 1, 1], AT_ONCE).verdict, PairVerdict::Open);
        assert_eq!(found([998, 1, 1], AT_ONCE).verdict, PairVerdict::Same);
        // At every look more is asked for than once.
        let at_every_look = DecisionRule { sequential: true, ..AT_ONCE };
        assert_eq!(found([90, 8, 1], AT_ONCE).verdict, PairVerdict::ABetter);
        assert_eq!(found([90, 8, 1], at_every_look).verdict, PairVerdict::Open);
        assert_eq!(found([80, 18, 1], at_every_look).verdict, PairVerdict::ABetter);
        // Nearly decided for a fixed count, but far from it at every look.
        let open = found([450, 66, 34], at_every_look);
        assert!(open.verdict == PairVerdict::Open && open.more_trials.is_some_and(|more| more > 100), "{}", open.words);
    }

    #[test]
    fn claims_are_adjusted_for_how_many_there_are() {
        // 8 : 1 has p = 0.039: enough for one pair, not for three.
        let mut rows = Vec::new();
        for i in 0..100 {
            let (a, b) = (i != 0, i == 0 || i > 8);
            let outcome = |recovered: bool| if recovered { Recovered } else { Fell };
            rows.extend([("a", a), ("b", b), ("c", a)].map(|(set, recovered)| row(i, set, 1.0, outcome(recovered))));
        }
        let names = ["a", "b", "c"].map(String::from);
        let all = Pair::all(&rows, &names, &[(0, 1), (0, 2), (1, 2)], &[], AT_ONCE);
        assert!(all[0].mcnemar_p < 0.05 && all[0].holm_p > 0.05 && all[0].verdict == PairVerdict::Open, "{:?}", all[0]);
    }

    #[test]
    fn times_are_compared_trial_by_trial_where_both_recover() {
        let mut rows = rows(&[[Recovered; 2]; 12]);
        rows.extend([row(12, "a", 1.0, Recovered), row(12, "b", 1.0, Fell)]);
        for row in rows.iter_mut().filter(|row| row.set == "b") {
            row.settled_at_s = row.settled_at_s.map(|s| s + 0.1 + 0.001 * row.trial as f64);
            row.footsteps = 1;
        }
        let names = ["a".to_string(), "b".to_string()];
        let pair = Pair::all(&rows, &names, &[(0, 1)], &[], AT_ONCE).remove(0);
        let (settling, footsteps) = (pair.settling_s.unwrap(), pair.footsteps.unwrap());
        assert_eq!((settling.pairs, footsteps.pairs, pair.homing_s), (12, 12, None));
        assert!((settling.median + 0.1055).abs() < 1e-9 && settling.p < 0.001, "{settling:?}");
        assert_eq!(footsteps.median, -1.0);
    }
}
