//! Compares two controllers on the same pushes: in which trials they end differently, and which is better.
//!
//! The better controller is the first of its pair. If neither is known to be better, the first is the one that recovers
//! more often, or the earlier one of two that recover equally often. This also holds for a comparison of two results,
//! where the names tell the controllers apart.
//!
//! Pairs are ordered by their verdicts: first the pairs in which one controller is better, then the pairs whose
//! controllers are the same, then the pairs that are not resolved. Within a verdict, the pair with the larger
//! difference comes first.

use crate::store::manifest::Manifest;
use crate::verdict::evidence::Evidence;
use crate::verdict::standing::PairDecision;
use crate::verdict::strata::Stratum;
use crate::verdict::trial_columns::{EpisodeEnd, TrialColumns};
use serde::Serialize;
use standfast_stats::decision::{ALPHA, Decision, PairVerdict, alpha_of_each, each_of};
use standfast_stats::kappa::kappa;
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::rate::{median, median_interval};
use std::cmp::Ordering;

/// Largest number of pairs that are all named in a text.
const FEW_PAIRS: usize = 6;
/// Largest number of trials that are named as examples.
const EXAMPLES: usize = 5;
/// Level of the intervals in strata.
const LEVEL: f64 = 0.95;
/// Chance with which the stated number of further trials would decide a pair.
const POWER: f64 = 0.8;

/// Two controllers on the trials that both have. Controller b is not known to be better than controller a.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairSummary {
    pub a: String,
    pub b: String,
    #[serde(flatten)]
    pub counts: PairedCounts,
    /// Number of trials from which only one of the two recovered.
    pub discordant: u64,
    /// Cohen's kappa of the two recoveries ([`kappa`]).
    pub kappa: Option<f64>,
    /// Rate of a less rate of b over the trials that both have (a share). It is negative only if a was found better at
    /// an earlier look of a campaign that ends when decided.
    pub difference: f64,
    /// Interval of the difference, at 95 % for all pairs of the result together. If the campaign could end when
    /// decided, it is the intersection of the intervals of all looks. It does not contain 0 exactly if a is better.
    pub adjusted_ci95: [f64; 2],
    /// Two-sided p-value of McNemar's test times the number of pairs. It is below 0.05 exactly if a is better. It is
    /// None if the campaign could end when decided, because the test is for a number of trials that was fixed in
    /// advance.
    pub adjusted_p: Option<f64>,
    pub verdict: PairVerdict,
    /// The verdict in sentences.
    pub words: String,
    /// About how many further trials would show the difference, if it is as large as observed. If the campaign ends
    /// when decided, these are further trials of this campaign. Otherwise they are the trials of a new campaign with
    /// another seed. It is None if the pair is decided, or if no difference was observed.
    pub more_trials: Option<u64>,
    /// How hard the soles land. None if no trial that both recovered from tells.
    pub landing: Option<PairLanding>,
    /// The first trials from which only a recovered, and the first trials from which only b recovered.
    pub first_only_a: Vec<u64>,
    pub first_only_b: Vec<u64>,
    pub strata: Vec<PairStratum>,
}

/// The largest forces on a sole of two controllers, over the trials from which both recovered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairLanding {
    pub trials: u64,
    /// Medians of a and of b (N).
    pub median_a_n: f64,
    pub median_b_n: f64,
    /// Median of the ratio, in the same trial, of the force of a to that of b, and its interval at 95 % for all pairs of
    /// the result together. It is None with few trials.
    pub ratio: f64,
    pub ratio_ci95: Option<[f64; 2]>,
}

impl PairLanding {
    fn new(
        rows: &TrialColumns,
        (a, b): (usize, usize),
        pairs: usize,
        at_every_look: bool,
    ) -> Option<Self> {
        let (mut of_a, mut of_b, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        for (a, b) in rows.common(a, b) {
            if let (true, true, Some(a_n), Some(b_n)) = (
                a.has_recovered(),
                b.has_recovered(),
                a.peak_sole_force_n(),
                b.peak_sole_force_n(),
            ) {
                of_a.push(a_n);
                of_b.push(b_n);
                ratios.push(a_n / b_n);
            }
        }
        ratios.sort_by(f64::total_cmp);
        Some(Self {
            trials: ratios.len() as u64,
            ratio_ci95: median_interval(&ratios, each_of(pairs, LEVEL), at_every_look),
            median_a_n: median(of_a)?,
            median_b_n: median(of_b)?,
            ratio: median(ratios)?,
        })
    }

    /// Which of a and b lands harder, in a sentence; empty if that is not known, if it is by less than a twentieth, or if
    /// its sole bears no more than the robot's weight, as when it stands on one foot.
    fn in_words(&self, a: &str, b: &str, weight_n: f64) -> String {
        let (name, ratio, [least, most]) = match self.ratio_ci95 {
            Some(ci) if ci[0] > 1.0 => (a, self.ratio, ci),
            Some([least, most]) if most < 1.0 => (b, 1.0 / self.ratio, [1.0 / most, 1.0 / least]),
            _ => return String::new(),
        };
        if ratio < 1.05 || self.median_a_n.max(self.median_b_n) <= weight_n {
            return String::new();
        }
        format!(
            " Where both recover, {name} lands {ratio:.1} times as hard ({least:.1} to {most:.1})."
        )
    }
}

/// Two controllers on the trials of one stratum. It shows where to look, and proves nothing, because its interval is
/// not adjusted for the number of strata.
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

impl PairStratum {
    fn new(rows: &TrialColumns, (a, b): (usize, usize), stratum: &Stratum) -> Self {
        let has_recovered = |controller: usize, trial: usize| {
            rows.of(controller)
                .get(trial)
                .map(EpisodeEnd::has_recovered)
        };
        let both = stratum
            .trials()
            .filter_map(|trial| Some((has_recovered(a, trial)?, has_recovered(b, trial)?)));
        let counts = PairedCounts::of(both);
        Self {
            by: stratum.by,
            label: stratum.label.clone(),
            trials: counts.trials(),
            counts,
            difference: counts.difference(),
            ci95: counts.difference_interval(LEVEL),
        }
    }
}

/// How a campaign decides between two controllers.
#[derive(Debug, Clone, Copy)]
pub struct DecisionRule {
    /// Whether the campaign ends when decided, or has a fixed number of trials.
    pub until_resolved: bool,
    /// Difference (a share) below which two controllers are the same.
    pub margin: f64,
    /// Whether more trials can be run. Those of a packed result cannot.
    pub has_more: bool,
    /// Weight of the robot (N).
    pub weight_n: f64,
}

impl DecisionRule {
    pub fn of(manifest: &Manifest) -> Self {
        let campaign = &manifest.campaign;
        Self {
            until_resolved: campaign.stopping.until_resolved,
            margin: campaign.stopping.margin,
            has_more: manifest.robot.is_none(),
            weight_n: campaign.units.weight_n(),
        }
    }
}

impl PairSummary {
    /// The comparisons of these pairs of controllers, ordered by their verdicts.
    pub fn all(
        rows: &TrialColumns,
        pairs: &[(usize, usize)],
        strata: &[Stratum],
        deciding: DecisionRule,
    ) -> Vec<Self> {
        let mut all: Vec<Self> = pairs
            .iter()
            .map(|&controllers| Self::new(rows, controllers, strata, pairs.len(), deciding))
            .collect();
        all.sort_by(|x, y| by_verdict((x.verdict, x.difference), (y.verdict, y.difference)));
        all
    }

    /// The comparison of two controllers, which is one of `pairs` comparisons.
    fn new(
        rows: &TrialColumns,
        controllers: (usize, usize),
        strata: &[Stratum],
        pairs: usize,
        DecisionRule {
            until_resolved,
            margin,
            has_more,
            weight_n,
        }: DecisionRule,
    ) -> Self {
        let standing = PairDecision::of(rows, controllers, pairs, until_resolved, margin);
        let PairDecision {
            a,
            b,
            counts,
            decision: Decision { ci95, p, verdict },
        } = standing;
        let first = |wins: usize, loses: usize| {
            (0..)
                .zip(rows.common(wins, loses))
                .filter(|(_, (won, lost))| won.has_recovered() && !lost.has_recovered())
                .take(EXAMPLES)
                .map(|(trial, _)| trial)
                .collect()
        };
        let more_trials = match (verdict, until_resolved) {
            _ if !has_more => None,
            (PairVerdict::Open, true) => {
                let level = each_of(pairs, 1.0 - ALPHA);
                Evidence::difference(&counts, level, true).more_trials(0.0, level)
            }
            (PairVerdict::Open, false) => {
                counts.trials_to_resolve(0.0, POWER, alpha_of_each(pairs))
            }
            _ => None,
        };
        let mut pair = Self {
            a: rows.names[a].clone(),
            b: rows.names[b].clone(),
            counts,
            discordant: counts.only_a + counts.only_b,
            kappa: kappa(&counts),
            difference: counts.difference(),
            adjusted_ci95: ci95,
            adjusted_p: p,
            verdict,
            words: String::new(),
            more_trials,
            landing: PairLanding::new(rows, (a, b), pairs, until_resolved),
            first_only_a: first(a, b),
            first_only_b: first(b, a),
            strata: strata
                .iter()
                .map(|stratum| PairStratum::new(rows, (a, b), stratum))
                .collect(),
        };
        pair.words = pair.in_words(margin);
        if let Some(landing) = &pair.landing {
            pair.words += &landing.in_words(&pair.a, &pair.b, weight_n);
        }
        pair
    }

    fn in_words(&self, margin: f64) -> String {
        let (a, b, [least, most]) = (&self.a, &self.b, self.adjusted_ci95.map(points));
        let p = self
            .adjusted_p
            .map_or(String::new(), |p| format!(", {}", p_value(p)));
        let interval = format!("({least} to {most}{p})");
        let difference = points(self.difference);
        let seen = match self.difference {
            0.0 => format!("No difference was seen {interval}."),
            _ => format!("{a} recovered {difference} points more often {interval}."),
        };
        match (self.verdict, self.more_trials) {
            (PairVerdict::Better, _) if self.difference <= 0.0 => {
                format!(
                    "{a} was found better than {b} by earlier trials {interval}, which stands; over all trials it recovered \
                     {} points less often.",
                    points(-self.difference)
                )
            }
            (PairVerdict::Better, _) => {
                format!("{a} is better than {b} by {difference} points {interval}.")
            }
            (PairVerdict::Same, _) => format!(
                "{a} and {b} differ by less than {} points. {seen}",
                points(margin)
            ),
            (PairVerdict::Open, None) => format!("{a} and {b}: not resolved. {seen}"),
            (PairVerdict::Open, Some(more)) => {
                let pushes = match self.adjusted_p {
                    Some(_) => format!(
                        "a new campaign with another seed and about {} trials",
                        rounded(more)
                    ),
                    None => format!("about {} more trials", rounded(more)),
                };
                format!(
                    "{a} and {b}: not resolved. {seen} If that is the true difference, {pushes} would show it."
                )
            }
        }
    }
}

/// Writes a difference (a share) in percentage points, with one digit after the point. A small difference that is not 0
/// has more digits, so that it does not look like 0.
pub(super) fn points(share: f64) -> String {
    let points = 100.0 * share;
    let digits = (1..6)
        .find(|&digits| points == 0.0 || points.abs() >= 0.5 * 10f64.powi(-digits))
        .unwrap_or(6);
    format!("{points:.*}", digits as usize)
}

/// The order of two pairs, each given by its verdict and its difference (a share).
pub fn by_verdict(x: (PairVerdict, f64), y: (PairVerdict, f64)) -> Ordering {
    x.0.cmp(&y.0).then(y.1.total_cmp(&x.1))
}

/// The numbers of the controllers that recover most often, in the order of `rates` (shares). Controllers may have
/// different trials. So they are ranked first by the number of other controllers that recover more often on the trials
/// that both have, and then by their rates. `behind` has for each pair the controller that recovers less often, if
/// there is one.
pub fn leaders(rates: &[f64], behind: impl IntoIterator<Item = usize>) -> Vec<usize> {
    let mut better = vec![0; rates.len()];
    for controller in behind {
        better[controller] += 1;
    }
    let rank = |a: usize, b: usize| {
        better[a]
            .cmp(&better[b])
            .then(rates[b].total_cmp(&rates[a]))
    };
    let Some(first) = (0..rates.len()).min_by(|&a, &b| rank(a, b)) else {
        return Vec::new();
    };
    (0..rates.len())
        .filter(|&controller| rank(controller, first).is_eq())
        .collect()
}

/// Whether a pair is named where there is little room. If there are many `pairs`, only those with the leader are named.
pub fn is_worth_a_line<T>(pairs: usize, is_leader: impl Fn(T) -> bool, (a, b): (T, T)) -> bool {
    pairs <= FEW_PAIRS || is_leader(a) || is_leader(b)
}

/// Writes a p-value. A large one has two digits. A small one has four, and is cut off instead of rounded, so that
/// 0.04998 does not become 0.05.
pub fn p_value(p: f64) -> String {
    match p {
        p if p < 1e-4 => "p < 0.0001".into(),
        p if p < 0.1 => format!("p = {:.4}", (1e4 * p + 1e-9).floor() / 1e4),
        p => format!("p = {p:.2}"),
    }
}

/// Rounds a guessed number up to two digits.
pub fn rounded(count: u64) -> u64 {
    let unit = 10u64.pow(count.max(1).ilog10().saturating_sub(1));
    count.div_ceil(unit) * unit
}

/// Every pair of `controllers` controllers, each with the earlier controller first.
pub fn every_pair(controllers: usize) -> Vec<(usize, usize)> {
    (0..controllers)
        .flat_map(|a| (a + 1..controllers).map(move |b| (a, b)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::row;
    use standfast_sim::episode::Outcome::{self, Fell, Recovered, TimedOut};

    const AT_ONCE: DecisionRule = DecisionRule {
        until_resolved: false,
        margin: 0.02,
        has_more: true,
        weight_n: 0.0,
    };

    const UNTIL_RESOLVED: DecisionRule = DecisionRule {
        until_resolved: true,
        ..AT_ONCE
    };

    /// The pair of the controllers "a" and "b".
    fn pair(outcomes: &[[Outcome; 2]], deciding: DecisionRule) -> PairSummary {
        PairSummary::all(
            &crate::fixtures::columns_of_outcomes(outcomes),
            &[(0, 1)],
            &[],
            deciding,
        )
        .remove(0)
    }

    /// Trials that are won by both, then trials that only a wins, then trials that only b wins.
    fn in_turn(both: usize, only_a: usize, only_b: usize) -> Vec<[Outcome; 2]> {
        [
            vec![[Recovered; 2]; both],
            vec![[Recovered, Fell]; only_a],
            vec![[Fell, Recovered]; only_b],
        ]
        .concat()
    }

    /// All pairs of the controllers `names`. A controller recovers from the trials for which `saved` is true.
    fn all_pairs(
        names: &[&str],
        saved: impl Fn(u64, usize) -> bool,
        deciding: DecisionRule,
    ) -> Vec<PairSummary> {
        let mut rows = Vec::new();
        for trial in 0..100 {
            for (controller, name) in names.iter().enumerate() {
                let outcome = if saved(trial, controller) {
                    Recovered
                } else {
                    Fell
                };
                rows.push(row(trial, name, 1.0, outcome));
            }
        }
        let pairs = every_pair(names.len());
        PairSummary::all(
            &crate::fixtures::columns_of_rows(&rows, names),
            &pairs,
            &[],
            deciding,
        )
    }

    #[test]
    fn a_pair_counts_every_trial_once_and_names_the_first_that_differ() {
        let mut outcomes = vec![[Recovered, Recovered], [Fell, TimedOut], [Fell, Recovered]];
        outcomes.extend([[Recovered, Fell]; 7]);
        let pair = pair(&outcomes, AT_ONCE);
        assert_eq!(
            pair.counts,
            PairedCounts {
                both: 1,
                only_a: 7,
                only_b: 1,
                neither: 1
            }
        );
        assert_eq!(
            (&pair.first_only_a[..], &pair.first_only_b[..]),
            (&[3, 4, 5, 6, 7][..], &[2][..])
        );
        assert_eq!(pair.difference, 0.6);
    }

    /// Only trials from which both recovered tell.
    #[test]
    fn a_controller_that_lands_harder_is_named() {
        let words = |trials: u64, share: f64, weight_n: f64| {
            let mut rows = Vec::new();
            for trial in 0..trials {
                for (name, times) in [("a", 1.0), ("b", share)] {
                    let outcome = if trial % 2 == 0 { Recovered } else { Fell };
                    let mut row = row(trial, name, 1.0, outcome);
                    let times = if outcome == Fell { 1.0 } else { times };
                    row.record.peak_sole_force_n = Some(times * (80.0 + trial as f64));
                    rows.push(row);
                }
            }
            let columns = crate::fixtures::columns_of_rows(&rows, &["a", "b"]);
            let deciding = DecisionRule {
                weight_n,
                ..AT_ONCE
            };
            PairSummary::all(&columns, &[(0, 1)], &[], deciding)
                .remove(0)
                .words
        };
        let ending = " Where both recover, b lands 2.0 times as hard (2.0 to 2.0).";
        let [of_b, of_a] = [2.0, 0.5].map(|share| words(20, share, 85.0));
        assert!(of_b.ends_with(ending), "{of_b}");
        assert!(of_a.contains(", a lands 2.0 times"), "{of_a}");
        for (trials, share, weight_n) in [
            (20, 1.0, 0.0),
            (20, 1.04, 0.0),
            (10, 2.0, 0.0),
            (20, 0.5, 95.0),
        ] {
            assert!(
                !words(trials, share, weight_n).contains("lands"),
                "{trials}, {share}"
            );
        }
    }

    #[test]
    fn a_verdict_is_what_the_trials_support() {
        use PairVerdict::{Better, Open, Same};
        for (counts, first, verdict, words) in [
            (
                [80, 18, 2],
                "a",
                Better,
                "a is better than b by 16.0 points (8.2 to 25.1, p = 0.0004).",
            ),
            // The better controller comes first.
            (
                [80, 2, 18],
                "b",
                Better,
                "b is better than a by 16.0 points (8.2 to 25.1, p = 0.0004).",
            ),
            (
                [95, 5, 0],
                "a",
                Open,
                "a and b: not resolved. a recovered 5.0 points more often (0.0 to 11.2, p = 0.0625). If that is the true \
                 difference, a new campaign with another seed and about 160 trials would show it.",
            ),
            (
                [98, 1, 1],
                "a",
                Open,
                "a and b: not resolved. No difference was seen (-4.6 to 4.6, p = 1.00).",
            ),
            (
                [998, 1, 1],
                "a",
                Same,
                "a and b differ by less than 2.0 points. No difference was seen (-0.5 to 0.5, p = 1.00).",
            ),
        ] {
            let found = pair(&in_turn(counts[0], counts[1], counts[2]), AT_ONCE);
            assert_eq!(
                (&found.a[..], found.verdict, &found.words[..]),
                (first, verdict, words)
            );
            assert_eq!(found.more_trials.is_some(), words.contains("would show it"));
        }
        let worse = pair(&in_turn(80, 2, 18), AT_ONCE);
        assert_eq!(
            (&worse.first_only_a[..2], &worse.first_only_b[..]),
            (&[82, 83][..], &[80, 81][..])
        );
    }

    /// Every hundred trials have the same number of each kind of trial.
    #[test]
    fn at_every_look_more_is_asked_for_than_once() {
        use PairVerdict::{Better, Open};
        for (trials, [only_a, only_b], deciding, verdict, words) in [
            (
                100,
                [9, 1],
                AT_ONCE,
                Better,
                "a is better than b by 8.0 points (",
            ),
            (100, [9, 1], UNTIL_RESOLVED, Open, "a and b: not resolved. "),
            (
                100,
                [18, 1],
                UNTIL_RESOLVED,
                Better,
                "a is better than b by 17.0 points (4.2 to 31.9).",
            ),
            (
                500,
                [12, 8],
                UNTIL_RESOLVED,
                Open,
                "a and b: not resolved. a recovered 4.0 points more often (",
            ),
        ] {
            let outcomes: Vec<_> = (0..trials)
                .map(|i| match i % 100 * 37 % 100 {
                    i if i < only_a => [Recovered, Fell],
                    i if i < only_a + only_b => [Fell, Recovered],
                    _ => [Recovered; 2],
                })
                .collect();
            let found = pair(&outcomes, deciding);
            assert_eq!(found.verdict, verdict, "{}", found.words);
            assert!(found.words.starts_with(words), "{}", found.words);
            if trials == 500 {
                let more = found.more_trials.unwrap();
                assert!((500..3000).contains(&more), "{more}");
                let told = format!("about {} more trials would show it.", rounded(more));
                assert!(found.words.ends_with(&told), "{}", found.words);
            }
        }
    }

    /// The words do not claim that a controller that is behind recovers more often.
    #[test]
    fn it_is_said_if_a_controller_that_was_found_better_falls_behind() {
        let found = pair(&in_turn(0, 25, 75), UNTIL_RESOLVED);
        assert_eq!((&found.a[..], found.difference), ("a", -0.5));
        let told = &found.words;
        assert!(
            told.starts_with("a was found better than b by earlier trials (")
                && told.ends_with("over all trials it recovered 50.0 points less often."),
            "{told}"
        );
    }

    #[test]
    fn an_end_of_an_interval_is_told_from_zero_and_a_p_from_what_is_asked() {
        let found = [0.0834, -0.02, 0.0, 0.0004, 0.0005, -0.0000712].map(points);
        assert_eq!(found, ["8.3", "-2.0", "0.0", "0.04", "0.1", "-0.01"]);
        let found = [0.76, 0.0625, 0.04998, 0.05, 0.0007, 1e-5].map(p_value);
        assert_eq!(
            found,
            [
                "p = 0.76",
                "p = 0.0625",
                "p = 0.0499",
                "p = 0.0500",
                "p = 0.0007",
                "p < 0.0001"
            ]
        );
    }

    #[test]
    fn pairs_are_ordered_by_their_verdicts() {
        // Each controller recovers from the first pushes, up to its number in `recovered`.
        let recovered = [50, 51, 90, 90, 45];
        let deciding = DecisionRule {
            margin: 0.09,
            ..AT_ONCE
        };
        let all = all_pairs(
            &["hold", "paper", "catch", "twin", "fixed"],
            |i, controller| i < recovered[controller],
            deciding,
        );
        let told: Vec<_> = all
            .iter()
            .map(|pair| format!("{} {} {:?}", pair.a, pair.b, pair.verdict))
            .collect();
        let expected = "catch fixed Better, twin fixed Better, catch hold Better, twin hold Better, catch paper Better, \
                        twin paper Better, catch twin Same, paper fixed Open, hold fixed Open, paper hold Open";
        assert_eq!(told.join(", "), expected);
    }

    /// A count of 8 : 1 has p = 0.039: enough for one pair, not for three.
    #[test]
    fn claims_are_adjusted_for_how_many_there_are() {
        let all = all_pairs(
            &["a", "b", "c"],
            |i, controller| {
                if controller == 1 {
                    i == 0 || i > 8
                } else {
                    i != 0
                }
            },
            AT_ONCE,
        );
        let open = all
            .iter()
            .find(|pair| (&pair.a[..], &pair.b[..]) == ("a", "b"))
            .unwrap();
        assert!(
            open.counts.mcnemar_p() < 0.05 && open.verdict == PairVerdict::Open,
            "{open:?}"
        );
        assert_eq!(open.adjusted_p, Some(3.0 * open.counts.mcnemar_p()));
    }
}
