//! Sums up the finished trials of a campaign while it runs: how often each controller has recovered, and which
//! controllers can be told apart. The intervals hold at every look, so a user may look at any time.

use crate::store::row::TrialRow;
use crate::verdict::pairs::{by_verdict, every_pair, is_worth_a_line, leaders};
use crate::verdict::standing::PairDecision;
use standfast_stats::decision::PairVerdict;
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::rate::SuccessCount;

/// Counts of the finished trials. The time to add a part does not grow with the number of parts before it.
pub struct SuccessTally {
    names: Vec<String>,
    trials: u64,
    /// Number of trials of each controller, and number of those trials from which it recovered.
    controllers: Vec<[u64; 2]>,
    /// Counts for the pairs of [`every_pair`], over the trials that both controllers have.
    pairs: Vec<PairedCounts>,
}

impl SuccessTally {
    /// A tally without trials. `names` are the controllers in the order of the campaign.
    pub fn new(names: &[String]) -> Self {
        let pairs = vec![PairedCounts::default(); every_pair(names.len()).len()];
        Self {
            names: names.to_vec(),
            trials: 0,
            controllers: vec![[0; 2]; names.len()],
            pairs,
        }
    }

    /// Counts more trials. `rows` are sorted by trial, and have all rows of each of their trials.
    pub fn add(&mut self, rows: &[TrialRow]) {
        let pairs = every_pair(self.names.len());
        for trial in rows.chunk_by(|a, b| a.trial == b.trial) {
            let mut recovered = Vec::new();
            for name in &self.names {
                let row = trial.iter().find(|row| row.controller == *name);
                recovered.push(row.map(TrialRow::has_recovered));
            }
            self.trials += 1;
            for ([trials, count], recovered) in self.controllers.iter_mut().zip(&recovered) {
                *trials += u64::from(recovered.is_some());
                *count += u64::from(*recovered == Some(true));
            }
            for (&(a, b), counts) in pairs.iter().zip(&mut self.pairs) {
                if let (Some(a), Some(b)) = (recovered[a], recovered[b]) {
                    counts.add(a, b);
                }
            }
        }
    }

    /// Whether no trial is finished.
    pub fn is_empty(&self) -> bool {
        self.trials == 0
    }
}

/// What follows from a [`SuccessTally`].
pub struct SoFar {
    /// Number of finished trials. A controller that was stopped earlier has fewer.
    pub trials: u64,
    /// Name and count of each controller, in the order of the campaign. The intervals hold at every look.
    pub controllers: Vec<(String, SuccessCount)>,
    /// The pairs, ordered by their verdicts.
    pub pairs: Vec<PairSoFar>,
}

/// Two controllers on the same trials. Which controller is a is decided as for a [`PairSummary`](super::pairs::PairSummary).
pub struct PairSoFar {
    pub a: String,
    pub b: String,
    /// Rate of a less rate of b (a share).
    pub difference: f64,
    /// Interval of the difference. It holds at 95 % for all pairs together and at every look.
    pub ci95: [f64; 2],
    pub verdict: PairVerdict,
}

impl SoFar {
    /// Controllers that differ by less than `margin` (a share) are the same.
    pub fn new(tally: &SuccessTally, margin: f64) -> Self {
        let SuccessTally { names, trials, .. } = tally;
        let mut controllers = Vec::new();
        for (name, &[trials, recovered]) in names.iter().zip(&tally.controllers) {
            let count = SuccessCount::new(recovered, trials).at_any_time();
            controllers.push((name.clone(), count));
        }
        let every = every_pair(controllers.len());
        let mut behind = Vec::new();
        for (&(a, b), counts) in every.iter().zip(&tally.pairs) {
            let difference = counts.difference();
            if difference != 0.0 {
                behind.push(if difference > 0.0 { b } else { a });
            }
        }
        let rates: Vec<f64> = controllers
            .iter()
            .map(|(_, count)| count.success_rate)
            .collect();
        let leader = leaders(&rates, behind).first().copied();
        let mut pairs = Vec::new();
        for (&pair, counts) in every.iter().zip(&tally.pairs) {
            if !is_worth_a_line(every.len(), |controller| Some(controller) == leader, pair) {
                continue;
            }
            let PairDecision {
                a,
                b,
                counts,
                decision,
                ..
            } = PairDecision::at_any_time(pair, *counts, every.len(), margin);
            pairs.push(PairSoFar {
                a: names[a].clone(),
                b: names[b].clone(),
                difference: counts.difference(),
                ci95: decision.ci95,
                verdict: decision.verdict,
            });
        }
        pairs.sort_by(|x, y| by_verdict((x.verdict, x.difference), (y.verdict, y.difference)));
        Self {
            trials: *trials,
            controllers,
            pairs,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixtures::row;
    use crate::fixtures::so_far;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn every_pair_of_few_controllers_and_those_with_the_best_of_many() {
        let pairs = |controllers: usize| {
            let found = so_far(controllers, 60, |controller| controller.to_string()).pairs;
            found
                .into_iter()
                .map(|pair| (pair.a, pair.b))
                .collect::<Vec<_>>()
        };
        assert_eq!(pairs(4).len(), 6);
        assert_eq!(
            pairs(5),
            ["0", "1", "2", "3"].map(|other| ("4".to_string(), other.to_string()))
        );
    }

    /// One of the controllers stops after the first part.
    #[test]
    fn a_tally_counts_each_part_once_and_pairs_over_their_common_trials() {
        let mut tally = SuccessTally::new(&["a", "b"].map(String::from));
        assert!(tally.is_empty());
        tally.add(
            &(0..25)
                .flat_map(|trial| [row(trial, "a", 1.0, Recovered), row(trial, "b", 1.0, Fell)])
                .collect::<Vec<_>>(),
        );
        tally.add(
            &(25..40)
                .map(|trial| row(trial, "a", 1.0, Recovered))
                .collect::<Vec<_>>(),
        );
        let found = SoFar::new(&tally, 0.02);
        assert_eq!(
            (
                found.trials,
                found.controllers[0].1.trials,
                found.controllers[1].1.trials
            ),
            (40, 40, 25)
        );
        let pair = &found.pairs[0];
        assert_eq!(
            (&pair.a[..], pair.difference, pair.verdict),
            ("a", 1.0, PairVerdict::Better)
        );
    }

    /// Because a user may look often, the intervals are wider than intervals for a fixed number of trials.
    #[test]
    fn it_may_be_looked_at_often() {
        let found = so_far(2, 300, |controller| controller.to_string());
        let (_, count) = &found.controllers[1];
        assert_eq!(
            (count.recovered, count.trials, found.trials),
            (200, 300, 300)
        );
        let fixed = SuccessCount::new(200, 300).ci95;
        assert!(
            count.ci95[0] < fixed[0] && fixed[1] < count.ci95[1],
            "{:?} {fixed:?}",
            count.ci95
        );
        let pair = &found.pairs[0];
        assert_eq!(
            (&pair.a[..], pair.verdict, pair.difference),
            ("1", PairVerdict::Better, 50.0 / 300.0)
        );
        assert_eq!(
            so_far(2, 10, |controller| controller.to_string()).pairs[0].verdict,
            PairVerdict::Open
        );
    }
}
