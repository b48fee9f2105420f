//! What each number does to the success rate: a quadratic that is fitted to all candidates of a search.
//!
//! A generation is judged by so few trials that its ranks are mostly chance, but all generations together tell more.
//! The rate is taken as a sum over all numbers of `slope d + bend d^2`, with d the share of its range by which a number
//! differs from the incumbent's, and of a constant for each generation, since some have harder trials. Slopes and bends
//! are supposed to be normally distributed about zero, so the fit is a ridge regression (Hoerl and Kennard 1970), in
//! which a candidate counts by the inverse square of its standard error.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Prior standard deviations of slopes and bends: changes of the rate, as shares of the trials, over a whole range.
const SLOPE: f64 = 0.3;
const BEND: f64 = 1.0;

/// A candidate that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedCandidate {
    /// The values of the candidate, each as a share of its range.
    pub shares: Vec<f64>,
    /// Rate of the candidate in its generation, up to a constant, and the standard error of this rate.
    pub rate: f64,
    pub error: f64,
}

/// The fitted effect of a number on the rate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Effect {
    /// Coefficients of the rate as `slope d + bend d^2`, with d the change of the number as a share of its range.
    pub slope: f64,
    pub bend: f64,
    /// Gain in the rate if only this number takes its proposed value, as a share of the trials, and its standard error.
    pub alone: f64,
    pub error: f64,
}

impl Effect {
    /// The gain in the rate if the number differs from the incumbent's by the share `off` of its range.
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
    /// Mean and standard deviation of the shares at which each number was tried.
    tried: Vec<[f64; 2]>,
}

impl Response {
    /// Fits the candidates that were tried, generation by generation. It is None if there are none.
    pub fn fit(start: &[f64], generations: &[Vec<EvaluatedCandidate>]) -> Option<Self> {
        let n = start.len();
        let mut precision = DMatrix::from_diagonal(&DVector::from_fn(2 * n, |i, _| {
            if i < n { SLOPE } else { BEND }.powi(-2)
        }));
        let mut sum = DVector::zeros(2 * n);
        for generation in generations {
            let mut rows = Vec::new();
            for candidate in generation {
                let off = |i: usize| candidate.shares[i] - start[i];
                let terms =
                    DVector::from_fn(
                        2 * n,
                        |i, _| if i < n { off(i) } else { off(i - n).powi(2) },
                    );
                rows.push((candidate.error.powi(-2), terms, candidate.rate));
            }
            // The mean of the generation is subtracted, which removes the constant.
            let all: f64 = rows.iter().map(|(weight, ..)| weight).sum();
            let common = rows
                .iter()
                .fold(DVector::zeros(2 * n), |sum, (weight, terms, _)| {
                    sum + *weight / all * terms
                });
            let common_rate: f64 = rows
                .iter()
                .map(|(weight, _, rate)| weight / all * rate)
                .sum();
            for (weight, terms, rate) in &rows {
                let own = terms - &common;
                precision.ger(*weight, &own, &own, 1.0);
                sum.axpy(weight * (rate - common_rate), &own, 1.0);
            }
        }
        let covariance = precision.cholesky()?.inverse();
        let candidates: Vec<&EvaluatedCandidate> = generations.iter().flatten().collect();
        if candidates.is_empty() {
            return None;
        }
        let count = candidates.len() as f64;
        let mut tried = Vec::new();
        for i in 0..n {
            let shares = candidates.iter().map(|candidate| candidate.shares[i]);
            let mean = shares.clone().sum::<f64>() / count;
            let variance = shares.map(|share| (share - mean).powi(2)).sum::<f64>() / count;
            tried.push([mean, variance.sqrt()]);
        }
        Some(Self {
            start: start.to_vec(),
            fitted: &covariance * sum,
            covariance,
            tried,
        })
    }

    /// The fitted effect of a number, and the gain if the incumbent changes only this number, to another share of its
    /// range.
    pub fn effect(&self, number: usize, share: f64) -> Effect {
        let at = [number, self.start.len() + number];
        let off = share - self.start[number];
        let terms = [off, off * off];
        let variance: f64 = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(i, j)| terms[i] * terms[j] * self.covariance[(at[i], at[j])])
            .iter()
            .sum();
        let [slope, bend] = at.map(|i| self.fitted[i]);
        let effect = Effect {
            slope,
            bend,
            alone: 0.0,
            error: variance.max(0.0).sqrt(),
        };
        Effect {
            alone: effect.gain(off),
            ..effect
        }
    }

    /// The mean loss in the rate of samples with this spread in every number, compared with their middle.
    pub fn loss(&self, spread: f64) -> f64 {
        -self.fitted.rows(self.start.len(), self.start.len()).sum() * spread * spread
    }

    /// The shares with the greatest fitted rate, each within a standard deviation of the mean of the tried shares.
    pub fn best(&self) -> Vec<f64> {
        let mut best = Vec::new();
        for (i, start) in self.start.iter().enumerate() {
            let [mean, deviation] = self.tried[i];
            let effect = self.effect(i, mean);
            let [from, to] =
                [mean - deviation, mean + deviation].map(|share| share.clamp(0.0, 1.0));
            let mut choices = vec![from, to];
            if effect.bend < 0.0 {
                choices.push((start - 0.5 * effect.slope / effect.bend).clamp(from, to));
            }
            let gain = |share: &f64| effect.gain(share - start);
            let choice = choices
                .into_iter()
                .max_by(|a, b| gain(a).total_cmp(&gain(b)));
            best.push(choice.unwrap_or(mean));
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::trial::normals;

    /// One number has its best at 0.7 and is worth 0.09 there, one is the better the lower it is, and one does nothing.
    #[test]
    fn it_tells_what_each_number_does_through_noise() {
        let start = [0.4, 0.5, 0.5];
        let candidate = |i: u64| {
            let [shares, noise] = [0, 1].map(|what| normals(3, what, i, 3));
            let shares: Vec<f64> = shares.iter().zip(start).map(|(z, x)| x + 0.2 * z).collect();
            // Some generations have harder trials.
            let harder = 0.2 * (i / 10 % 3) as f64;
            let truth = 0.09 - (shares[0] - 0.7).powi(2) - 0.2 * (shares[1] - 0.5);
            EvaluatedCandidate {
                rate: truth - harder + 0.05 * noise[0],
                shares,
                error: 0.05,
            }
        };
        let tried: Vec<Vec<EvaluatedCandidate>> = (0..15)
            .map(|g| (10 * g..10 * g + 10).map(candidate).collect())
            .collect();
        let response = Response::fit(&start, &tried).unwrap();
        for (number, share, alone) in [(0, 0.6, 0.08), (1, 0.3, 0.04), (2, 0.7, 0.0)] {
            let effect = response.effect(number, share);
            assert!(
                (effect.alone - alone).abs() < 3.0 * effect.error && effect.error < 0.02,
                "{effect:?}"
            );
        }
        let best = response.best();
        assert!(best[0] > 0.55 && best[1] < 0.35, "{best:?}");
        let loss = response.loss(0.2);
        assert!((loss - 0.04).abs() < 0.01, "{loss}");
        assert!(Response::fit(&start, &[]).is_none());
    }
}
