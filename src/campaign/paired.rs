//! Gain sets compared on the same pushes: where two of them end differently, and times over the trials that all survive.
//!
//! Each set's own median compares different trials: a set that survives harder pushes has more of the slow ones.

use crate::campaign::Row;
use crate::campaign::stats::median;
use crate::episode::Outcome;
use serde::Serialize;

/// How many trials are named as examples.
const EXAMPLES: usize = 5;

/// Medians of the times from the end of the push, over trials that recovered.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Times {
    /// To standing: slow and inside of the support (s).
    pub median_settling_s: Option<f64>,
    /// To the COM being home for good (s), where the trial that never is counts as the latest: None if the median is
    /// such a trial, and for episodes that end early.
    pub median_homing_s: Option<f64>,
    /// Trials in which the COM was home at the horizon; None for episodes that end early.
    pub home: Option<u64>,
}

impl Times {
    /// Of rows that recovered; others are left out.
    pub fn of<'a>(rows: impl Iterator<Item = &'a Row>, end_early: bool) -> Self {
        let rows: Vec<&Row> = rows.filter(|row| row.outcome == Outcome::Recovered).collect();
        let median_settling_s = median(rows.iter().filter_map(|row| row.settling_s()).collect());
        if end_early {
            return Self { median_settling_s, ..Self::default() };
        }
        let homing = rows.iter().map(|row| row.homing_s().unwrap_or(f64::INFINITY)).collect();
        Self {
            median_settling_s,
            median_homing_s: median(homing).filter(|s| s.is_finite()),
            home: Some(rows.iter().filter(|row| row.homing_s().is_some()).count() as u64),
        }
    }
}

/// Trials that every set of the campaign survived, and each set's times over them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Common {
    pub trials: u64,
    /// In the order of the sets.
    pub sets: Vec<Times>,
}

impl Common {
    /// `rows` are sorted by trial, then by set; `sets` is the count of sets.
    pub fn new(rows: &[Row], sets: usize, end_early: bool) -> Self {
        let survived: Vec<&[Row]> = trials(rows, sets).filter(|trial| trial.iter().all(has_recovered)).collect();
        Self {
            trials: survived.len() as u64,
            sets: (0..sets).map(|set| Times::of(survived.iter().map(|trial| &trial[set]), end_early)).collect(),
        }
    }
}

/// Two sets, trial by trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    pub sets: [String; 2],
    pub both_recovered: u64,
    pub neither_recovered: u64,
    /// Recovered with this set, not with the other; in the order of `sets`.
    pub only: [Only; 2],
}

/// Trials in which one set of a pair recovered and the other did not.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Only {
    pub trials: u64,
    /// Indices of the first few.
    pub examples: Vec<u64>,
}

impl Pair {
    /// Every pair of sets; `rows` are sorted by trial, then by set in the order of `names`.
    pub fn all(rows: &[Row], names: &[String]) -> Vec<Self> {
        let n = names.len();
        (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).map(|(a, b)| Self::new(rows, names, a, b)).collect()
    }

    fn new(rows: &[Row], names: &[String], a: usize, b: usize) -> Self {
        let mut pair = Self {
            sets: [names[a].clone(), names[b].clone()],
            both_recovered: 0,
            neither_recovered: 0,
            only: Default::default(),
        };
        for trial in trials(rows, names.len()) {
            let only = match (has_recovered(&trial[a]), has_recovered(&trial[b])) {
                (true, true) => {
                    pair.both_recovered += 1;
                    continue;
                }
                (false, false) => {
                    pair.neither_recovered += 1;
                    continue;
                }
                (true, false) => &mut pair.only[0],
                (false, true) => &mut pair.only[1],
            };
            only.trials += 1;
            if only.examples.len() < EXAMPLES {
                only.examples.push(trial[a].trial);
            }
        }
        pair
    }
}

/// The rows of each trial, one per set.
fn trials(rows: &[Row], sets: usize) -> impl Iterator<Item = &[Row]> {
    rows.chunks_exact(sets.max(1))
}

fn has_recovered(row: &Row) -> bool {
    row.outcome == Outcome::Recovered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::row::tests::row;
    use Outcome::{Fell, Recovered, TimedOut};

    /// A trial per pair of outcomes, of sets "a" and "b".
    fn rows(outcomes: &[[Outcome; 2]]) -> Vec<Row> {
        let trial = |(i, of): (usize, &[Outcome; 2])| [row(i as u64, "a", 1.0, of[0]), row(i as u64, "b", 1.0, of[1])];
        outcomes.iter().enumerate().flat_map(trial).collect()
    }

    #[test]
    fn a_pair_counts_every_trial_once_and_names_the_first_that_differ() {
        let mut outcomes = vec![[Recovered, Recovered], [Fell, TimedOut], [Fell, Recovered]];
        outcomes.extend([[Recovered, Fell]; 7]);
        let names = ["a".to_string(), "b".to_string()];
        let pairs = Pair::all(&rows(&outcomes), &names);
        assert_eq!(pairs.len(), 1);
        let Pair { both_recovered, neither_recovered, only, .. } = &pairs[0];
        assert_eq!((*both_recovered, *neither_recovered), (1, 1));
        assert_eq!(only[0], Only { trials: 7, examples: vec![3, 4, 5, 6, 7] });
        assert_eq!(only[1], Only { trials: 1, examples: vec![2] });
    }

    #[test]
    fn common_times_leave_out_what_one_set_lost() {
        let mut rows = rows(&[[Recovered, Recovered], [Recovered, Fell], [Recovered, Recovered]]);
        for (row, settled) in rows.iter_mut().zip([1.0, 2.0, 9.0, 9.0, 3.0, 4.0]) {
            row.settled_at_s = Some(row.start_s + row.duration_s + settled);
        }
        let common = Common::new(&rows, 2, true);
        assert_eq!(common.trials, 2);
        let median = |set: usize| common.sets[set].median_settling_s.unwrap();
        assert!((median(0) - 2.0).abs() < 1e-12 && (median(1) - 3.0).abs() < 1e-12);
        assert_eq!(common.sets[0].home, None);
        let own = Times::of(rows.iter().filter(|row| row.set == "a"), true);
        assert!((own.median_settling_s.unwrap() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_trial_that_never_gets_home_is_the_latest() {
        let mut rows = rows(&[[Recovered, Recovered]; 3]);
        rows[0].home_at_s = None;
        let times = |rows: &[Row]| Times::of(rows.iter().filter(|row| row.set == "a"), false);
        assert_eq!(times(&rows).home, Some(2));
        assert!((times(&rows).median_homing_s.unwrap() - (1.75 - 0.55)).abs() < 1e-12);
        rows[2].home_at_s = None;
        assert_eq!((times(&rows).home, times(&rows).median_homing_s), (Some(1), None));
    }
}
