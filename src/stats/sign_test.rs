//! The exact test that one of two gain sets is better, at several looks.
//!
//! Only trials that one set recovers from and the other does not tell the two apart. If neither is better, each of
//! these
//! *discordant* trials falls to either set as the throw of a fair coin does, independently of the others and of which
//! trials they are. So, given how many discordant trials there are at each look, the chance of every course of the
//! counts is known, whatever the share of discordant trials is. `SignTest` follows all courses that have not been
//! decided yet: it holds the chance of each count of the trials that fell to a. At a look it decides for the counts
//! that lie farthest from a half, on both sides alike, and for as many of them as the error that may be spent by then
//! allows. The limits depend on the counts of discordant trials up to that look alone, not on later ones. If no set is
//! better, the chance of ever deciding is therefore at most the error that is spent. If one is better, the chance of
//! deciding for the other is at most half of it, since each course that leads there only becomes less likely.
//!
//! Simulated, with two gain sets and the looks of [`Looks`] (1000 campaigns each; *power* is the share that finds the
//! better set; *betting* decides by the intervals of [`sequential`](crate::sequential) instead):
//!
//! | truth | planned | trials | power | trials by betting | its power |
//! |---|---|---|---|---|---|
//! | 5 points of 10 % discordant | 870 | 340 | 0.99 | 456 | 0.95 |
//! | the same | 600 | 312 | 0.94 | 416 | 0.80 |
//! | 8 points of 12 % | 200 | 130 | 0.88 | 163 | 0.60 |
//! | 3 points of 10 % | 1000 | 673 | 0.76 | 836 | 0.48 |
//! | 27 points of 30 % | 2000 | 57 | 1.00 | 53 | 1.00 |
//! | no difference, 10 % | 870 | 850 | 0.047 | 865 | 0.011 |
//!
//! In the last row, the power is the error. Only where a large difference is met by a plan for many trials is betting
//! as quick.

use crate::looks::Looks;
use crate::mcnemar::PairedCounts;

/// Chance below which a count is not followed any further. It is taken to be decided wrongly, which can only make the
/// test more careful. All such counts together have less than 1e-14 in 100,000 trials.
const NEGLIGIBLE: f64 = 1e-20;
/// Number of trials after which negligible counts are removed.
const TRIALS_TO_TRIM: u64 = 32;

/// A decision that one of two controllers is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Winner {
    pub is_a: bool,
    /// Number of trials at the look.
    pub trials: u64,
}

/// The first look at which one of two controllers is better, from the counts at each of `looks` (in order, each with
/// the trials of the earlier ones). `error` is the chance (a share) of a wrong decision, of both sides together, at all
/// looks that there may ever be.
pub fn first_decision(counts: &[PairedCounts], looks: Looks, error: f64) -> Option<Winner> {
    let mut test = SignTest::default();
    counts.iter().find_map(|look| {
        let is_a = test.look(look.only_a, look.only_b, error * looks.spent(look.trials()))?;
        Some(Winner {
            is_a,
            trials: look.trials(),
        })
    })
}

/// The courses of fair throws that are not decided yet.
#[derive(Debug, Clone)]
struct SignTest {
    discordant: u64,
    /// Chance of each number of trials that fell to a, from the number `first` on.
    chances: Vec<f64>,
    first: u64,
    /// Chance of all courses that are decided.
    spent: f64,
}

impl Default for SignTest {
    fn default() -> Self {
        Self {
            discordant: 0,
            chances: vec![1.0],
            first: 0,
            spent: 0.0,
        }
    }
}

impl SignTest {
    /// Whether a (true) or b (false) is decided to be better at a look at these counts of discordant trials, if `error`
    /// may be spent in all by now. It is not to be called after a decision.
    fn look(&mut self, only_a: u64, only_b: u64, error: f64) -> Option<bool> {
        while self.discordant < only_a + only_b {
            self.throw();
            if self.discordant.is_multiple_of(TRIALS_TO_TRIM) {
                self.cut(|chance, _| chance < NEGLIGIBLE);
            }
        }
        self.cut(|_, spent| spent <= error);
        let end = self.first + self.chances.len() as u64;
        match only_a {
            a if a >= end => Some(true),
            a if a < self.first => Some(false),
            _ => None,
        }
    }

    /// One more discordant trial.
    fn throw(&mut self) {
        self.discordant += 1;
        self.chances.push(0.0);
        let mut before = 0.0;
        for chance in &mut self.chances {
            (before, *chance) = (*chance, 0.5 * (before + *chance));
        }
    }

    /// Removes the same number of counts at both ends, as long as `such` is true for the chance of one count and for
    /// the sum of the spent error and the chance of both counts.
    fn cut(&mut self, such: impl Fn(f64, f64) -> bool) {
        let mut count = 0;
        while 2 * (count + 1) < self.chances.len()
            && such(self.chances[count], self.spent + 2.0 * self.chances[count])
        {
            self.spent += 2.0 * self.chances[count];
            count += 1;
        }
        self.chances.truncate(self.chances.len() - count);
        self.chances.drain(..count);
        self.first += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Expected values: another implementation, by convolution with `scipy.stats.binom.pmf`, in scipy 1.17.1, numpy
    // 2.4.6: planned trials, error, discordant trials at each look, the least difference of the two counts that is
    // decided there, and the error that is spent in all.
    type KnownLimits = (u64, f64, &'static [u64], &'static [u64], f64);
    #[rustfmt::skip]
    const LIMITS: [KnownLimits; 4] = [
        (870, 0.05, &[3, 6, 7, 9, 11, 16, 22, 31, 38, 49, 60, 77, 90],
            &[5, 8, 9, 9, 11, 12, 14, 15, 18, 19, 20, 23, 24], 0.04094065962693744),
        (1000, 0.05 / 6.0, &[9, 17, 25, 33, 40, 60, 77, 100, 130, 160, 200, 245, 300, 313],
            &[11, 15, 19, 21, 22, 26, 31, 34, 38, 42, 46, 49, 54, 57], 0.007246513115712722),
        // Beyond what was planned, and with no discordant trial between two looks.
        (50, 0.05, &[10, 20, 20, 33, 40, 60], &[8, 12, 12, 15, 16, 22], 0.047277398440487284),
        (4000, 0.05 / 190.0, &[10, 20, 30, 40, 50, 70, 90, 120, 150, 190, 240, 300, 380, 480, 600, 750, 940, 1180, 1480, 1600],
            &[12, 20, 24, 30, 32, 38, 44, 50, 54, 62, 68, 76, 84, 94, 104, 114, 128, 142, 156, 164], 0.00023675465719785524),
    ];

    #[test]
    fn limits_are_those_of_another_implementation() {
        for (planned, error, discordant, expected, spent) in LIMITS {
            let (looks, mut test) = (Looks::up_to(planned), SignTest::default());
            for ((trials, discordant), expected) in
                looks.until(u64::MAX).zip(discordant).zip(expected)
            {
                // The counts are as even as can be, so that nothing is decided.
                let found = test.look(
                    discordant / 2,
                    discordant - discordant / 2,
                    error * looks.spent(trials),
                );
                assert_eq!(
                    (found, discordant + 2 - 2 * test.first),
                    (None, *expected),
                    "{planned}: {trials}"
                );
            }
            assert!(
                (test.spent - spent).abs() < 1e-14,
                "{planned}: {}",
                test.spent
            );
        }
    }

    /// Counts that are too unlikely to be followed change no limit of a long campaign, and cost next to nothing.
    #[test]
    fn what_is_not_followed_is_negligible() {
        let (looks, mut test) = (Looks::up_to(40_000), SignTest::default());
        for trials in looks.until(40_000) {
            assert_eq!(
                test.look(
                    trials / 5,
                    trials * 2 / 5 - trials / 5,
                    0.05 * looks.spent(trials)
                ),
                None
            );
        }
        let all: f64 = test.chances.iter().sum::<f64>() + test.spent;
        assert!(
            (all - 1.0).abs() < 1e-11 && test.chances.len() < 1000,
            "{all}"
        );
        assert!((0.044..=0.045).contains(&test.spent), "{}", test.spent);
    }
}
