//! A sheet of pushes whose outcomes were predicted: which pushes to choose for it, and whether what was observed agrees.
//!
//! The chances of the pushes differ, so the number that is survived has a Poisson-binomial distribution. All
//! probabilities here are sums over that distribution or over all outcomes of the sheet, without an approximation. They
//! take the pushes as independent of each other.
//!
//! A robot that differs from the prediction is described by one number, the *scale* of its limits: with a scale of 0.8 it
//! survives 8 N s as often as predicted for 10 N s.

use serde::Serialize;

/// Most pushes of a sheet: there are 2 to this power outcomes, all of which are counted.
pub const MOST_PUSHES: usize = 16;
/// Scales beyond which no interval reaches.
const MOST_SCALE: f64 = 4.0;
/// Bisections of the logarithms of the scales, which give an end to 1e-15.
const HALVINGS: usize = 52;

/// The predicted chance of survival of a push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// From 0 to 1, both excluded.
    pub predicted: f64,
    /// The least chance of any push, and by how much the chance of any push is below 1.
    pub lapse: f64,
    /// By how much the log odds of survival rise if the logarithm of the scale rises by 1.
    pub slope: f64,
    /// Logarithm of the ratio of the limit to the impulse. It says how far a push is from the limit if its chance is so near
    /// to the lapse that the chance does not.
    pub below_limit: f64,
}

impl Chance {
    /// The chance with another scale of the limits: `lapse + (1 - 2 lapse) / (1 + exp(-odds))`, with log odds that rise by
    /// the slope.
    pub fn at(self, scale: f64) -> f64 {
        /// Shares without the lapse below which they say no more than that they are small.
        const SMALL: f64 = 1e-3;
        let share = (self.predicted - self.lapse) / (1.0 - 2.0 * self.lapse);
        let by_limit = self.slope * self.below_limit;
        let sure = (SMALL / (1.0 - SMALL)).ln();
        let odds = if share < SMALL {
            by_limit.min(sure)
        } else if share > 1.0 - SMALL {
            by_limit.max(-sure)
        } else {
            (share / (1.0 - share)).ln()
        };
        let odds = odds + self.slope * scale.ln();
        self.lapse + (1.0 - 2.0 * self.lapse) / (1.0 + (-odds).exp())
    }
}

/// Probabilities that 0, 1, ..., n of n independent events happen, which have these chances.
pub fn poisson_binomial(chances: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut counts = vec![1.0];
    for chance in chances {
        counts.push(0.0);
        for count in (0..counts.len()).rev() {
            let one_less = if count > 0 { counts[count - 1] } else { 0.0 };
            counts[count] = counts[count] * (1.0 - chance) + one_less * chance;
        }
    }
    counts
}

/// What was observed against what was predicted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Agreement {
    pub pushes: usize,
    pub survived: usize,
    /// Mean of the predicted number of survivals.
    pub expected: f64,
    /// Probabilities of so few survivals or fewer, and of so many or more, by the prediction.
    pub so_few_p: f64,
    pub so_many_p: f64,
    /// Logarithm of the probability of what was observed, and its mean, by the prediction.
    pub log_likelihood: f64,
    pub expected_log_likelihood: f64,
    /// Probability of an outcome that is as improbable or more, by the prediction.
    pub so_unlikely_p: f64,
    /// Exact interval of the scale of the limits at 95 %; an end is None if nothing bounds it.
    pub scale_ci95: [Option<f64>; 2],
}

/// Compares outcomes (whether each push was survived) with their chances. There are from 1 to [`MOST_PUSHES`] of them.
pub fn agreement(pushes: &[(Chance, bool)]) -> Agreement {
    let chances: Vec<f64> = pushes.iter().map(|(chance, _)| chance.predicted).collect();
    let survived = pushes.iter().filter(|(_, survived)| *survived).count();
    let counts = poisson_binomial(chances.iter().copied());
    let outcome: usize = (0..pushes.len())
        .map(|push| usize::from(pushes[push].1) << push)
        .sum();
    let log_likelihoods = log_likelihoods(&chances);
    let log_likelihood = log_likelihoods[outcome];
    // Outcomes that are equally probable may differ in the last digits.
    let as_unlikely = log_likelihoods
        .iter()
        .filter(|other| **other <= log_likelihood + 1e-9);
    let tail = |scale: f64, counted: std::ops::RangeInclusive<usize>| -> f64 {
        let counts = poisson_binomial(pushes.iter().map(|(chance, _)| chance.at(scale)));
        counts[counted].iter().sum()
    };
    let n = pushes.len();
    let least = (survived > 0)
        .then(|| scale_where(|scale| tail(scale, survived..=n) < 0.025))
        .flatten();
    let most = (survived < n)
        .then(|| scale_where(|scale| tail(scale, 0..=survived) > 0.025))
        .flatten();
    Agreement {
        pushes: n,
        survived,
        expected: chances.iter().sum(),
        so_few_p: counts[..=survived].iter().sum::<f64>().min(1.0),
        so_many_p: counts[survived..].iter().sum::<f64>().min(1.0),
        log_likelihood,
        expected_log_likelihood: log_likelihoods.iter().map(|log| log * log.exp()).sum(),
        so_unlikely_p: as_unlikely.map(|log| log.exp()).sum::<f64>().min(1.0),
        scale_ci95: [least, most],
    }
}

/// The chance that [`agreement`] finds fewer survivals than predicted (with `so_few_p` below 2.5 %), if the limits have
/// this scale.
pub fn power(chances: &[Chance], scale: f64) -> f64 {
    let predicted = poisson_binomial(chances.iter().map(|chance| chance.predicted));
    let scaled = poisson_binomial(chances.iter().map(|chance| chance.at(scale)));
    let (mut so_few_p, mut power) = (0.0, 0.0);
    for (predicted, scaled) in predicted.iter().zip(scaled) {
        so_few_p += predicted;
        if so_few_p < 0.025 {
            power += scaled;
        }
    }
    power
}

/// The scale up to which `is_below` is true. None if that is so everywhere or nowhere.
fn scale_where(is_below: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut low, mut high) = (-MOST_SCALE.ln(), MOST_SCALE.ln());
    if !is_below(low.exp()) || is_below(high.exp()) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_below(middle.exp()) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some((0.5 * (low + high)).exp())
}

/// The log likelihoods of all outcomes: bit i of an outcome's number says whether push i is survived.
fn log_likelihoods(chances: &[f64]) -> Vec<f64> {
    let mut logs = vec![0.0];
    for chance in chances {
        let lost = logs.iter().map(|log| log + (-chance).ln_1p());
        let survived = logs.iter().map(|log| log + chance.ln());
        logs = lost.chain(survived).collect();
    }
    logs
}

/// Scales that are equally probable before anything was observed: from 2/3 to 3/2, evenly in the logarithm.
const SCALES: usize = 17;

/// Chooses `count` of these pushes, at most `most_of_group` of each group, and returns their numbers in the order of the
/// choice. Each is the one that adds most to what the outcomes of all chosen tell of the scale (mutual information).
/// `pushes` are chances with their groups. There may be fewer than asked for.
pub fn most_telling(pushes: &[(Chance, usize)], count: usize, most_of_group: usize) -> Vec<usize> {
    let scales: [f64; SCALES] =
        std::array::from_fn(|i| 1.5_f64.powf(2.0 * i as f64 / (SCALES - 1) as f64 - 1.0));
    let at_scales = |chance: Chance| scales.map(|scale| chance.at(scale));
    let mut chosen: Vec<usize> = Vec::new();
    // For each outcome of the chosen pushes, its probability at each scale.
    let mut outcomes = vec![[1.0; SCALES]];
    while chosen.len() < count {
        let mut best: Option<(f64, usize)> = None;
        for (number, (chance, group)) in pushes.iter().enumerate() {
            let of_group = chosen.iter().filter(|one| pushes[**one].1 == *group);
            if chosen.contains(&number) || of_group.count() >= most_of_group {
                continue;
            }
            let told = told(&outcomes, &at_scales(*chance));
            if best.is_none_or(|(most, _)| told > most) {
                best = Some((told, number));
            }
        }
        let Some((_, number)) = best else { break };
        let chances = at_scales(pushes[number].0);
        let mut longer = Vec::new();
        for outcome in &outcomes {
            longer.push(std::array::from_fn(|i| outcome[i] * chances[i]));
            longer.push(std::array::from_fn(|i| outcome[i] * (1.0 - chances[i])));
        }
        outcomes = longer;
        chosen.push(number);
    }
    chosen
}

/// The entropy of the outcomes and one more push, less its mean at a known scale, but for what is the same for every push.
fn told(outcomes: &[[f64; SCALES]], chances: &[f64; SCALES]) -> f64 {
    let entropy = |p: f64| if p > 0.0 { -p * p.ln() } else { 0.0 };
    let mut told = 0.0;
    for outcome in outcomes {
        let (mut survived, mut all) = (0.0, 0.0);
        for i in 0..SCALES {
            survived += outcome[i] * chances[i];
            all += outcome[i];
        }
        told += entropy(survived / SCALES as f64) + entropy((all - survived) / SCALES as f64);
    }
    for chance in chances {
        told -= (entropy(*chance) + entropy(1.0 - chance)) / SCALES as f64;
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rate::clopper_pearson;
    use statrs::distribution::{Binomial, Discrete};

    fn sheet(predicted: &[f64], slope: f64) -> Vec<Chance> {
        let chance = |&predicted| Chance {
            predicted,
            lapse: 0.0,
            slope,
            below_limit: 0.0,
        };
        predicted.iter().map(chance).collect()
    }

    fn observed(chances: &[Chance], survived: &[bool]) -> Agreement {
        let pushes: Vec<_> = chances
            .iter()
            .copied()
            .zip(survived.iter().copied())
            .collect();
        agreement(&pushes)
    }

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() < 1e-12,
            "{found} is not {expected}"
        );
    }

    /// By hand: 0.9, 0.5 and 0.2.
    #[test]
    fn counts_are_the_sums_over_all_outcomes() {
        let counts = poisson_binomial([0.9, 0.5, 0.2]);
        for (found, expected) in counts.into_iter().zip([0.04, 0.41, 0.46, 0.09]) {
            near(found, expected);
        }
        let binomial = Binomial::new(0.3, 12).unwrap();
        for (count, found) in poisson_binomial([0.3; 12]).into_iter().enumerate() {
            near(found, binomial.pmf(count as u64));
        }
        assert_eq!(poisson_binomial([]), [1.0]);
    }

    /// By hand, for chances of 0.9, 0.5 and 0.2: the outcome lost, survived, lost has 0.1 x 0.5 x 0.8 = 0.04. As improbable
    /// or more are lost, any, lost (2 x 0.04) and lost, any, survived (2 x 0.01): 0.1 in all.
    #[test]
    fn probabilities_of_what_was_observed() {
        let found = observed(&sheet(&[0.9, 0.5, 0.2], 10.0), &[false, true, false]);
        assert_eq!((found.pushes, found.survived), (3, 1));
        for (found, expected) in [
            (found.expected, 1.6),
            (found.so_few_p, 0.45),
            (found.so_many_p, 0.96),
            (found.log_likelihood, 0.04_f64.ln()),
            (found.so_unlikely_p, 0.1),
            (
                found.expected_log_likelihood,
                0.9 * 0.9_f64.ln()
                    + 0.1 * 0.1_f64.ln()
                    + 0.5_f64.ln()
                    + 0.2 * 0.2_f64.ln()
                    + 0.8 * 0.8_f64.ln(),
            ),
        ] {
            near(found, expected);
        }
    }

    /// With equal chances of a half and a slope of 1, the odds are the scale, so its interval is that of a rate.
    #[test]
    fn the_interval_of_the_scale_is_exact() {
        let found = observed(
            &sheet(&[0.5; 8], 1.0),
            &[true, true, true, false, false, false, true, true],
        );
        let expected = clopper_pearson(5, 8, 0.95).map(|rate| rate / (1.0 - rate));
        assert_eq!(
            found.scale_ci95[1], None,
            "{expected:?} is beyond {MOST_SCALE}"
        );
        assert!((found.scale_ci95[0].unwrap() - expected[0]).abs() < 1e-9);
        let found = observed(&sheet(&[0.5; 8], 5.0), &[false; 8]);
        let rate = clopper_pearson(0, 8, 0.95)[1];
        let expected = (rate / (1.0 - rate)).powf(0.2);
        assert_eq!(found.scale_ci95[0], None);
        assert!((found.scale_ci95[1].unwrap() - expected).abs() < 1e-9);
    }

    /// A push at half of the limit that all replicas survive is still survived if the limit is a fifth lower.
    #[test]
    fn a_push_far_from_the_limit_needs_a_large_change_of_the_limit() {
        let far = Chance {
            predicted: 0.98,
            lapse: 0.02,
            slope: 20.0,
            below_limit: 2.0_f64.ln(),
        };
        near(far.at(0.5), 0.5);
        assert!(far.at(0.8) > 0.97 && far.at(0.4) < 0.05 && far.at(1.0) < 0.9801);
        let beyond = Chance {
            predicted: 0.02,
            below_limit: -2.0_f64.ln(),
            ..far
        };
        near(beyond.at(2.0), 0.5);
        let inside = Chance {
            predicted: 0.5,
            ..far
        };
        near(inside.at(1.0), 0.5);
    }

    /// The interval misses the truth in 5 % of sheets or fewer, whatever the scale.
    #[test]
    fn the_interval_holds_the_truth() {
        let chances = sheet(&[0.95, 0.9, 0.7, 0.5, 0.5, 0.3, 0.2, 0.1], 12.0);
        for scale in [0.7, 0.9, 1.0, 1.2] {
            let mut missed = 0.0;
            for outcome in 0..1_u32 << chances.len() {
                let survived: Vec<bool> =
                    (0..chances.len()).map(|i| outcome >> i & 1 == 1).collect();
                let mut probability = 1.0;
                for (chance, survived) in chances.iter().zip(&survived) {
                    let chance = chance.at(scale);
                    probability *= if *survived { chance } else { 1.0 - chance };
                }
                let [least, most] = observed(&chances, &survived).scale_ci95;
                let is_within = least.is_none_or(|least| least <= scale)
                    && most.is_none_or(|most| scale <= most);
                missed += if is_within { 0.0 } else { probability };
            }
            assert!(missed < 0.05 && missed > 0.001, "{scale}: {missed}");
        }
    }

    /// Of four pushes with a chance of a half each, only no survival is improbable enough if there are six of them.
    #[test]
    fn the_power_is_the_chance_of_a_count_that_is_too_small() {
        near(power(&sheet(&[0.5; 4], 1.0), 1.0), 0.0);
        near(power(&sheet(&[0.5; 6], 1.0), 1.0), 0.5_f64.powi(6));
        // Odds of 1 to 4 at a scale of a half.
        near(power(&sheet(&[0.5; 6], 2.0), 0.5), 0.8_f64.powi(6));
    }

    /// A push whose outcome is sure tells nothing, nor does one whose chance is the same for every scale.
    #[test]
    fn the_pushes_that_tell_most_are_chosen() {
        let mut pushes: Vec<(Chance, usize)> = sheet(&[0.5, 1.0 - 1e-12, 0.5, 0.5], 12.0)
            .into_iter()
            .zip([0, 0, 1, 1])
            .collect();
        pushes[2].0.slope = 0.0;
        assert_eq!(most_telling(&pushes, 2, 2), [0, 3]);
        assert_eq!(most_telling(&pushes, 9, 1), [0, 3]);
        assert_eq!(most_telling(&pushes, 9, 9).len(), 4);
        // A second push at the same limit tells less than one at another impulse.
        let pushes: Vec<(Chance, usize)> = sheet(&[0.5, 0.5, 0.1], 30.0)
            .into_iter()
            .map(|chance| (chance, 0))
            .collect();
        assert_eq!(most_telling(&pushes, 2, 2), [0, 2]);
    }
}
