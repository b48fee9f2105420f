//! Measures how long controllers take until the robot stands, and until it is home.
//!
//! The medians of two controllers are over different trials: a controller that survives harder pushes has more of the
//! slow ones. So there are also medians over the trials that all controllers survive.

use crate::verdict::trial_columns::{EpisodeEnd, TrialColumns};
use serde::Serialize;
use standfast_stats::rate::median;

/// Medians of the times from the end of the push, over trials that recovered.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Times {
    /// Median time until the robot stands, which means that the COM is slow and inside of the support (s).
    pub median_settling_s: Option<f64>,
    /// Median time until the COM is home to stay (s). A trial in which it does not come home counts as later than all
    /// others. It is None if the median is such a trial, and for episodes that end early.
    pub median_homing_s: Option<f64>,
    /// Number of trials in which the COM was home at the horizon. It is None for episodes that end early.
    pub home: Option<u64>,
}

impl Times {
    /// Times of the trials that recovered. Others are left out.
    pub fn of<'a>(trials: impl Iterator<Item = &'a EpisodeEnd> + Clone, end_early: bool) -> Self {
        let recovered = trials.filter(|ended| ended.has_recovered());
        let median_settling_s = median(
            recovered
                .clone()
                .filter_map(EpisodeEnd::settling_s)
                .collect(),
        );
        if end_early {
            return Self {
                median_settling_s,
                ..Self::default()
            };
        }
        let homing = recovered
            .clone()
            .map(|ended| ended.homing_s().unwrap_or(f64::INFINITY))
            .collect();
        Self {
            median_settling_s,
            median_homing_s: median(homing).filter(|s| s.is_finite()),
            home: Some(recovered.filter(|ended| ended.homing_s().is_some()).count() as u64),
        }
    }
}

/// Trials that every controller of the campaign survived, and each controller's times over them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CommonSurvivors {
    pub trials: u64,
    /// The times of each controller, in the order of the campaign.
    pub sets: Vec<Times>,
}

impl CommonSurvivors {
    /// `end_early` as for [`Times::of`].
    pub fn new(rows: &TrialColumns, end_early: bool) -> Self {
        let sets = 0..rows.names.len();
        let mut survived = Vec::new();
        for trial in 0..rows.drawn.trials() {
            let mut ends = sets.clone().map(|set| rows.of(set).get(trial));
            if ends.all(|ended| ended.is_some_and(EpisodeEnd::has_recovered)) {
                survived.push(trial);
            }
        }
        let mut times = Vec::new();
        for set in sets {
            let trials = survived.iter().map(|&trial| &rows.of(set)[trial]);
            times.push(Times::of(trials, end_early));
        }
        Self {
            trials: survived.len() as u64,
            sets: times,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::rows;
    use crate::store::row::TrialRow;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn common_times_leave_out_what_one_set_lost() {
        let mut rows = rows(&[
            [Recovered, Recovered],
            [Recovered, Fell],
            [Recovered, Recovered],
        ]);
        for (row, settled) in rows.iter_mut().zip([1.0, 2.0, 9.0, 9.0, 3.0, 4.0]) {
            row.record.settled_at_s = Some(row.push.start_s + row.push.duration_s + settled);
        }
        let rows = crate::fixtures::columns_of_rows(&rows, &["a", "b"]);
        let common = CommonSurvivors::new(&rows, true);
        assert_eq!((common.trials, common.sets[0].home), (2, None));
        let own = Times::of(rows.of(0).iter(), true);
        for (times, expected) in [(common.sets[0], 2.0), (common.sets[1], 3.0), (own, 3.0)] {
            assert!(
                (times.median_settling_s.unwrap() - expected).abs() < 1e-12,
                "{times:?}"
            );
        }
    }

    #[test]
    fn a_trial_that_never_gets_home_is_the_latest() {
        let mut rows = rows(&[[Recovered, Recovered]; 3]);
        let times = |rows: &[TrialRow]| {
            Times::of(
                crate::fixtures::columns_of_rows(rows, &["a"]).of(0).iter(),
                false,
            )
        };
        rows[0].record.home_at_s = None;
        assert_eq!(times(&rows).home, Some(2));
        assert!((times(&rows).median_homing_s.unwrap() - (1.75 - 0.55)).abs() < 1e-12);
        rows[2].record.home_at_s = None;
        assert_eq!(
            (times(&rows).home, times(&rows).median_homing_s),
            (Some(1), None)
        );
    }
}
