//! Picks the trials of a controller that are worth a replay: the easiest lost trial that another controller recovered
//! from, the lost trial nearest to the limit, the hardest trial that was recovered from, and the easiest lost trials.

use crate::verdict::listed::listed;
use crate::verdict::trial_columns::TrialColumns;
use serde::Serialize;
use std::collections::HashSet;

/// Largest number of easiest lost trials that are named.
const LOST: usize = 3;

/// A trial to replay, and the reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TellingTrial {
    pub trial: u64,
    pub impulse_n_s: f64,
    /// Impulse of the push over m omega d. A push of 1 is the hardest instantaneous push without a footstep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub impulse_over_m_omega_d: Option<f64>,
    pub heading_deg: f64,
    pub survived: bool,
    pub why: String,
}

impl TellingTrial {
    /// The trials of controller number `set` that are worth a replay, each named once. `limit` is the push from which
    /// the robot recovers in half of the trials, in the unit of [`TrialColumns::hardness`]. First comes the easiest lost
    /// trial that another controller recovered from, then the lost trial nearest to the limit, then the hardest trial
    /// that was recovered from. The easiest lost trials come last.
    pub fn of(rows: &TrialColumns, set: usize, limit: Option<f64>) -> Vec<Self> {
        let own = rows.of(set);
        let hardness = |trial: usize| rows.hardness(set, trial);
        let harder = |a: &usize, b: &usize| hardness(*a).total_cmp(&hardness(*b));
        let mut lost: Vec<usize> = (0..own.len())
            .filter(|&trial| !own[trial].has_recovered())
            .collect();
        lost.sort_by(harder);
        let from_limit =
            |trial: usize| limit.map_or(f64::INFINITY, |limit| (hardness(trial) - limit).abs());
        let nearest = lost
            .iter()
            .copied()
            .min_by(|a, b| from_limit(*a).total_cmp(&from_limit(*b)))
            .filter(|_| limit.is_some());
        let nearest = nearest.map(|trial| (trial, "lost, nearest to its 50 % limit".to_string()));
        let why = |i: usize| {
            if i == 0 {
                "the easiest that it lost"
            } else {
                "lost, though among the easiest"
            }
        };
        let saved = lost.iter().copied().find_map(|trial| {
            let others = (0..rows.names.len()).filter(|&other| other != set);
            let saviours = others.filter(|&other| {
                rows.of(other)
                    .get(trial)
                    .is_some_and(|of| of.has_recovered())
            });
            let saviours: Vec<&str> = saviours.map(|other| rows.names[other].as_str()).collect();
            (!saviours.is_empty()).then(|| {
                (
                    trial,
                    format!("lost; {} recovered", listed(&saviours, "and")),
                )
            })
        });
        let easiest = lost
            .into_iter()
            .take(LOST)
            .enumerate()
            .map(|(i, trial)| (trial, why(i).to_string()));
        let hardest = (0..own.len())
            .filter(|&trial| own[trial].has_recovered())
            .max_by(harder);
        let hardest =
            hardest.map(|trial| (trial, "the hardest from which it recovered".to_string()));
        let telling = |(trial, why): (usize, String)| Self {
            trial: trial as u64,
            impulse_n_s: rows.impulse_n_s(trial),
            impulse_over_m_omega_d: own[trial].impulse_over_m_omega_d(),
            heading_deg: rows.heading_deg(trial),
            survived: own[trial].has_recovered(),
            why,
        };
        let mut found: Vec<Self> = saved
            .into_iter()
            .chain(nearest)
            .chain(hardest)
            .chain(easiest)
            .map(telling)
            .collect();
        let mut seen = HashSet::new();
        found.retain(|telling| seen.insert(telling.trial));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::rows;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn what_tells_most_comes_first_and_each_trial_once() {
        let (lost, saved, won) = ([Fell, Fell], [Fell, Recovered], [Recovered, Fell]);
        let mut rows = rows(&[lost, saved, won, lost, won, saved]);
        for (trial, ratio) in rows.chunks_mut(2).zip([2.0, 9.0, 1.0, 0.5, 7.0, 3.0]) {
            trial
                .iter_mut()
                .for_each(|row| row.impulse_over_m_omega_d = Some(ratio));
        }
        let rows = crate::fixtures::columns_of_rows(&rows, &["a", "b"]);
        let [saved, nearest] = [
            (5, "lost; b recovered"),
            (1, "lost, nearest to its 50 % limit"),
        ];
        let [hardest, easiest] = [
            (4, "the hardest from which it recovered"),
            (3, "the easiest that it lost"),
        ];
        let among = (0, "lost, though among the easiest");
        for (limit, expected) in [
            (Some(8.4), vec![saved, nearest, hardest, easiest, among]),
            (None, vec![saved, hardest, easiest, among]),
        ] {
            let told = TellingTrial::of(&rows, 0, limit);
            let told: Vec<_> = told
                .iter()
                .map(|found| (found.trial, &found.why[..]))
                .collect();
            assert_eq!(told, expected);
        }
        assert!(
            TellingTrial::of(&crate::fixtures::columns_of_outcomes(&[]), 0, Some(1.0)).is_empty()
        );
    }
}
