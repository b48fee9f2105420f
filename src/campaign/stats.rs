//! What the trials of a campaign say: success rates with intervals, by gain set and by impulse.

use crate::campaign::failures::Failures;
use crate::campaign::foretold::{FallCause, Foretold};
use crate::campaign::paired::{Common, Pair, Times};
use crate::campaign::spec::{PushSpec, SensorSpec};
use crate::campaign::stepped::Stepped;
use crate::campaign::{Row, SecondPushSpec, VariationSpec, parts::Manifest};
use crate::episode::{EpisodeConfig, Outcome};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, Normal};

/// `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub name: String,
    /// Version of the program.
    pub standfast: String,
    /// SHA-256 over campaign, robot, gain sets and version: equal hashes mean equal results.
    pub config_hash: String,
    /// SHA-256 of `trials.parquet`.
    pub trials_sha256: String,
    pub robot: String,
    /// Count of pushes; each set met all of them.
    pub trials: u64,
    pub seed: u64,
    /// Horizon, steps and the judge's thresholds.
    pub episode: EpisodeConfig,
    pub push: PushSpec,
    pub sensors: SensorSpec,
    pub second_push: SecondPushSpec,
    pub variations: VariationSpec,
    /// How `ci95` is computed.
    pub interval: &'static str,
    pub sets: Vec<SetSummary>,
    /// Times over the trials that every set survived, to be compared between sets.
    pub common_survivors: Common,
    /// Every pair of sets, trial by trial.
    pub pairs: Vec<Pair>,
}

/// One gain set's count.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetSummary {
    pub name: String,
    #[serde(flatten)]
    pub count: Count,
    pub fell: u64,
    pub diverged: u64,
    pub timed_out: u64,
    /// Over this set's own recovered trials.
    #[serde(flatten)]
    pub times: Times,
    /// What the sets of the pendulum say (of standing) against what happened; None without gains.
    pub foretold: Option<Foretold>,
    /// Footsteps against outcome; None for a set that took none.
    pub stepped: Option<Stepped>,
    /// When trials were lost, and what went with it.
    pub failures: Failures,
    pub fall_causes: Vec<FallCause>,
    /// Success by impulse, bins of equal width, without empty ones.
    pub by_impulse: Vec<ImpulseBin>,
}

/// Trials with `from_n_s <= impulse < to_n_s`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImpulseBin {
    pub from_n_s: f64,
    pub to_n_s: f64,
    #[serde(flatten)]
    pub count: Count,
}

/// How many of how many, and what that says of the rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Count {
    pub trials: u64,
    pub recovered: u64,
    pub success_rate: f64,
    pub ci95: [f64; 2],
}

impl Count {
    pub fn new(recovered: u64, trials: u64) -> Self {
        let success_rate = if trials == 0 { 0.0 } else { recovered as f64 / trials as f64 };
        Self { trials, recovered, success_rate, ci95: interval95(recovered, trials) }
    }

    pub fn of<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Self {
        let (mut trials, mut recovered) = (0, 0);
        for row in rows {
            trials += 1;
            recovered += u64::from(row.outcome == Outcome::Recovered);
        }
        Self::new(recovered, trials)
    }
}

impl Summary {
    /// Counts the rows of a whole campaign, sorted by trial, then by set; `trials_sha256` is of the file that holds them.
    pub fn new(manifest: &Manifest, rows: &[Row], trials_sha256: String) -> Self {
        let campaign = &manifest.campaign;
        let end_early = campaign.episode.end_early;
        let bins = bin_edges(rows.iter().map(|row| row.impulse_n_s));
        Self {
            name: campaign.name.clone(),
            standfast: manifest.standfast.clone(),
            config_hash: manifest.config_hash.clone(),
            trials_sha256,
            robot: campaign.robot.clone(),
            trials: campaign.trials,
            seed: campaign.seed,
            episode: campaign.episode,
            push: campaign.push,
            sensors: campaign.sensors,
            second_push: campaign.second_push,
            variations: campaign.variations,
            interval: "95 %: Wilson; Clopper-Pearson where fewer than 5 trials recovered, or fewer than 5 did not",
            sets: manifest.sets.iter().map(|name| SetSummary::new(name, rows, &bins, end_early)).collect(),
            common_survivors: Common::new(rows, manifest.sets.len(), end_early),
            pairs: Pair::all(rows, &manifest.sets),
        }
    }
}

impl SetSummary {
    fn new(name: &str, rows: &[Row], bins: &[f64], end_early: bool) -> Self {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.set == name).collect();
        let with = |outcome| rows.iter().filter(|row| row.outcome == outcome).count() as u64;
        let within = |bin: &&[f64]| {
            let (from_n_s, to_n_s) = (bin[0], bin[1]);
            let inside = |row: &&&Row| (from_n_s..to_n_s).contains(&row.impulse_n_s);
            ImpulseBin { from_n_s, to_n_s, count: Count::of(rows.iter().filter(inside).copied()) }
        };
        Self {
            name: name.into(),
            count: Count::of(rows.iter().copied()),
            fell: with(Outcome::Fell),
            diverged: with(Outcome::Diverged),
            timed_out: with(Outcome::TimedOut),
            times: Times::of(rows.iter().copied(), end_early),
            foretold: Foretold::new(&rows),
            stepped: Stepped::new(&rows),
            failures: Failures::of(rows.iter().copied()),
            fall_causes: FallCause::count(&rows),
            by_impulse: bins.windows(2).map(|bin| within(&bin)).filter(|bin| bin.count.trials > 0).collect(),
        }
    }
}

/// Interval of a rate at 95 %: Wilson's, and near 0 and 1, where that is too short, Clopper and Pearson's.
pub fn interval95(successes: u64, trials: u64) -> [f64; 2] {
    if successes.min(trials - successes) < 5 { clopper_pearson(successes, trials) } else { wilson(successes, trials) }
}

/// Wilson score interval of k of n at 95 %.
pub fn wilson(successes: u64, trials: u64) -> [f64; 2] {
    let (k, n) = (successes as f64, trials as f64);
    let z = Normal::standard().inverse_cdf(0.975);
    let rate = k / n;
    let middle = (rate + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (rate * (1.0 - rate) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// Clopper-Pearson (exact) interval of k of n at 95 %; of nothing at all: 0 to 1.
pub fn clopper_pearson(successes: u64, trials: u64) -> [f64; 2] {
    let (k, n) = (successes as f64, trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p));
    // Beta is undefined exactly at no success and at no failure, where the interval ends at 0 and at 1.
    [quantile(k, n - k + 1.0, 0.025).unwrap_or(0.0), quantile(k + 1.0, n - k, 0.975).unwrap_or(1.0)]
}

/// Middle of the sorted values, or mean of the middle two.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { None } else { Some((values[(n - 1) / 2] + values[n / 2]) / 2.0) }
}

/// Edges of about eight bins of a round width (1, 2, 2.5 or 5 times a power of ten) that cover the values.
fn bin_edges(values: impl Iterator<Item = f64>) -> Vec<f64> {
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
    use crate::campaign::row::tests::row;

    fn close(a: [f64; 2], b: [f64; 2]) {
        assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{a:?} is not {b:?}");
    }

    // Expected values: statsmodels 0.15.0 on scipy 1.17.1, `proportion_confint(k, n, method="wilson")`.
    #[test]
    fn wilson_is_that_of_statsmodels() {
        close(wilson(50, 100), [0.4038315303659956, 0.5961684696340044]);
        close(wilson(970, 1000), [0.9574965858524128, 0.9789062611711653]);
        close(wilson(5, 12), [0.1932603136587565, 0.6804886874504502]);
        close(wilson(333, 1000), [0.3044779033483562, 0.3628002339858192]);
    }

    // The same with `method="beta"`.
    #[test]
    fn clopper_pearson_is_that_of_statsmodels() {
        close(clopper_pearson(0, 50), [0.0, 0.07112173646419767]);
        close(clopper_pearson(50, 50), [0.9288782635358024, 1.0]);
        close(clopper_pearson(1, 48), [0.0005273152534231199, 0.11069616059315224]);
        close(clopper_pearson(3, 1000), [0.0006190999316495713, 0.008742023238478305]);
        close(clopper_pearson(997, 1000), [0.9912579767615217, 0.9993809000683505]);
    }

    #[test]
    fn the_exact_interval_serves_near_0_and_1() {
        assert_eq!(interval95(4, 100), clopper_pearson(4, 100));
        assert_eq!(interval95(5, 100), wilson(5, 100));
        assert_eq!(interval95(96, 100), clopper_pearson(96, 100));
        assert_eq!(interval95(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }

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
        let mut rows: Vec<Row> = (0..4).map(|i| row(i, "a", i as f64, outcomes[i as usize])).collect();
        rows.push(row(0, "b", 0.0, Outcome::Diverged));
        let set = SetSummary::new("a", &rows, &[0.0, 2.0, 4.0, 6.0], true);
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
