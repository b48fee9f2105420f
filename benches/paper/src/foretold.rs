//! How well the CPI sets foretell what the simulated robot does.
//!
//! A maximal CPI set holds every state from which its gain keeps the ZMP inside the support for ever (paper, eq. 9).
//! The slowest gain has the largest CPI set. By the theory the robot recovers if its true state at the end of the push
//! is inside this CPI set, and needs a footstep if it is outside. If the controller states a `zmp_disturbance`, the
//! robust CPI sets are used.

use serde::Serialize;
use standfast::core::error::Result;
use standfast::study::Folder;

/// Edges of the bins of the margin. A margin of 0 is on the border of the CPI set, and 1 is at rest at its centre. The
/// outer bins are open.
const MARGIN_EDGES: [f64; 6] = [-0.5, -0.25, 0.0, 0.25, 0.5, 0.75];

/// Trials whose state at the end of the push has a margin with `from <= margin < to`. An open end is None.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarginBin {
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub recovered: u64,
    pub trials: u64,
}

/// The trials of a controller in a result, by the margin. Trials that had ended before the end of the push are left out,
/// and so are bins without trials. It fails if a part of the result is missing or damaged.
pub fn by_margin(folder: &Folder, controller: &str) -> Result<Vec<MarginBin>> {
    let mut trials = Vec::new();
    for rows in folder.parts()? {
        let rows = rows?.into_iter().filter(|row| row.controller == controller);
        trials
            .extend(rows.filter_map(|row| Some((row.record.promise_margin?, row.has_recovered()))));
    }
    Ok(binned(&trials))
}

/// The bins of trials, each with its margin and whether the robot recovered.
fn binned(trials: &[(f64, bool)]) -> Vec<MarginBin> {
    let mut bins = Vec::new();
    for i in 0..=MARGIN_EDGES.len() {
        let from = i.checked_sub(1).map(|i| MARGIN_EDGES[i]);
        let to = MARGIN_EDGES.get(i).copied();
        let within = trials.iter().filter(|(margin, _)| {
            from.is_none_or(|from| *margin >= from) && to.is_none_or(|to| *margin < to)
        });
        let bin = MarginBin {
            from,
            to,
            recovered: within.clone().filter(|(_, recovered)| *recovered).count() as u64,
            trials: within.count() as u64,
        };
        if bin.trials > 0 {
            bins.push(bin);
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_in_one_bin_and_the_border_belongs_to_the_inside() {
        let bins = binned(&[
            (0.0, true),
            (0.8, true),
            (0.1, false),
            (-0.1, false),
            (-7.0, true),
            (f64::NEG_INFINITY, false),
        ]);
        let told: Vec<_> = bins
            .iter()
            .map(|bin| (bin.from, bin.to, bin.recovered, bin.trials))
            .collect();
        assert_eq!(
            told,
            [
                (None, Some(-0.5), 1, 2),
                (Some(-0.25), Some(0.0), 0, 1),
                (Some(0.0), Some(0.25), 1, 2),
                (Some(0.75), None, 1, 1)
            ]
        );
    }
}
