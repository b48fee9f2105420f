//! Compares two controllers on the same trials: the 2x2 table of recoveries, the difference of the two rates, and its
//! uncertainty.
//!
//! Only trials with different outcomes distinguish the controllers; they are called discordant. The exact McNemar test
//! asks whether these split as the throws of a fair coin would. Tango's score interval (1998, "Equivalence test and
//! confidence interval for the difference in proportions for the paired-sample design") contains every difference D
//! that the score test does not reject. Its ends satisfy `only_a - only_b - n D = +-z sqrt(n (2 q + D (1 - D)))`, with
//! n trials, the normal quantile z, and the likeliest share q of `only_b` if the difference is D: the root of `2 n q^2
//! + ((2 n - only_a + only_b) D - only_a - only_b) q - only_b D (1 - D) = 0`.
//!
//! The 95 % interval misses the truth with about 2.5 % on either side. Sums over all tables (200 to 4000 trials, up to
//! 40 % discordant) give more exact figures. The interval lies nearer to zero than the truth, or beyond zero, with at
//! most 2.9 %. It lies farther from zero with at most 2.9 % if at least 10 trials of the rarer discordant kind are
//! expected, 3.3 % if 5 are, 4.8 % if 2 are, and 5.6 % if nearly all are of one kind and these are few. The worst case
//! has 4.5 of them (400 trials, a loss of 1 % and nearly no gain): nine of one kind and none of the other are then not
//! as rare as the score test takes them to be.

use crate::sequential;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};
use statrs::function::erf::erfc;

/// Bisections of an interval of length 2, which give its end to 1e-17.
const HALVINGS: usize = 58;

/// Numbers of trials by their outcome with two controllers a and b.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct PairedCounts {
    /// Both recovered.
    pub both: u64,
    /// a recovered and b did not.
    pub only_a: u64,
    /// b recovered and a did not.
    pub only_b: u64,
    pub neither: u64,
}

impl PairedCounts {
    /// Counts trials by whether a and b recovered.
    pub fn of(trials: impl Iterator<Item = (bool, bool)>) -> Self {
        let mut counts = Self::default();
        for (a, b) in trials {
            counts.add(a, b);
        }
        counts
    }

    /// Adds one more trial, by whether a and b recovered.
    pub fn add(&mut self, a: bool, b: bool) {
        *match (a, b) {
            (true, true) => &mut self.both,
            (true, false) => &mut self.only_a,
            (false, true) => &mut self.only_b,
            (false, false) => &mut self.neither,
        } += 1;
    }

    /// Interval of the difference: for a fixed number of trials ([`difference_interval`](Self::difference_interval)),
    /// or one that holds at every look ([`sequential`]).
    pub fn interval(&self, level: f64, at_every_look: bool) -> [f64; 2] {
        match at_every_look {
            true => sequential::difference_interval(self.only_a, self.only_b, self.trials(), level),
            false => self.difference_interval(level),
        }
    }

    /// The counts with a and b exchanged.
    pub fn swapped(&self) -> Self {
        Self {
            only_a: self.only_b,
            only_b: self.only_a,
            ..*self
        }
    }

    pub fn trials(&self) -> u64 {
        self.both + self.only_a + self.only_b + self.neither
    }

    /// Rate of a less rate of b (a share, from -1 to 1); 0 without trials.
    pub fn difference(&self) -> f64 {
        (self.only_a as f64 - self.only_b as f64) / self.trials().max(1) as f64
    }

    /// Exact two-sided McNemar test: the probability that a fair coin, thrown once for each discordant trial, gives a
    /// result at least as lopsided. It is 1 if no trial is discordant.
    pub fn mcnemar_p(&self) -> f64 {
        (2.0 * fair_coin_tail(self.only_a.min(self.only_b), self.only_a + self.only_b)).min(1.0)
    }

    /// McNemar's test by the normal approximation, two-sided and without continuity correction. It is the score test of
    /// no difference: [`difference_interval`](Self::difference_interval) contains 0 exactly if this test does not
    /// reject.
    pub fn score_p(&self) -> f64 {
        let [won, lost] = [self.only_a, self.only_b].map(|count| count as f64);
        erfc((won - lost).abs() / (2.0 * (won + lost).max(1.0)).sqrt())
    }

    /// Tango's score interval of [`difference`](Self::difference) at a two-sided level (between 0 and 1); -1 to 1
    /// without trials. Each end alone is a one-sided bound at about the level `(1 + level) / 2`.
    pub fn difference_interval(&self, level: f64) -> [f64; 2] {
        if self.trials() == 0 {
            return [-1.0, 1.0];
        }
        let z = Normal::standard().inverse_cdf(0.5 + level / 2.0);
        [
            self.least_difference(z),
            -self.swapped().least_difference(z),
        ]
    }

    /// Total number of trials after which the score test at the two-sided level `alpha` tells the difference from
    /// `required` (a share) with the chance `power`, if the rates are as observed: `(z_alpha sqrt(v) + z_power sqrt(s -
    /// d^2))^2 / (d - required)^2`, with the share s of discordant trials, the difference d, and the variance v of a
    /// trial's difference at the likeliest rates that differ by `required`. For a `required` of 0, v is s, and the test
    /// is McNemar's (Connor 1987, "Sample size for testing differences in proportions for the paired-sample design").
    /// None if the observed difference is the required one.
    ///
    /// This is a rough guess: an observed difference that is not resolved may well be twice the true one.
    pub fn trials_to_resolve(&self, required: f64, power: f64, alpha: f64) -> Option<u64> {
        let d = self.difference();
        if self.trials() == 0 || d == required {
            return None;
        }
        let discordant = (self.only_a + self.only_b) as f64 / self.trials() as f64;
        let z = |p: f64| Normal::standard().inverse_cdf(p);
        // Rounding may leave s - d^2 a little below 0 if all trials are discordant to one side.
        let spread = (discordant - d * d).max(0.0).sqrt();
        let root = z(1.0 - alpha / 2.0) * self.variance_at(required).sqrt() + z(power) * spread;
        Some((root / (d - required)).powi(2).ceil().max(1.0) as u64)
    }

    /// The smallest difference that the score test does not reject.
    fn least_difference(&self, z: f64) -> f64 {
        let n = self.trials() as f64;
        let observed = self.only_a as f64 - self.only_b as f64;
        // Bisection finds the end: `d` is too low if the observed difference exceeds it by more than z standard errors.
        let (mut low, mut high) = (-1.0, self.difference());
        for _ in 0..HALVINGS {
            let d = 0.5 * (low + high);
            if observed - n * d > z * (n * self.variance_at(d)).sqrt() {
                low = d;
            } else {
                high = d;
            }
        }
        high
    }

    /// Variance of one trial's difference (-1, 0 or 1) at the likeliest rates whose difference is `d`.
    fn variance_at(&self, d: f64) -> f64 {
        // Mirrored for d < 0, so that nothing below cancels.
        let (a, b) = if d < 0.0 {
            (self.only_b, self.only_a)
        } else {
            (self.only_a, self.only_b)
        };
        let (n, a, b, d) = (self.trials() as f64, a as f64, b as f64, d.abs());
        let (quadratic, linear, constant) =
            (2.0 * n, (2.0 * n - a + b) * d - a - b, b * d * (1.0 - d));
        let root = (linear * linear + 4.0 * quadratic * constant).sqrt();
        let only_b = if linear > 0.0 {
            2.0 * constant / (root + linear)
        } else {
            (root - linear) / (2.0 * quadratic)
        };
        2.0 * only_b + d * (1.0 - d)
    }
}

/// Probability of at most `k` heads in `n` throws of a fair coin, for `k <= n / 2`.
///
/// Each term follows from the previous one, outwards from the middle, relative to the sum of all. So there are no
/// factorials and no cancellation. Terms vanish at 38 standard deviations: a million throws take some 20 thousand
/// terms.
fn fair_coin_tail(k: u64, n: u64) -> f64 {
    let middle = n / 2;
    let (mut term, mut below, mut tail) = (1.0, 0.0, 0.0);
    for heads in (0..=middle).rev() {
        below += term;
        tail += if heads <= k { term } else { 0.0 };
        term *= heads as f64 / (n - heads + 1) as f64;
        // Below this, repeated halving would round up to the smallest number and never end.
        if term < f64::MIN_POSITIVE {
            break;
        }
    }
    // The upper half mirrors the lower half; for even n the two share the middle.
    let all = 2.0 * below - if n.is_multiple_of(2) { 1.0 } else { 0.0 };
    tail / all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(both: u64, only_a: u64, only_b: u64, neither: u64) -> PairedCounts {
        PairedCounts {
            both,
            only_a,
            only_b,
            neither,
        }
    }

    // Expected values: scipy 1.17.1 `binomtest(only_a, only_a + only_b).pvalue`, and the same of statsmodels 0.15.0
    // `mcnemar(exact=True)`; and Tango's interval at 95 and 90 % from the score test with the likeliest rates found by
    // maximising the likelihood of the table numerically (brentq), not from the quadratic.
    type KnownTable = ([u64; 4], f64, [f64; 2], [f64; 2]);
    #[rustfmt::skip]
    const TABLES: [KnownTable; 12] = [
        ([40, 9, 3, 48], 0.14599609375, [-0.009115601446117016, 0.13769300936663148], [0.00336016859529008, 0.12344326888250748]),
        ([0, 1, 0, 9], 1.0, [-0.20528607984917807, 0.4041500267952385], [-0.13423616709174757, 0.3477186673358584]),
        ([50, 0, 0, 50], 1.0, [-0.03699349820698568, 0.03699349820698568], [-0.026342720783172967, 0.026342720783172967]),
        ([20, 7, 0, 3], 0.015625, [0.09333348175210521, 0.4092832615812221], [0.1313066866457109, 0.37902605312868204]),
        ([0, 0, 12, 0], 0.00048828125, [-1.0, -0.5150119866895184], [-1.0, -0.632037610505046]),
        ([0, 5, 5, 0], 1.0, [-0.526813818974872, 0.526813818974872], [-0.46145635772346555, 0.46145635772346555]),
        ([430, 31, 52, 487], 0.027534178012294533, [-0.03948044764916283, -0.0032136357050342257], [-0.03638670446372324, -0.006110358809225233]),
        ([1, 1, 0, 0], 1.0, [-0.48642965874002037, 0.9054687942657692], [-0.36245408649048055, 0.8791336805777262]),
        ([900000, 10500, 10000, 79500], 0.0004915393992266739, [0.000219396330266726, 0.0007806915852594555], [0.00026451030171397203, 0.0007355516209315603]),
        ([999990, 3, 7, 0], 0.34375, [-1.1793848371859009e-05, 2.656057623007103e-06], [-1.0249790194904648e-05, 1.3788325943096192e-06]),
        ([0, 1, 0, 0], 1.0, [-0.5869013712455244, 1.0], [-0.46026810243189165, 1.0]),
        ([0, 600000, 400000, 0], 0.0, [0.19807887057544873, 0.2019195928469257], [0.1983878401470455, 0.20161107763850084]),
    ];

    #[test]
    fn p_and_interval_are_those_of_others() {
        for ([both, only_a, only_b, neither], p, at95, at90) in TABLES {
            let counts = table(both, only_a, only_b, neither);
            let swapped = table(both, only_b, only_a, neither);
            assert!(
                (counts.mcnemar_p() - p).abs() <= 1e-10 * p,
                "{counts:?}: {}",
                counts.mcnemar_p()
            );
            assert_eq!(counts.mcnemar_p(), swapped.mcnemar_p());
            for (level, expected) in [(0.95, at95), (0.9, at90)] {
                let found = counts.difference_interval(level);
                // 1e-10; for the million, what is left of 16 digits after brentq.
                let wrong = (found[0] - expected[0])
                    .abs()
                    .max((found[1] - expected[1]).abs());
                assert!(wrong < 1e-10, "{counts:?}: {found:?} is not {expected:?}");
                let mirrored = swapped.difference_interval(level);
                assert_eq!([-mirrored[1], -mirrored[0]], found);
            }
        }
    }

    #[test]
    fn no_trials_say_nothing() {
        let none = PairedCounts::default();
        assert_eq!((none.difference(), none.mcnemar_p()), (0.0, 1.0));
        assert_eq!(none.difference_interval(0.95), [-1.0, 1.0]);
    }

    #[test]
    fn a_million_coins_are_counted_without_loss() {
        // scipy 1.17.1: binomtest(499000, 10**6).pvalue and others.
        for (k, n, p) in [
            (499000, 1000000, 0.0456082998653896),
            (490000, 1000000, 5.544363287708518e-89),
            (7, 40, 4.2277022657799534e-05),
            (20, 41, 1.0),
            (0, 900, 2.3661043723335494e-271),
        ] {
            let found = table(0, k, n - k, 0).mcnemar_p();
            assert!((found - p).abs() <= 1e-9 * p, "{k} of {n}: {found}");
        }
    }

    // Expected values: Connor's formula on scipy 1.17.1 normal quantiles, rounded up.
    #[test]
    fn trials_to_resolve_are_those_of_connor() {
        for ([both, only_a, only_b, neither], power, alpha, expected) in [
            ([40, 9, 3, 48], 0.8, 0.05, Some(260)),
            ([430, 31, 52, 487], 0.9, 0.01, Some(2796)),
            ([0, 0, 12, 0], 0.8, 0.05, Some(4)),
            ([5, 3, 3, 5], 0.8, 0.05, None),
            ([0; 4], 0.8, 0.05, None),
        ] {
            assert_eq!(
                table(both, only_a, only_b, neither).trials_to_resolve(0.0, power, alpha),
                expected
            );
        }
    }
}
