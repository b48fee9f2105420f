//! What the trials of one gain set say: how many it recovered from, by which impulses, and how it lost the rest.

use crate::campaign::store::by_set::BySet;
use crate::campaign::store::row::{TrialRow, success_count, success_count_of};
use crate::campaign::verdict::failures::{Failures, FallCause};
use crate::campaign::verdict::footsteps::ByFootsteps;
use crate::campaign::verdict::prediction::Prediction;
use crate::campaign::verdict::strata::Stratum;
use crate::campaign::verdict::telling_trials::TellingTrial;
use crate::campaign::verdict::times::Times;
use crate::episode::{EpisodeConfig, Outcome};
use crate::stats::curve::{NoCurve, Pushes, SuccessCurve};
use crate::stats::rate::SuccessCount;
use serde::Serialize;
use std::borrow::Cow;

/// More trials than this need not keep their impulses to the bit in a fitted curve.
const MANY: usize = 2500;
const CURVE_POINTS: usize = 41;

/// One gain set's count.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetSummary {
    pub name: String,
    pub origin: SetOrigin,
    #[serde(flatten)]
    pub count: SuccessCount,
    pub fell: u64,
    pub diverged: u64,
    pub timed_out: u64,
    /// Trials in which the push found the COM faster than a robot that counts as standing.
    pub moving_at_push: u64,
    /// Over this set's own recovered trials.
    #[serde(flatten)]
    pub times: Times,
    /// What the sets of the pendulum say (of standing) against what happened; None without gains.
    pub foretold: Option<Prediction>,
    /// Footsteps against outcome; None for a set that took none.
    pub stepped: Option<ByFootsteps>,
    /// How trials were lost.
    pub failures: Failures,
    pub fall_causes: Vec<FallCause>,
    /// Success by impulse, bins of equal width; the same for all sets, without those in which no set has a trial.
    pub by_impulse: Vec<ImpulseBin>,
    /// The impulses (N s) that are survived in 50 % and 90 %, by a fitted curve.
    pub curve: FittedCurve,
    /// The same over the impulse as a multiple of m omega d, by which robots compare.
    pub normalized_curve: FittedCurve,
    pub strata: Vec<SetStratum>,
    pub telling: Vec<TellingTrial>,
}

/// Where a set's trials can be replayed from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetOrigin {
    /// Path of the campaign file; relative to the folder of the result.
    pub campaign: String,
    /// Its name there.
    pub gains: String,
}

impl SetOrigin {
    /// Of a set of the result's own campaign.
    pub fn own(set: &str) -> Self {
        Self { campaign: "campaign.toml".into(), gains: set.into() }
    }
}

/// Success against impulse, fitted; without a fit, why there is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedCurve {
    #[serde(flatten)]
    pub fit: Option<SuccessCurve>,
    pub none_because: Option<NoCurve>,
    /// For a picture, over the range of the impulses.
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
    fn through(trials: &[(f64, bool)]) -> Self {
        let pushes = Pushes::new(&pooled(trials));
        let fit = match pushes.curve() {
            Ok(fit) => fit,
            Err(why) => return Self { fit: None, none_because: Some(why), points: Vec::new() },
        };
        let [from, to] = fit.range;
        let at = |i: usize| from + (to - from) * i as f64 / (CURVE_POINTS - 1) as f64;
        let point = |x: f64| CurvePoint { x, chance: fit.chance(x), ci95: pushes.band(x) };
        Self { fit: Some(fit), none_because: None, points: (0..CURVE_POINTS).map(at).map(point).collect() }
    }
}

/// Trials beyond [`MANY`] are moved to the next of as many impulses, 0.02 % of their range at most: a fit takes its time
/// for each impulse.
fn pooled(trials: &[(f64, bool)]) -> Cow<'_, [(f64, bool)]> {
    let ends = trials.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], (x, _)| [a.min(*x), b.max(*x)]);
    let unit = (ends[1] - ends[0]) / MANY as f64;
    if trials.len() <= MANY || unit == 0.0 {
        return trials.into();
    }
    trials.iter().map(|&(x, recovered)| (ends[0] + unit * ((x - ends[0]) / unit).round(), recovered)).collect()
}

/// Some of a set's trials.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetStratum {
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

impl SetSummary {
    /// Of set number `set`; `bins` are the edges of bins of impulse (N s), `strata` those of the campaign, and
    /// `episode` the settings of its episodes.
    pub(super) fn new(set: usize, all: &BySet, bins: &[f64], strata: &[Stratum], episode: &EpisodeConfig) -> Self {
        let (name, rows) = (&all.names[set], all.of(set));
        let speed_m_s = episode.judge.standing_com_speed_m_s;
        let moves = |row: &&&TrialRow| row.com_speed_at_push_m_s.is_some_and(|speed| speed > speed_m_s);
        let with = |outcome| rows.iter().filter(|row| row.outcome == outcome).count() as u64;
        let within = |bin: &[f64]| {
            let (from_n_s, to_n_s) = (bin[0], bin[1]);
            let is_within = |row: &TrialRow| (from_n_s..to_n_s).contains(&row.impulse_n_s);
            let is_empty = !all.drawn().iter().any(|row| is_within(row));
            (!is_empty).then(|| ImpulseBin { from_n_s, to_n_s, count: success_count_of(rows, is_within) })
        };
        let stratum = |stratum: &Stratum| {
            let count = success_count(stratum.trials.iter().filter_map(|&trial| rows.get(trial).copied()));
            SetStratum { by: stratum.by, label: stratum.label.clone(), count }
        };
        let over = |impulse: fn(&TrialRow) -> Option<f64>| {
            let trials = rows.iter().filter_map(|row| Some((impulse(row)?, row.has_recovered())));
            FittedCurve::through(&trials.collect::<Vec<_>>())
        };
        let (curve, normalized_curve) = (over(|row| Some(row.impulse_n_s)), over(|row| row.impulse_over_m_omega_d));
        let limit = normalized_curve.fit.or(curve.fit).map(|fit| fit.x50);
        Self {
            name: name.clone(),
            origin: SetOrigin::own(name),
            count: success_count(rows.iter().copied()),
            fell: with(Outcome::Fell),
            diverged: with(Outcome::Diverged),
            timed_out: with(Outcome::TimedOut),
            moving_at_push: rows.iter().filter(moves).count() as u64,
            times: Times::of(rows.iter().copied(), episode.end_early),
            foretold: Prediction::new(rows),
            stepped: ByFootsteps::new(rows),
            fall_causes: FallCause::count(rows),
            by_impulse: bins.windows(2).filter_map(within).collect(),
            curve,
            normalized_curve,
            strata: strata.iter().map(stratum).collect(),
            telling: TellingTrial::of(all, set, limit),
            failures: Failures::of(rows.iter().copied()),
        }
    }
}

/// Edges of about eight bins of a round width (1, 2, 2.5 or 5 times a power of ten) that cover the values.
pub(super) fn bin_edges(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let span = most - least;
    if !span.is_finite() {
        return Vec::new();
    }
    if span == 0.0 {
        // One push for all: one bin around it.
        return vec![(least - 0.5).max(0.0), most + 0.5];
    }
    let decade = 10f64.powi((span / 8.0).log10().floor() as i32);
    let width = [1.0, 2.0, 2.5, 5.0, 10.0].map(|m| m * decade).into_iter().find(|w| span / w <= 8.5).unwrap_or(span);
    let (first, last) = ((least / width).floor() as i64, (most / width).floor() as i64);
    (first..=last + 1).map(|i| i as f64 * width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::row;

    #[test]
    fn bins_are_round_and_hold_every_value() {
        assert_eq!(bin_edges([0.51, 4.49].into_iter()), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5]);
        assert_eq!(bin_edges([2.0, 2.0].into_iter()), [1.5, 2.5]);
        assert!(bin_edges([].into_iter()).is_empty());
        for most in [0.001, 0.3, 1.0, 7.7, 4e4] {
            let edges = bin_edges([0.0, most].into_iter());
            assert!(edges[0] <= 0.0 && most < edges[edges.len() - 1] && edges.len() <= 11, "{edges:?}");
        }
    }

    #[test]
    fn a_set_counts_its_own_rows() {
        let outcomes = [Outcome::Recovered, Outcome::Fell, Outcome::TimedOut, Outcome::Recovered];
        let trial = |i: u64| [row(i, "a", i as f64, outcomes[i as usize]), row(i, "b", i as f64, Outcome::Diverged)];
        let rows: Vec<TrialRow> = (0..4).flat_map(trial).collect();
        let set = SetSummary::new(
            0,
            &BySet::new(&rows, &["a", "b"].map(String::from)),
            &[0.0, 2.0, 4.0, 6.0],
            &[],
            &crate::campaign::ask::spec::tests::campaign("standard", &[]).episode,
        );
        assert_eq!((set.count.trials, set.count.recovered, set.fell, set.timed_out, set.diverged), (4, 2, 1, 1, 0));
        assert_eq!(set.count.success_rate, 0.5);
        assert_eq!(set.by_impulse.len(), 2);
        assert_eq!(set.by_impulse[1].count.recovered, 1);
        let json = serde_json::to_value(&set).unwrap();
        for key in ["name", "trials", "recovered", "fell", "diverged", "timed_out", "success_rate", "ci95"] {
            assert!(json.get(key).is_some(), "{key}");
        }
    }
}
