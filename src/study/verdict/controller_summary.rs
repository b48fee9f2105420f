//! Sums up the trials of one controller: from how many it recovered, by impulse, and how it lost the others.

use crate::verdict::failures::{Failures, FallCause};
use crate::verdict::strata::Stratum;
use crate::verdict::telling_trials::TellingTrial;
use crate::verdict::trial_columns::{
    Counted, EpisodeEnd, TrialColumns, success_count, success_count_of,
};
use serde::Serialize;
use standfast_sim::episode::Outcome;
use standfast_stats::curve::{NoCurve, Pushes, SuccessCurve};
use standfast_stats::rate::{SuccessCount, median};

/// Largest number of trials to which a curve is fitted as they are. With more trials, the impulses are rounded.
const MANY: usize = 2500;
const CURVE_POINTS: usize = 41;

/// The results of one controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControllerSummary {
    pub name: String,
    pub origin: ControllerOrigin,
    #[serde(flatten)]
    pub count: SuccessCount,
    /// Number of trials in which the robot had not fallen at the end, whether it stood or not.
    pub survived: SuccessCount,
    pub fell: u64,
    pub broke: u64,
    pub diverged: u64,
    pub failed: u64,
    pub timed_out: u64,
    /// Trials in which the push found the COM faster than a robot that counts as standing.
    pub moving_at_push: u64,
    /// Number of trials that were run twice to see whether the controller repeats, and number of those trials that did
    /// not.
    pub run_twice: u64,
    pub not_repeated: u64,
    /// Median time from the end of the last push until the robot stands, which means that the COM is slow and inside of
    /// the support (s), over the trials from which this controller recovered.
    pub median_settling_s: Option<f64>,
    /// Median time until the COM is home to stay (s). A trial in which it does not come home counts as later than all
    /// others. It is None if the median is such a trial, and for episodes that end early.
    pub median_homing_s: Option<f64>,
    /// Median of the largest force on a sole (N) over the trials from which this controller recovered.
    pub median_sole_force_n: Option<f64>,
    /// Number of recovered trials in which the COM was home at the horizon. It is None for episodes that end early.
    pub home: Option<u64>,
    /// Outcomes of the trials with no footstep begun, with one, with two, and with three or more. It is None for a
    /// controller that took no footstep.
    pub by_footsteps: Option<[SuccessCount; 4]>,
    /// How trials were lost.
    pub failures: Failures,
    pub fall_causes: Vec<FallCause>,
    /// Success by impulse, in bins of equal width. All controllers have the same bins. Bins without any trial are left
    /// out.
    pub by_impulse: Vec<ImpulseBin>,
    /// The impulses (N s) with 50 % and with 90 % recovery, by a fitted curve.
    pub curve: FittedCurve,
    /// The fitted curve over the impulse as a multiple of m omega d, by which robots of different sizes can be
    /// compared.
    pub normalized_curve: FittedCurve,
    pub strata: Vec<ControllerStratum>,
    pub telling: Vec<TellingTrial>,
}

/// Where a controller's trials can be replayed from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControllerOrigin {
    /// Path of the campaign file, relative to the folder of the result; or the name of a packed result.
    pub campaign: String,
    /// Name of the controller in that campaign.
    pub controller: String,
    /// Whether the result is packed, so that nothing of it can be replayed.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_packed: bool,
}

impl ControllerOrigin {
    /// The origin of a controller of the result's own campaign.
    pub fn own(controller: &str) -> Self {
        Self {
            campaign: "campaign.toml".into(),
            controller: controller.into(),
            is_packed: false,
        }
    }
}

/// A curve of success against impulse or, if it cannot be fitted, the reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedCurve {
    #[serde(flatten)]
    pub fit: Option<SuccessCurve>,
    pub none_because: Option<NoCurve>,
    /// Points of the curve for a picture, over the range of the impulses.
    pub points: Vec<CurvePoint>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Impulse, in the unit of the curve.
    pub x: f64,
    pub chance: f64,
    pub ci95: [f64; 2],
}

impl FittedCurve {
    fn through(trials: Vec<(f64, bool)>) -> Self {
        let pushes = Pushes::new(&pooled(trials));
        let fit = match pushes.curve() {
            Ok(fit) => fit,
            Err(why) => {
                return Self {
                    fit: None,
                    none_because: Some(why),
                    points: Vec::new(),
                };
            }
        };
        let [from, to] = fit.range;
        let mut points = Vec::new();
        for i in 0..CURVE_POINTS {
            let x = from + (to - from) * i as f64 / (CURVE_POINTS - 1) as f64;
            points.push(CurvePoint {
                x,
                chance: fit.chance(x),
                ci95: pushes.band(x),
            });
        }
        Self {
            fit: Some(fit),
            none_because: None,
            points,
        }
    }
}

/// Rounds impulses to one of [`MANY`] values if there are more than [`MANY`] trials, because a fit takes time for each
/// different impulse. An impulse changes by at most 0.02 % of the range.
fn pooled(mut trials: Vec<(f64, bool)>) -> Vec<(f64, bool)> {
    let ends = trials
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], (x, _)| {
            [a.min(*x), b.max(*x)]
        });
    let unit = (ends[1] - ends[0]) / MANY as f64;
    if trials.len() > MANY && unit != 0.0 {
        for (x, _) in &mut trials {
            *x = ends[0] + unit * ((*x - ends[0]) / unit).round();
        }
    }
    trials
}

/// The trials of a controller that are in one stratum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControllerStratum {
    pub by: &'static str,
    pub label: String,
    #[serde(flatten)]
    pub count: SuccessCount,
}

/// Trials with `from_n_s <= impulse < to_n_s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImpulseBin {
    pub from_n_s: f64,
    pub to_n_s: f64,
    #[serde(flatten)]
    pub count: SuccessCount,
}

impl ControllerSummary {
    /// Sums up controller number `controller`. `bins` are the edges of bins of impulse (N s), and `strata` are the strata of
    /// the campaign. If the campaign ends when decided (`until_resolved`), the interval of the rate holds at any time.
    pub(super) fn new(
        controller: usize,
        all: &TrialColumns,
        bins: &[f64],
        strata: &[Stratum],
        until_resolved: bool,
    ) -> Self {
        let (name, trials) = (&all.names[controller], all.of(controller));
        let of_all = |count: u64| match SuccessCount::new(count, trials.len() as u64) {
            count if until_resolved => count.at_any_time(),
            count => count,
        };
        let Counted {
            failures,
            fall_causes,
            moving_at_push,
            run_twice,
            not_repeated,
        } = all.counted(controller);
        let with = |outcome| {
            trials
                .iter()
                .filter(|ended| ended.outcome == outcome)
                .count() as u64
        };
        let survived = [Outcome::Recovered, Outcome::Survived, Outcome::TimedOut]
            .map(with)
            .iter()
            .sum();
        let recovered: Vec<&EpisodeEnd> = trials
            .iter()
            .filter(|ended| ended.has_recovered())
            .collect();
        let settling = recovered.iter().filter_map(|ended| ended.settling_s());
        let forces = recovered
            .iter()
            .filter_map(|ended| ended.peak_sole_force_n());
        let homing = || recovered.iter().map(|ended| ended.homing_s());
        let begun = |ended: &EpisodeEnd| ended.footsteps as usize + usize::from(ended.in_swing);
        let steps = trials.iter().any(|ended| begun(ended) > 0);
        let by_footsteps =
            [0, 1, 2, 3].map(|n| success_count_of(trials, |ended| begun(ended).min(3) == n));
        let mut by_impulse = Vec::new();
        for bin in bins.windows(2) {
            let (from_n_s, to_n_s) = (bin[0], bin[1]);
            let is_within = |trial: &usize| (from_n_s..to_n_s).contains(&all.impulse_n_s(*trial));
            if (0..all.drawn.trials()).any(|trial| is_within(&trial)) {
                let within = (0..trials.len()).filter(is_within);
                by_impulse.push(ImpulseBin {
                    from_n_s,
                    to_n_s,
                    count: success_count(within.map(|trial| &trials[trial])),
                });
            }
        }
        let mut in_strata = Vec::new();
        for stratum in strata {
            let ended = stratum.trials().filter_map(|trial| trials.get(trial));
            in_strata.push(ControllerStratum {
                by: stratum.by,
                label: stratum.label.clone(),
                count: success_count(ended),
            });
        }
        let over = |impulse: &dyn Fn(usize, &EpisodeEnd) -> Option<f64>| {
            let trials = trials.iter().enumerate();
            let trials = trials
                .filter_map(|(trial, ended)| Some((impulse(trial, ended)?, ended.has_recovered())));
            FittedCurve::through(trials.collect())
        };
        let curve = over(&|trial, _| Some(all.impulse_n_s(trial)));
        let normalized_curve = over(&|_, ended| ended.impulse_over_m_omega_d());
        let limit = normalized_curve.fit.or(curve.fit).map(|fit| fit.x50);
        Self {
            name: name.clone(),
            origin: ControllerOrigin::own(name),
            count: of_all(recovered.len() as u64),
            survived: of_all(survived),
            fell: with(Outcome::Fell),
            broke: with(Outcome::Broke),
            diverged: with(Outcome::Diverged),
            failed: with(Outcome::Failed),
            timed_out: with(Outcome::TimedOut),
            moving_at_push: *moving_at_push,
            run_twice: *run_twice,
            not_repeated: *not_repeated,
            median_settling_s: median(settling.collect()),
            median_sole_force_n: median(forces.collect()),
            median_homing_s: (!all.end_early)
                .then(|| median(homing().map(|s| s.unwrap_or(f64::INFINITY)).collect()))
                .flatten()
                .filter(|s| s.is_finite()),
            home: (!all.end_early).then(|| homing().flatten().count() as u64),
            by_footsteps: steps.then_some(by_footsteps),
            fall_causes: FallCause::most_frequent_first(fall_causes),
            by_impulse,
            curve,
            normalized_curve,
            strata: in_strata,
            telling: TellingTrial::of(all, controller, limit),
            failures: *failures,
        }
    }
}

/// Edges of about eight bins of a round width (1, 2, 2.5 or 5 times a power of ten) that cover the values.
pub(super) fn bin_edges(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
        (a.min(x), b.max(x))
    });
    let span = most - least;
    if !span.is_finite() {
        return Vec::new();
    }
    if span == 0.0 {
        // All pushes are the same, so there is one bin around them.
        return vec![(least - 0.5).max(0.0), most + 0.5];
    }
    let decade = 10f64.powi((span / 8.0).log10().floor() as i32);
    let width = [1.0, 2.0, 2.5, 5.0, 10.0]
        .map(|m| m * decade)
        .into_iter()
        .find(|w| span / w <= 8.5)
        .unwrap_or(span);
    let first = (least / width).floor() as i64;
    let last = (most / width).floor() as i64;
    (first..=last + 1).map(|i| i as f64 * width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{Changed as _, columns_of_rows, row, rows};
    use crate::store::row::TrialRow;
    use standfast_core::robot::Foot::{Left, Right};
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    fn summed_up(rows: &[TrialRow], end_early: bool) -> ControllerSummary {
        let mut columns = columns_of_rows(rows, &["a"]);
        columns.end_early = end_early;
        ControllerSummary::new(0, &columns, &[], &[], false)
    }

    #[test]
    fn a_trial_that_never_gets_home_is_the_latest() {
        let mut rows = rows(&[[Recovered, Recovered]; 3]);
        let home = |rows: &[TrialRow]| {
            let told = summed_up(rows, false);
            (told.home, told.median_homing_s)
        };
        rows[0].record.home_at_s = None;
        let (count, median_s) = home(&rows);
        assert!(count == Some(2) && (median_s.unwrap() - (1.75 - 0.55)).abs() < 1e-12);
        assert_eq!(summed_up(&rows, true).home, None);
        rows[2].record.home_at_s = None;
        assert_eq!(home(&rows), (Some(1), None));
    }

    #[test]
    fn trials_are_counted_by_footsteps() {
        let rows: Vec<TrialRow> = [
            (Recovered, 0, None),
            (Fell, 0, None),
            (Fell, 0, Some(Left)),
            (Recovered, 1, None),
            (Fell, 2, None),
            (Fell, 4, Some(Right)),
        ]
        .into_iter()
        .zip(0..)
        .map(|((outcome, footsteps, in_the_air), trial)| {
            row(trial, "a", 3.0, outcome).with(|row| {
                row.record.footsteps.count = footsteps;
                row.record.footsteps.unfinished_footstep = in_the_air;
            })
        })
        .collect();
        let counts = summed_up(&rows, true).by_footsteps.unwrap();
        let counts = counts.map(|count| (count.recovered, count.trials));
        assert_eq!(counts, [(1, 2), (1, 2), (0, 1), (0, 1)]);
        assert_eq!(
            summed_up(&rows[..2], true).by_footsteps,
            None,
            "a controller that only stands"
        );
    }

    #[test]
    fn bins_are_round_and_hold_every_value() {
        assert_eq!(
            bin_edges([0.51, 4.49].into_iter()),
            [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5]
        );
        assert_eq!(bin_edges([2.0, 2.0].into_iter()), [1.5, 2.5]);
        assert!(bin_edges([].into_iter()).is_empty());
        for most in [0.001, 0.3, 1.0, 7.7, 4e4] {
            let edges = bin_edges([0.0, most].into_iter());
            assert!(
                edges[0] <= 0.0 && most < edges[edges.len() - 1] && edges.len() <= 11,
                "{edges:?}"
            );
        }
    }
}
