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
    /// The trials of controller number `controller` that are worth a replay, each named once. `limit` is the push from which
    /// the robot recovers in half of the trials, in the unit of [`TrialColumns::hardness`]. First comes the easiest lost
    /// trial that another controller recovered from, then the lost trial nearest to the limit, then the hardest trial
    /// that was recovered from. The easiest lost trials come last.
    pub fn of(rows: &TrialColumns, controller: usize, limit: Option<f64>) -> Vec<Self> {
        let own = rows.of(controller);
        let hardness = |trial: usize| rows.hardness(controller, trial);
        let harder = |a: &usize, b: &usize| hardness(*a).total_cmp(&hardness(*b));
        let mut lost: Vec<usize> = (0..own.len())
            .filter(|&trial| !own[trial].has_recovered())
            .collect();
        lost.sort_by(harder);
        let mut picked = Vec::new();
        for &trial in &lost {
            let mut saviours = Vec::new();
            for (other, name) in rows.names.iter().enumerate() {
                let ended = rows.of(other).get(trial);
                if other != controller && ended.is_some_and(|ended| ended.has_recovered()) {
                    saviours.push(name.as_str());
                }
            }
            if !saviours.is_empty() {
                let saviours = listed(&saviours, "and");
                picked.push((trial, format!("lost; {saviours} recovered")));
                break;
            }
        }
        if let Some(limit) = limit {
            let from_limit = |trial: usize| (hardness(trial) - limit).abs();
            let nearest = lost
                .iter()
                .min_by(|a, b| from_limit(**a).total_cmp(&from_limit(**b)));
            if let Some(&trial) = nearest {
                picked.push((trial, "lost, nearest to its 50 % limit".into()));
            }
        }
        let hardest = (0..own.len())
            .filter(|&trial| own[trial].has_recovered())
            .max_by(harder);
        if let Some(trial) = hardest {
            picked.push((trial, "the hardest from which it recovered".into()));
        }
        for (i, &trial) in lost.iter().take(LOST).enumerate() {
            let why = if i == 0 {
                "the easiest that it lost"
            } else {
                "lost, though among the easiest"
            };
            picked.push((trial, why.into()));
        }
        let mut seen = HashSet::new();
        picked.retain(|(trial, _)| seen.insert(*trial));
        let mut telling = Vec::new();
        for (trial, why) in picked {
            telling.push(Self {
                trial: trial as u64,
                impulse_n_s: rows.impulse_n_s(trial),
                impulse_over_m_omega_d: own[trial].impulse_over_m_omega_d(),
                heading_deg: rows.heading_deg(trial),
                survived: own[trial].has_recovered(),
                why,
            });
        }
        telling
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
            for row in trial {
                row.impulse_over_m_omega_d = Some(ratio);
            }
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
