//! Success rates with their intervals.

use crate::sequential::rate_interval;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, Normal};

/// A count of successes, with the rate and its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SuccessCount {
    pub trials: u64,
    pub recovered: u64,
    pub success_rate: f64,
    pub ci95: [f64; 2],
}

impl SuccessCount {
    pub fn new(recovered: u64, trials: u64) -> Self {
        let success_rate = if trials == 0 {
            0.0
        } else {
            recovered as f64 / trials as f64
        };
        Self {
            trials,
            recovered,
            success_rate,
            ci95: interval95(recovered, trials),
        }
    }

    /// The same count, with an interval that holds however often one looks.
    pub fn at_any_time(self) -> Self {
        Self {
            ci95: rate_interval(self.recovered, self.trials, 0.95),
            ..self
        }
    }
}

/// 95 % interval of a rate: Wilson's or, near 0 and 1, where Wilson's is too short, Clopper and Pearson's.
fn interval95(successes: u64, trials: u64) -> [f64; 2] {
    if successes.min(trials - successes) < 5 {
        clopper_pearson(successes, trials, 0.95)
    } else {
        wilson(successes, trials)
    }
}

/// Wilson score interval at 95 %.
fn wilson(successes: u64, trials: u64) -> [f64; 2] {
    let (k, n) = (successes as f64, trials as f64);
    let z = Normal::standard().inverse_cdf(0.975);
    let rate = k / n;
    let middle = (rate + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (rate * (1.0 - rate) / n + z * z / (4.0 * n * n)).sqrt();
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

/// Clopper-Pearson (exact) interval at a two-sided level (a share). Without trials it is 0 to 1.
pub fn clopper_pearson(successes: u64, trials: u64, level: f64) -> [f64; 2] {
    let (k, n, tail) = (successes as f64, trials as f64, (1.0 - level) / 2.0);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p));
    // The beta distribution is undefined without successes or failures, where the interval ends at 0 or 1.
    [
        quantile(k, n - k + 1.0, tail).unwrap_or(0.0),
        quantile(k + 1.0, n - k, 1.0 - tail).unwrap_or(1.0),
    ]
}

/// The middle one of the sorted values, or the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        None
    } else {
        Some((values[(n - 1) / 2] + values[n / 2]) / 2.0)
    }
}

/// Interval of the median of values in ascending order at a two-sided level (a share), whatever their distribution: it
/// holds what a sign test does not reject. With `at_every_look` it holds however often one looks. None if the values
/// are too few.
pub fn median_interval(sorted: &[f64], level: f64, at_every_look: bool) -> Option<[f64; 2]> {
    let n = sorted.len() as u64;
    let interval = match at_every_look {
        true => rate_interval,
        false => clopper_pearson,
    };
    let counts: Vec<u64> = (0..=n / 2).collect();
    // So many values are not below the median alone by chance.
    let outside = counts.partition_point(|&below| interval(below, n, level)[1] < 0.5);
    let first = outside.checked_sub(1)?;
    Some([sorted[first], sorted[sorted.len() - outside]])
}

#[cfg(test)]
mod tests {
    use super::*;

    // Expected values: statsmodels 0.15.0 on scipy 1.17.1, `proportion_confint(k, n, method="wilson")` and
    // `method="beta"`; other levels by `beta.ppf((1 - level) / 2, k, n - k + 1)`, `beta.ppf((1 + level) / 2, k + 1, n -
    // k)`.
    #[test]
    fn intervals_are_those_of_statsmodels_and_scipy() {
        for (found, expected) in [
            (wilson(50, 100), [0.4038315303659956, 0.5961684696340044]),
            (wilson(970, 1000), [0.9574965858524128, 0.9789062611711653]),
            (wilson(5, 12), [0.1932603136587565, 0.6804886874504502]),
            (clopper_pearson(0, 50, 0.95), [0.0, 0.07112173646419767]),
            (clopper_pearson(50, 50, 0.95), [0.9288782635358024, 1.0]),
            (
                clopper_pearson(1, 48, 0.95),
                [0.0005273152534231199, 0.11069616059315224],
            ),
            (
                clopper_pearson(997, 1000, 0.95),
                [0.9912579767615217, 0.9993809000683505],
            ),
            (
                clopper_pearson(80, 100, 0.9),
                [0.7227997503290862, 0.8633386747541327],
            ),
            (
                clopper_pearson(997, 1000, 0.8),
                [0.9933315046629319, 0.9988974393004678],
            ),
            (clopper_pearson(0, 0, 0.9), [0.0, 1.0]),
            // The exact interval serves near 0 and 1.
            (interval95(4, 100), clopper_pearson(4, 100, 0.95)),
            (interval95(5, 100), wilson(5, 100)),
            (interval95(96, 100), clopper_pearson(96, 100, 0.95)),
        ] {
            let wrong = (found[0] - expected[0])
                .abs()
                .max((found[1] - expected[1]).abs());
            assert!(wrong < 1e-9, "{found:?} is not {expected:?}");
        }
    }

    #[test]
    fn medians() {
        for (values, expected) in [
            (&[][..], None),
            (&[3.0, 1.0, 2.0], Some(2.0)),
            (&[4.0, 1.0, 2.0, 3.0], Some(2.5)),
        ] {
            assert_eq!(median(values.to_vec()), expected);
        }
    }

    // Expected ranks: the smallest k with more than 2.5 % of 2^n in the sum of the binomial coefficients up to k, and its
    // mirror image.
    #[test]
    fn an_interval_of_a_median_is_between_the_ranks_of_the_sign_test() {
        for (n, ranks) in [
            (5, None),
            (6, Some([1.0, 6.0])),
            (10, Some([2.0, 9.0])),
            (100, Some([40.0, 61.0])),
        ] {
            let values: Vec<f64> = (1..=n).map(f64::from).collect();
            assert_eq!(median_interval(&values, 0.95, false), ranks, "{n}");
            let [least, most] = median_interval(&values, 0.95, true).unwrap_or([0.0, 101.0]);
            assert!(ranks.is_none_or(|ranks| least < ranks[0] && most > ranks[1]));
        }
    }
}
