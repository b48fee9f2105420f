//! Intervals that hold at every look: an interval of a rate, or of the difference of two rates on the same trials, that
//! may be inspected after each block of trials, to stop as soon as it decides. (An interval or a p-value for a fixed
//! number of trials is wrong far more often if one stops at the first look that pleases.)
//!
//! The method is betting. A gambler who believes that the mean of x is not m bets on this in every trial. Let x lie
//! between 0 and 1 (for a difference, x = 1/2 in a trial with equal outcomes). A bet f in (0, 1] that the mean is
//! larger multiplies the capital by `1 - f + f x / m`, and a bet that it is smaller by `1 - f + f (1 - x) / (1 - m)`.
//! Both factors are never below 0 and, if the mean is m, 1 on average. This also holds for a capital that is spread
//! over several bets, here evenly over 30 on either side. If the mean is m, such a capital ever reaches 1 / alpha with
//! a probability of at most alpha, whenever one looks and stops (Ville 1939). The interval consists of all m for which
//! the capital has not reached it. The interval depends on the counts alone, and not on their order. For a difference
//! of 0 the capital is a mixture over the odds that, if only one of two controllers recovers, it is the first:
//! McNemar's test as a bet.
//!
//! These m form an interval that contains the observed mean. The logarithm of each factor is convex in m, and so are
//! the logarithms of products and sums of factors. At the observed mean no capital exceeds 1 (the geometric mean of the
//! factors is at most their arithmetic mean, which is 1).
//!
//! Sources: Waudby-Smith and Ramdas 2024, "Estimating means of bounded random variables by betting", J. R. Stat. Soc. B
//! 86, 1-27; Robbins 1970, "Statistical methods related to the law of the iterated logarithm" (mixtures).

/// Number of trials between the first looks. All looks are at multiples of it.
pub const LOOK_TRIALS: u64 = 25;
/// Number of bets on either side, evenly spaced in the logarithm from the smallest one to 1.
const BETS: usize = 30;
/// Smallest bet on a difference. Mixtures were tried that are even in the bet, in its arcsine, or in its logarithm from
/// 0.001, 0.003, 0.01, 0.02, 0.03, 0.05 or 0.1, with 2 to 40 % of discordant trials and differences of 0 to 30 points.
/// This one stopped at most 19 % later than the best one for each case, and 8 % on average. A larger one gains 3 %, but
/// is too coarse for 100,000 trials: there, intervals from 0.05 are up to 1.7 times as wide.
const LEAST_BET_DIFFERENCE: f64 = 0.02;
/// Smallest bet on a rate. It is small because at a rate of 0.99, a bet on a lower rate risks little for a hundred
/// times as much. With 0.02 the upper end at 9950 of 10,000 is 0.9997; with this value it is 0.9970.
const LEAST_BET_RATE: f64 = 0.001;
/// Bisections in the search for an end.
const HALVINGS: usize = 45;

/// Interval of the difference of two rates (rate of a less rate of b, as a share) on the same trials, from the numbers
/// of trials in which only a and only b recovered. It contains the truth at all looks together with a probability of at
/// least `level` (a share, such as 0.95).
///
/// It depends on the present counts alone; [`narrowed`] intersects it with the intervals of earlier looks.
///
/// # Panics
/// Panics if there are fewer trials than `only_a + only_b`, or if `level` is not between 0 and 1.
pub fn difference_interval(only_a: u64, only_b: u64, trials: u64, level: f64) -> [f64; 2] {
    assert!(
        only_a + only_b <= trials,
        "{only_a} and {only_b} of {trials} trials"
    );
    let counts = BetCapital::of_differences(only_a, only_b, trials);
    counts
        .interval(&bets(LEAST_BET_DIFFERENCE), level)
        .map(|mean| 2.0 * mean - 1.0)
}

/// Interval of a rate (a share) that contains the truth at all looks together with a probability of at least `level`.
///
/// # Panics
/// Panics if `recovered` exceeds `trials`, or if `level` is not between 0 and 1.
pub fn rate_interval(recovered: u64, trials: u64, level: f64) -> [f64; 2] {
    assert!(recovered <= trials, "{recovered} of {trials} trials");
    BetCapital {
        low: trials - recovered,
        middle: 0,
        high: recovered,
    }
    .interval(&bets(LEAST_BET_RATE), level)
}

/// Number of trials at the first look after `trials`, which is a round number: steps of 25 up to 500, of 50 up to 1000, of
/// 100 up to 2500, of 250 up to 5000, and so on. The intervals hold whenever one looks. Few looks take little time, and
/// a campaign ends by at most a tenth later.
pub fn next_look(trials: u64) -> u64 {
    let decade = 10u64.pow((trials.max(100) / 100).ilog10());
    let share = match trials / decade {
        ..250 => 10,
        250..500 => 25,
        _ => 50,
    };
    let step = LOOK_TRIALS.max(share * decade);
    (trials / step + 1) * step
}

/// The first look at which there are at least `trials` trials, and at least one.
pub fn look_from(trials: u64) -> u64 {
    next_look(trials.saturating_sub(1))
}

/// The looks at no more than `trials` trials, and `trials` itself, in order.
pub fn looks_until(trials: u64) -> impl Iterator<Item = u64> {
    std::iter::successors(Some(next_look(0)), |look| Some(next_look(*look)))
        .take_while(move |look| *look < trials)
        .chain([trials])
}

/// The intersection of the intervals of all looks, in their order. It contains the truth with the level of each
/// interval, and what one look has decided stays decided. An interval that does not overlap the intersection of the
/// earlier ones is left out: at least one interval then misses the truth, and it cannot be known which one.
pub fn narrowed(intervals: impl IntoIterator<Item = [f64; 2]>) -> [f64; 2] {
    intervals.into_iter().fold(
        [f64::NEG_INFINITY, f64::INFINITY],
        |[low, high], [least, most]| {
            let common = [low.max(least), high.min(most)];
            if common[0] <= common[1] {
                common
            } else {
                [low, high]
            }
        },
    )
}

/// The bets, from 1 down to the smallest one, evenly spaced in the logarithm.
fn bets(least: f64) -> [f64; BETS] {
    std::array::from_fn(|i| least.powf(i as f64 / (BETS - 1) as f64))
}

/// Numbers of times that x was 0, 1/2 and 1.
#[derive(Debug, Clone, Copy)]
struct BetCapital {
    low: u64,
    middle: u64,
    high: u64,
}

impl BetCapital {
    /// Maps the differences -1, 0 and 1 to 0, 1/2 and 1.
    fn of_differences(only_a: u64, only_b: u64, trials: u64) -> Self {
        Self {
            low: only_b,
            middle: trials - only_a - only_b,
            high: only_a,
        }
    }

    fn mirrored(self) -> Self {
        Self {
            low: self.high,
            middle: self.middle,
            high: self.low,
        }
    }

    /// Mean of x; None without trials.
    fn mean(self) -> Option<f64> {
        let trials = self.low + self.middle + self.high;
        (trials > 0).then(|| (self.high as f64 + self.middle as f64 / 2.0) / trials as f64)
    }

    /// Logarithm of the capital, from 1, after betting `bet` on a mean larger than `mean` in all trials.
    fn ln_gain(self, bet: f64, mean: f64) -> f64 {
        let gain = |count: u64, x: f64| match count {
            0 => 0.0, // also of a factor of 0
            count => count as f64 * (1.0 - bet + bet * x / mean).ln(),
        };
        gain(self.low, 0.0) + gain(self.middle, 0.5) + gain(self.high, 1.0)
    }

    /// Logarithm of the capital, from 1, of a gambler who bets against `mean`, strictly between 0 and 1, on both sides.
    fn ln_capital(self, bets: &[f64; BETS], mean: f64) -> f64 {
        let mirrored = self.mirrored();
        let gains: [f64; 2 * BETS] = std::array::from_fn(|i| match bets[i / 2] {
            bet if i % 2 == 0 => self.ln_gain(bet, mean),
            bet => mirrored.ln_gain(bet, 1.0 - mean),
        });
        let largest = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let average =
            gains.iter().map(|gain| (gain - largest).exp()).sum::<f64>() / gains.len() as f64;
        largest + average.ln()
    }

    /// All means for which the capital is below 1 / (1 - level).
    fn interval(self, bets: &[f64; BETS], level: f64) -> [f64; 2] {
        assert!(0.0 < level && level < 1.0, "a level of {level}");
        let Some(mean) = self.mean() else {
            return [0.0, 1.0];
        };
        let enough = -(1.0 - level).ln();
        let end = |mut outside: f64| {
            let mut inside = mean;
            for _ in 0..HALVINGS {
                let middle = (outside + inside) / 2.0;
                if middle == outside || middle == inside {
                    break; // also where the mean itself is the end
                }
                *(if self.ln_capital(bets, middle) < enough {
                    &mut inside
                } else {
                    &mut outside
                }) = middle;
            }
            outside
        };
        [end(0.0), end(1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f64; 2], b: [f64; 2]) {
        assert!(
            (a[0] - b[0]).abs() < 1e-10 && (a[1] - b[1]).abs() < 1e-10,
            "{a:?} is not {b:?}"
        );
    }

    // Expected values: another implementation, on -1, 0, 1, in numpy 2.4.6, with ends by scipy 1.17.1 `brentq`.
    #[test]
    fn intervals_are_those_of_another_implementation() {
        close(
            difference_interval(30, 10, 400, 0.95),
            [-0.0004196085001367801, 0.10567665983888216],
        );
        close(
            difference_interval(0, 0, 25, 0.95),
            [-0.2221226296549209, 0.2221226296549209],
        );
        close(
            difference_interval(87, 61, 870, 0.95),
            [-0.015440509072651543, 0.07588987644173235],
        );
        close(
            difference_interval(3, 0, 100, 0.99),
            [-0.05869216485089408, 0.1451950372589813],
        );
        close(
            difference_interval(450, 430, 4000, 0.95),
            [-0.019026825053550852, 0.02904209621189564],
        );
        close(
            difference_interval(25, 0, 25, 0.95),
            [0.555135772944212, 1.0],
        );
        close(
            rate_interval(80, 100, 0.95),
            [0.642005650503046, 0.909693131781211],
        );
        close(rate_interval(0, 50, 0.95), [0.0, 0.1254651029974172]);
        close(rate_interval(50, 50, 0.95), [0.8745348970025828, 1.0]);
        close(
            rate_interval(997, 1000, 0.99),
            [0.9837227373804259, 0.9998849029934349],
        );
        close(
            rate_interval(7, 25, 0.95),
            [0.06534012382025212, 0.619230258524056],
        );
        assert_eq!(rate_interval(0, 0, 0.95), [0.0, 1.0]);
        assert_eq!(difference_interval(0, 0, 0, 0.95), [-1.0, 1.0]);
    }

    #[test]
    fn looks_are_at_round_numbers_a_tenth_apart() {
        let found: Vec<u64> = looks_until(1150).collect();
        assert_eq!(found[..4], [25, 50, 75, 100]);
        assert_eq!(
            found[18..],
            [
                475, 500, 550, 600, 650, 700, 750, 800, 850, 900, 950, 1000, 1100, 1150
            ]
        );
        assert!(looks_until(10).eq([10]) && looks_until(50).eq([25, 50]));
        let after = [1000, 2400, 2500, 5000, 9500, 10_000].map(next_look);
        assert_eq!(after, [1100, 2500, 2750, 5500, 10_000, 11_000]);
        for look in looks_until(100_000) {
            assert!(look.is_multiple_of(LOOK_TRIALS) && look_from(look) == look);
            assert!(look < 250 || next_look(look) <= look + look / 10, "{look}");
        }
    }

    #[test]
    fn what_a_look_has_left_out_stays_out() {
        assert_eq!(narrowed([[-0.2, 0.4], [0.1, 0.5], [-0.1, 0.3]]), [0.1, 0.3]);
        assert_eq!(narrowed([[0.1, 0.5], [-0.2, 0.0], [0.2, 0.6]]), [0.2, 0.5]);
    }

    #[test]
    fn an_interval_holds_every_mean_that_is_not_refused_and_no_other() {
        let bets = bets(LEAST_BET_DIFFERENCE);
        for (a, b, trials) in [
            (0, 0, 25),
            (1, 0, 50),
            (40, 2, 300),
            (300, 310, 3000),
            (25, 0, 25),
            (0, 700, 900),
        ] {
            let [least, most] = difference_interval(a, b, trials, 0.95);
            for i in 1..2000 {
                let mean = f64::from(i) / 2000.0;
                let held = BetCapital::of_differences(a, b, trials).ln_capital(&bets, mean)
                    < 20.0_f64.ln();
                let difference = 2.0 * mean - 1.0;
                assert_eq!(
                    held,
                    least <= difference && difference <= most,
                    "{a}, {b} of {trials} at {difference}"
                );
            }
            close(difference_interval(b, a, trials, 0.95), [-most, -least]);
        }
    }
}
