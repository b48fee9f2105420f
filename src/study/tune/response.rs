//! What each number does to the success rate: a quadratic that is fitted to all candidates of a search.
//!
//! A generation is judged by so few trials that its ranks are mostly chance, but all generations together tell more. The
//! rate is taken as a sum over all numbers of `slope d + bend d^2`, with d the share of its range by which a number differs
//! from the incumbent's, and of a constant for each generation, since some have harder trials. Slopes and bends are supposed
//! to be normally distributed about zero, so the fit is a ridge regression (Hoerl and Kennard 1970), in which a candidate
//! counts by the inverse square of its standard error.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Standard deviations of slopes and bends before anything is known: the share of the trials that a whole range is worth.
const SLOPE: f64 = 0.3;
const BEND: f64 = 1.0;

/// A candidate that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Of each range.
    pub shares: Vec<f64>,
    /// Its rate in its generation, up to a constant, and the standard error of that.
    pub rate: f64,
    pub error: f64,
}

/// What a number does to the rate, as fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Effect {
    /// By which share of the trials the rate grows along the whole range, and how that changes.
    pub slope: f64,
    pub bend: f64,
    /// What its proposed value alone gains, as a share of the trials, and the standard error of that.
    pub alone: f64,
    pub error: f64,
}

impl Effect {
    /// What the rate gains where the number differs from the incumbent's by this share of its range.
    pub fn gain(&self, off: f64) -> f64 {
        (self.slope + self.bend * off) * off
    }
}

/// The fitted quadratic.
#[derive(Debug, Clone)]
pub struct Response {
    start: Vec<f64>,
    /// All slopes, then all bends.
    fitted: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Where each number was tried: mean and standard deviation of the shares.
    tried: Vec<[f64; 2]>,
}

impl Response {
    /// Fits what was tried around an incumbent, generation by generation. It is None without any.
    pub fn fit(start: &[f64], generations: &[Vec<Tried>]) -> Option<Self> {
        let n = start.len();
        let mut precision =
            DMatrix::from_diagonal(&DVector::from_fn(2 * n, |i, _| if i < n { SLOPE } else { BEND }.powi(-2)));
        let mut sum = DVector::zeros(2 * n);
        for generation in generations {
            let off = |one: &Tried, i: usize| one.shares[i] - start[i];
            let terms =
                |one: &Tried| DVector::from_fn(2 * n, |i, _| if i < n { off(one, i) } else { off(one, i - n).powi(2) });
            let rows: Vec<_> = generation.iter().map(|one| (one.error.powi(-2), terms(one), one.rate)).collect();
            // What all of a generation have in common is left out, and with it the constant.
            let all: f64 = rows.iter().map(|(weight, ..)| weight).sum();
            let common = rows.iter().fold(DVector::zeros(2 * n), |sum, (weight, terms, _)| sum + *weight / all * terms);
            let common_rate: f64 = rows.iter().map(|(weight, _, rate)| weight / all * rate).sum();
            for (weight, terms, rate) in &rows {
                let own = terms - &common;
                precision.ger(*weight, &own, &own, 1.0);
                sum.axpy(weight * (rate - common_rate), &own, 1.0);
            }
        }
        let covariance = precision.cholesky()?.inverse();
        let tried: Vec<&Tried> = generations.iter().flatten().collect();
        let count = tried.len() as f64;
        let spread = |i: usize| {
            let mean = tried.iter().map(|one| one.shares[i]).sum::<f64>() / count;
            let variance = tried.iter().map(|one| (one.shares[i] - mean).powi(2)).sum::<f64>() / count;
            [mean, variance.sqrt()]
        };
        let (fitted, tried) = (&covariance * sum, (0..n).map(spread).collect());
        (count > 0.0).then(|| Self { start: start.to_vec(), fitted, covariance, tried })
    }

    /// What a number does, and what the incumbent gains with it alone at another share of its range.
    pub fn effect(&self, number: usize, share: f64) -> Effect {
        let (at, off) = ([number, self.start.len() + number], share - self.start[number]);
        let terms = [off, off * off];
        let of_pair = |(i, j): (usize, usize)| terms[i] * terms[j] * self.covariance[(at[i], at[j])];
        let variance: f64 = [(0, 0), (0, 1), (1, 0), (1, 1)].map(of_pair).iter().sum();
        let [slope, bend] = at.map(|i| self.fitted[i]);
        let effect = Effect { slope, bend, alone: 0.0, error: variance.max(0.0).sqrt() };
        Effect { alone: effect.gain(off), ..effect }
    }

    /// By how much samples with this spread in every number are worse on average than the one in their middle.
    pub fn loss(&self, spread: f64) -> f64 {
        -self.fitted.rows(self.start.len(), self.start.len()).sum() * spread * spread
    }

    /// The shares at which it is greatest, each within a standard deviation of where it was tried.
    pub fn best(&self) -> Vec<f64> {
        let best = |i: usize| {
            let [mean, deviation] = self.tried[i];
            let effect = self.effect(i, mean);
            let [from, to] = [mean - deviation, mean + deviation].map(|share| share.clamp(0.0, 1.0));
            let top = (effect.bend < 0.0).then(|| (self.start[i] - 0.5 * effect.slope / effect.bend).clamp(from, to));
            let choices = [from, to].into_iter().chain(top);
            let gain = |share: &f64| effect.gain(share - self.start[i]);
            choices.max_by(|a, b| gain(a).total_cmp(&gain(b))).unwrap_or(mean)
        };
        (0..self.start.len()).map(best).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::trial::normals;

    /// One number has its best at 0.7 and is worth 0.09 there, one is the better the lower it is, and one does nothing.
    #[test]
    fn it_tells_what_each_number_does_through_noise() {
        let truth = |x: &[f64]| 0.09 - (x[0] - 0.7).powi(2) - 0.2 * (x[1] - 0.5);
        let start = [0.4, 0.5, 0.5];
        let one = |i: u64| {
            let [shares, noise] = [0, 1].map(|what| normals(3, what, i, 3));
            let shares: Vec<f64> = shares.iter().zip(start).map(|(z, x)| x + 0.2 * z).collect();
            // Some generations have harder trials.
            let harder = 0.2 * (i / 10 % 3) as f64;
            Tried { rate: truth(&shares) - harder + 0.05 * noise[0], shares, error: 0.05 }
        };
        let tried: Vec<Vec<Tried>> = (0..15).map(|g| (10 * g..10 * g + 10).map(one).collect()).collect();
        let response = Response::fit(&start, &tried).unwrap();
        for (number, share, alone) in [(0, 0.6, 0.08), (1, 0.3, 0.04), (2, 0.7, 0.0)] {
            let effect = response.effect(number, share);
            assert!((effect.alone - alone).abs() < 3.0 * effect.error && effect.error < 0.02, "{effect:?}");
        }
        let best = response.best();
        assert!(best[0] > 0.55 && best[1] < 0.35, "{best:?}");
        let loss = response.loss(0.2);
        assert!((loss - 0.04).abs() < 0.01, "{loss}");
        assert!(Response::fit(&start, &[]).is_none());
    }
}
