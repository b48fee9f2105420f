//! Compares memberships with outcomes, to show how well the CPI sets predict what the simulated robot does.
//!
//! A maximal CPI set holds every state from which its gain keeps the ZMP inside the support for ever (paper, eq. 9).
//! The slowest gain has the largest CPI set. By the theory the robot recovers if its true state at the end of the push
//! is inside this CPI set, and needs a footstep if it is outside. If the controller states a `zmp_disturbance`, the
//! robust CPI sets are used.

use crate::verdict::trial_columns::{EpisodeEnd, success_count_of};
use serde::Serialize;
use standfast_sim::episode::Membership;
use standfast_stats::rate::SuccessCount;

/// Edges of the bins of the margin. A margin of 0 is on the border of the CPI set, and 1 is at rest at its centre. The
/// outer bins are open.
const MARGIN_EDGES: [f64; 6] = [-0.5, -0.25, 0.0, 0.25, 0.5, 0.75];

/// The trials of one controller, by where the state was at the end of the push. Trials that had ended before the end of
/// the push are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    pub inside: SuccessCount,
    /// Trials from outside of the CPI set, including trials with an empty CPI set.
    pub outside: SuccessCount,
    /// Share of trials that ended as predicted: the robot recovered from inside, or did not recover from outside.
    pub agreement: f64,
    /// Share of trials that ended as predicted from the estimated state, which is what the controller could know at
    /// that time.
    pub agreement_est: f64,
    /// Trials by margin. Bins without trials, and trials with an empty CPI set, are left out.
    pub by_margin: Vec<MarginBin>,
}

/// Trials with `from <= margin < to`. An open end is None.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarginBin {
    pub from: Option<f64>,
    pub to: Option<f64>,
    #[serde(flatten)]
    pub count: SuccessCount,
}

impl Prediction {
    /// It is None for a controller without feedback gains.
    pub fn new(all: &[EpisodeEnd]) -> Option<Self> {
        let [inside, outside] = [true, false].map(|is_inside| {
            success_count_of(all, |ended| {
                ended
                    .set_after_push
                    .is_some_and(|side| (side == Membership::Inside) == is_inside)
            })
        });
        let trials = inside.trials + outside.trials;
        if trials == 0 {
            return None;
        }
        let agreement =
            (inside.recovered + outside.trials - outside.recovered) as f64 / trials as f64;
        let known = all.iter().filter(|ended| ended.set_after_push.is_some());
        let as_estimated = known
            .filter(|ended| ended.is_inside_est == ended.has_recovered())
            .count();
        let agreement_est = as_estimated as f64 / trials as f64;
        let mut by_margin = Vec::new();
        for i in 0..=MARGIN_EDGES.len() {
            let from = i.checked_sub(1).map(|i| MARGIN_EDGES[i]);
            let to = MARGIN_EDGES.get(i).copied();
            let count = success_count_of(all, |ended| {
                ended.promise_margin().is_some_and(|margin| {
                    from.is_none_or(|from| margin >= from) && to.is_none_or(|to| margin < to)
                })
            });
            if count.trials > 0 {
                by_margin.push(MarginBin { from, to, count });
            }
        }
        Some(Self {
            inside,
            outside,
            agreement,
            agreement_est,
            by_margin,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Changed as _;
    use crate::fixtures::row;
    use standfast_sim::episode::Membership::{Empty, Inside, Outside};
    use standfast_sim::episode::Outcome::{self, Fell, Recovered};

    fn ended((side, margin, outcome): (Option<Membership>, Option<f64>, Outcome)) -> EpisodeEnd {
        let promise_margin = side.map(|_| margin.unwrap_or(f64::NEG_INFINITY));
        EpisodeEnd::of(&row(0, "a", 1.0, outcome).with(|row| {
            row.record.promise_margin = promise_margin;
            row.record.promise_margin_est = promise_margin.map(|margin| margin - 0.15);
        }))
    }

    #[test]
    fn every_trial_is_on_one_side_and_an_empty_set_holds_nothing() {
        let foretold = Prediction::new(
            &[
                (Some(Inside), Some(0.0), Recovered),
                (Some(Inside), Some(0.8), Recovered),
                (Some(Inside), Some(0.1), Fell),
                (Some(Outside), Some(-0.1), Fell),
                (Some(Outside), Some(-7.0), Recovered),
                (Some(Empty), None, Fell),
            ]
            .map(ended),
        )
        .unwrap();
        let counts =
            [foretold.inside, foretold.outside].map(|count| (count.trials, count.recovered));
        assert_eq!(counts, [(3, 2), (3, 1)]);
        // By the estimate the first state is outside, and so is the third, which fell.
        assert_eq!(
            (foretold.agreement, foretold.agreement_est),
            (4.0 / 6.0, 4.0 / 6.0)
        );
        let bins: Vec<_> = foretold
            .by_margin
            .iter()
            .map(|b| (b.from, b.to, b.count.trials))
            .collect();
        let expected = [
            (None, Some(-0.5), 1),
            (Some(-0.25), Some(0.0), 1),
            (Some(0.0), Some(0.25), 2),
            (Some(0.75), None, 1),
        ];
        assert_eq!(bins, expected);
        assert_eq!(
            Prediction::new(&[ended((None, None, Fell))]),
            None,
            "without gains nothing is foretold"
        );
    }
}
