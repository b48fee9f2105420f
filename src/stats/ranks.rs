//! Compares recovery times and other numbers of two controllers on the same trials: is one of them larger, and by how
//! much?
//!
//! The test is Wilcoxon's signed-rank test (1945). The differences are ranked by magnitude, and the ranks of the
//! positive ones should sum to about half of the total. Differences of zero are left out (as Wilcoxon does; scipy's
//! `zero_method="wilcox"`), and equal magnitudes share the mean of their ranks. P is exact up to 50 differences without
//! ties. Beyond 50, or with ties, P follows from the normal approximation with the corrections for ties and continuity
//! (scipy's `method="approx", correction=True`).
//!
//! The shift is the one of Hodges and Lehmann (1963): the median of the means of all pairs of differences, including
//! each difference with itself (Walsh averages). Zeros count. Its interval contains the averages that the test does not
//! reject (Hollander and Wolfe, "Nonparametric Statistical Methods"). The k-th of the n (n + 1) / 2 averages is found
//! without forming them, by bisection of a range of numbers: two indices on the sorted differences count the averages
//! below a number.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use statrs::function::erf::erfc;
use std::f64::consts::SQRT_2;

/// Largest number of differences for which the distribution of rank sums is exact.
const EXACT: usize = 50;
/// Smallest number of differences other than zero for which an interval of the mean is given.
const ENOUGH_FOR_A_MEAN: u64 = 20;
/// Difference below which magnitudes are ties (or zero), as a share of the largest one. Times are rounded multiples of
/// a tick.
const TIE: f64 = 1e-9;

/// How paired differences are distributed about zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shift {
    /// Number of differences.
    pub pairs: u64,
    /// Number of differences that are not zero.
    pub nonzero: u64,
    /// Two-sided p-value of the hypothesis that either sign is equally likely at any magnitude; 1 if all are zero.
    pub p: f64,
    /// Hodges and Lehmann's estimate, in the unit of the differences.
    pub median: f64,
    pub mean: f64,
    /// Interval of `median` at 95 % or a little more; None below 6 pairs, which cannot give 95 %.
    pub ci95: Option<[f64; 2]>,
    /// Interval of `mean` at about 95 % (Student's t; 93 to 96 % of simulated intervals of numbers of footsteps held).
    /// None if fewer than 20 differences are not zero.
    pub mean_ci95: Option<[f64; 2]>,
}

/// Tests paired differences, all in one unit. Returns None if there are none, or if one is not finite.
pub fn signed_rank(differences: &[f64]) -> Option<Shift> {
    if differences.is_empty() || differences.iter().any(|d| !d.is_finite()) {
        return None;
    }
    let mut sorted = differences.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let averages = n as u64 * (n as u64 + 1) / 2;
    let (p, nonzero) = p_value(&sorted);
    // The median is one of the averages, or the mean of two averages.
    let median = 0.5 * kth_average(&sorted, averages.div_ceil(2))
        + 0.5 * kth_average(&sorted, averages / 2 + 1)
        + 0.0;
    // Adding 0 turns -0 into 0.
    let outer = lowest_kept(n);
    let ci95 =
        (outer > 0).then(|| [outer, averages + 1 - outer].map(|k| kth_average(&sorted, k) + 0.0));
    let mean = differences.iter().sum::<f64>() / n as f64;
    let mean_ci95 = (nonzero >= ENOUGH_FOR_A_MEAN).then(|| {
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
        let t =
            StudentsT::new(0.0, 1.0, (n - 1) as f64).map_or(f64::NAN, |law| law.inverse_cdf(0.975));
        let half = t * (variance / n as f64).sqrt();
        [mean - half, mean + half]
    });
    Some(Shift {
        pairs: n as u64,
        nonzero,
        p,
        median,
        mean,
        ci95,
        mean_ci95,
    })
}

/// Two-sided p-value of the signed ranks, and the number of differences that are not zero.
fn p_value(sorted: &[f64]) -> (f64, u64) {
    let tie = TIE * sorted[0].abs().max(sorted[sorted.len() - 1].abs());
    let mut nonzero: Vec<f64> = sorted.iter().copied().filter(|d| d.abs() > tie).collect();
    nonzero.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = nonzero.len();
    if n == 0 {
        return (1.0, 0);
    }
    let (mut positive, mut ties, mut first) = (0.0, 0.0, 0);
    while first < n {
        let tied = nonzero[first..]
            .iter()
            .take_while(|d| d.abs() - nonzero[first].abs() <= tie);
        let (count, ups) = tied.fold((0, 0), |(count, ups), d| {
            (count + 1, ups + u64::from(*d > 0.0))
        });
        let t = count as f64;
        positive += ups as f64 * (first as f64 + (t + 1.0) / 2.0);
        ties += t * (t * t - 1.0);
        first += count;
    }
    let all = n as f64 * (n as f64 + 1.0) / 2.0;
    let p = if n <= EXACT && ties == 0.0 {
        let least = positive.min(all - positive) as usize;
        2.0 * rank_sums(n)[..=least].iter().sum::<f64>()
    } else {
        let variance = all * (2.0 * n as f64 + 1.0) / 12.0 - ties / 48.0;
        let z = ((positive - all / 2.0).abs() - 0.5).max(0.0) / variance.sqrt();
        // With erfc, small p-values keep their digits.
        erfc(z / SQRT_2)
    };
    (p.min(1.0), n as u64)
}

/// Probabilities of the sums 0, 1, ... of the ranks with a positive sign, of ranks 1 to `n`, if either sign is equally
/// likely.
fn rank_sums(n: usize) -> Vec<f64> {
    let mut chance = vec![0.0; n * (n + 1) / 2 + 1];
    chance[0] = 1.0;
    for rank in 1..=n {
        for sum in (0..chance.len()).rev() {
            chance[sum] = 0.5 * (chance[sum] + if sum < rank { 0.0 } else { chance[sum - rank] });
        }
    }
    chance
}

/// Number of the average (1 is the lowest) at which the 95 % interval begins; it ends at the mirror image. 0 if there
/// are too few averages.
fn lowest_kept(n: usize) -> u64 {
    if n <= EXACT {
        let mut below = 0.0;
        let sums = rank_sums(n).into_iter();
        let unlikely = sums.take_while(|chance| {
            below += chance;
            below <= 0.025
        });
        return unlikely.count() as u64;
    }
    let (n, z) = (n as f64, Normal::standard().inverse_cdf(0.975));
    let all = n * (n + 1.0) / 2.0;
    (all / 2.0 - z * (all * (2.0 * n + 1.0) / 12.0).sqrt()).floor() as u64
}

/// The `k`-th lowest (from 1) of the means of two sorted values, including each value with itself.
fn kth_average(sorted: &[f64], k: u64) -> f64 {
    // Bisection over integers that are ordered as the floats are: 64 steps end at the average itself, to the last bit.
    let (mut low, mut high) = (place(sorted[0]), place(sorted[sorted.len() - 1]));
    while low < high {
        let middle = low + (high - low) / 2;
        if averages_up_to(sorted, at(middle)) >= k {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    at(low)
}

/// Number of means of two sorted values, including each value with itself, that are at most `bound`.
fn averages_up_to(sorted: &[f64], bound: f64) -> u64 {
    let (mut count, mut partners) = (0, sorted.len());
    for (i, value) in sorted.iter().enumerate() {
        // The larger this value, the fewer partners it has. Pairs with earlier values are already counted.
        while partners > i && 0.5 * value + 0.5 * sorted[partners - 1] > bound {
            partners -= 1;
        }
        if partners <= i {
            break;
        }
        count += (partners - i) as u64;
    }
    count
}

/// Integers in the order of the finite floats, with -0 just before 0.
fn place(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 {
        !bits
    } else {
        bits | 1 << 63
    }
}

/// The float with this [`place`].
fn at(place: u64) -> f64 {
    f64::from_bits(if place >> 63 == 1 {
        place & !(1 << 63)
    } else {
        !place
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    const DEPRESSION: [f64; 9] = [0.952, -0.147, 1.022, 0.43, 0.62, 0.59, 0.49, -0.08, 0.01];
    const TIED: [f64; 13] = [
        1.0, 2.0, 2.0, -1.0, 3.0, -2.0, 4.0, 4.0, -3.0, 5.0, 0.0, 0.0, 6.0,
    ];

    fn integers(n: i64, factor: i64, modulus: i64, less: i64, unit: f64) -> Vec<f64> {
        (0..n)
            .map(|i| ((i * factor) % modulus - less) as f64 / unit)
            .collect()
    }

    // Expected values: scipy 1.17.1, `wilcoxon(d, zero_method="wilcox", method="exact")`; of tied differences and of
    // more than 50, `method="approx", correction=True`.
    #[test]
    fn p_is_that_of_scipy() {
        let twelve = [
            0.12, -0.03, 0.44, 0.08, -0.21, 0.35, 0.52, -0.11, 0.27, 0.61, 0.05, -0.36,
        ];
        for (differences, expected) in [
            (DEPRESSION.to_vec(), 0.0390625),
            (twelve.to_vec(), 0.1513671875),
            (vec![1.0, 2.0, 3.0, 4.0, 5.0], 0.0625),
            (vec![0.0, 0.0, 0.5, -1.5, 2.5, 3.5, 4.25, -0.25], 0.21875),
            (
                integers(50, 104_729, 5003, 2300, 1000.0),
                0.02898427633581413,
            ),
            (TIED.to_vec(), 0.06739827188482482),
            (
                integers(60, 104_729, 5003, 2300, 1000.0),
                0.09690610880588489,
            ),
            (
                integers(51, 104_729, 5003, 2300, 1000.0),
                0.024176120604875274,
            ),
            (
                integers(3000, 7919, 1009, 470, 100.0),
                6.001050676751962e-10,
            ),
        ] {
            let found = signed_rank(&differences).unwrap().p;
            assert!(
                (found - expected).abs() < 1e-10 * expected,
                "{found} is not {expected}"
            );
        }
    }

    #[test]
    fn zeros_are_no_evidence_and_five_pairs_give_no_interval() {
        let shift = signed_rank(&[0.0; 9]).unwrap();
        assert_eq!(
            (
                shift.pairs,
                shift.nonzero,
                shift.p,
                shift.median,
                shift.ci95
            ),
            (9, 0, 1.0, 0.0, Some([0.0; 2]))
        );
        let shift = signed_rank(&TIED).unwrap();
        assert_eq!((shift.pairs, shift.nonzero), (13, 11));
        assert_eq!(
            (signed_rank(&[]), signed_rank(&[1.0, f64::NAN])),
            (None, None)
        );
        // Ties up to rounding are ties.
        let ticks = [1.1 - 1.0, 0.4 - 0.3, 0.1, -(2.1 - 2.0), 0.7 - 0.6, 0.2, 0.3];
        assert_eq!(
            signed_rank(&ticks).unwrap().p,
            signed_rank(&[0.1, 0.1, 0.1, -0.1, 0.1, 0.2, 0.3])
                .unwrap()
                .p
        );
        assert_eq!(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap().ci95, None);
        assert_eq!(
            signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap().ci95,
            Some([1.0, 6.0])
        );
    }

    // Expected values: Python 3 `statistics.fmean` and `stdev`, with 2.000995378088259 as the 97.5 % quantile of
    // Student's t with 59 degrees of freedom.
    #[test]
    fn the_interval_of_the_mean_is_that_of_student() {
        let differences = integers(60, 104_729, 5003, 2300, 1000.0);
        let [low, high] = signed_rank(&differences).unwrap().mean_ci95.unwrap();
        assert!(
            (low + 0.10648452628821).abs() < 1e-9 && (high - 0.6487178596215435).abs() < 1e-9,
            "{low} {high}"
        );
        assert_eq!(signed_rank(&differences[..19]).unwrap().mean_ci95, None);
    }

    /// Most differences of footsteps are 0, some are 1 or 2, and few are 4.
    #[test]
    fn the_interval_of_a_mean_holds_though_most_differences_are_zero() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (n, rare) in [(100, 1.0), (300, 0.5), (1000, 0.2), (1000, 0.1)] {
            // One footstep more in one of ten trials, one less in one of twenty, four more in one of fifty.
            let truth = rare * (0.1 - 0.05 + 4.0 * 0.02);
            let mut intervals = Vec::new();
            for _ in 0..3000 {
                let differences: Vec<f64> = (0..n)
                    .map(|_| match rng.random::<f64>() / rare {
                        u if u < 0.1 => 1.0,
                        u if u < 0.15 => -1.0,
                        u if u < 0.17 => 4.0,
                        _ => 0.0,
                    })
                    .collect();
                intervals.extend(signed_rank(&differences).unwrap().mean_ci95);
            }
            let held = intervals
                .iter()
                .filter(|[low, high]| (*low..=*high).contains(&truth))
                .count();
            assert!(
                intervals.len() > 500 && held as f64 > 0.93 * intervals.len() as f64,
                "{n} {rare}: {held}"
            );
        }
    }

    #[test]
    fn shift_and_interval_are_averages_found_by_brute_force() {
        // One more than the largest sum of ranks with a probability of at most 2.5 %: from tables 5 for 9 pairs, 17 for
        // 13 and 434 for 50. For 200 it is 10050 - 1.96 * 819.9.
        for (differences, kept) in [
            (DEPRESSION.to_vec(), 6),
            (TIED.to_vec(), 18),
            (integers(50, 104_729, 5003, 2300, 1000.0), 435),
            (integers(200, 7919, 1009, 430, 100.0), 8443),
        ] {
            let mut averages = Vec::new();
            for (i, a) in differences.iter().enumerate() {
                averages.extend(differences[i..].iter().map(|b| 0.5 * a + 0.5 * b));
            }
            averages.sort_by(f64::total_cmp);
            let (n, shift) = (averages.len(), signed_rank(&differences).unwrap());
            assert_eq!(
                shift.median,
                0.5 * averages[(n - 1) / 2] + 0.5 * averages[n / 2]
            );
            assert_eq!(shift.ci95, Some([averages[kept - 1], averages[n - kept]]));
        }
    }
}
