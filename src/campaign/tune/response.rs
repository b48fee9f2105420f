//! What each number does to the success rate: a quadratic that is fitted to all candidates of a search.
//!
//! A generation is judged by so few trials that its ranks are mostly chance, but all generations together tell more. The
//! advantage over the incumbent is taken as a sum over all numbers of `slope d + bend d^2`, with d the share of its range by
//! which a number differs from the incumbent's. Slopes and bends are supposed to be normally distributed about zero, so the
//! fit is a ridge regression (Hoerl and Kennard 1970), in which a candidate counts by the inverse square of its
//! standard error.

use nalgebra::{DMatrix, DVector};

/// Standard deviations of slopes and bends before anything is known: the share of the trials that a whole range is worth.
const SLOPE: f64 = 0.2;
const BEND: f64 = 0.3;

/// A candidate that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Of each range.
    pub shares: Vec<f64>,
    /// Its rate less the incumbent's, and the standard error of that.
    pub advantage: f64,
    pub error: f64,
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
    /// Fits what was tried around an incumbent. It is None without any.
    pub fn fit(start: &[f64], tried: &[Tried]) -> Option<Self> {
        let n = start.len();
        let mut precision = DMatrix::zeros(2 * n, 2 * n);
        let mut sum = DVector::zeros(2 * n);
        for i in 0..n {
            (precision[(i, i)], precision[(n + i, n + i)]) = (SLOPE.powi(-2), BEND.powi(-2));
        }
        for one in tried {
            let off = |i: usize| one.shares[i] - start[i];
            let terms = DVector::from_fn(2 * n, |i, _| if i < n { off(i) } else { off(i - n).powi(2) });
            let weight = one.error.powi(-2);
            precision.ger(weight, &terms, &terms, 1.0);
            sum.axpy(weight * one.advantage, &terms, 1.0);
        }
        let covariance = precision.cholesky()?.inverse();
        let count = tried.len() as f64;
        let spread = |i: usize| {
            let mean = tried.iter().map(|one| one.shares[i]).sum::<f64>() / count;
            let variance = tried.iter().map(|one| (one.shares[i] - mean).powi(2)).sum::<f64>() / count;
            [mean, variance.sqrt()]
        };
        let fitted = &covariance * sum;
        (!tried.is_empty()).then(|| Self {
            start: start.to_vec(),
            fitted,
            covariance,
            tried: (0..n).map(spread).collect(),
        })
    }

    /// How much better the incumbent would be with one number at another share of its range, and the standard error of that.
    pub fn worth(&self, number: usize, share: f64) -> [f64; 2] {
        let (n, off) = (self.start.len(), share - self.start[number]);
        let at = [number, n + number];
        let terms = [off, off * off];
        let value = at.iter().zip(terms).map(|(i, term)| self.fitted[*i] * term).sum();
        let of_pair = |(i, j): (usize, usize)| terms[i] * terms[j] * self.covariance[(at[i], at[j])];
        let variance: f64 = [(0, 0), (0, 1), (1, 0), (1, 1)].map(of_pair).iter().sum();
        [value, variance.max(0.0).sqrt()]
    }

    /// By how much the mean of samples with this spread of each number is worse than the sample in their middle.
    pub fn loss(&self, spread: &[f64]) -> f64 {
        let bends = self.fitted.iter().skip(self.start.len());
        -bends.zip(spread).map(|(bend, spread)| bend * spread * spread).sum::<f64>()
    }

    /// The shares at which it is greatest, each within a standard deviation of where it was tried.
    pub fn best(&self) -> Vec<f64> {
        let best = |i: usize| {
            let [mean, deviation] = self.tried[i];
            let (slope, bend) = (self.fitted[i], self.fitted[self.start.len() + i]);
            let [from, to] = [mean - deviation, mean + deviation].map(|share| share.clamp(0.0, 1.0));
            let top = (bend < 0.0).then(|| (self.start[i] - 0.5 * slope / bend).clamp(from, to));
            let choices = [from, to].into_iter().chain(top);
            choices.max_by(|a, b| self.worth(i, *a)[0].total_cmp(&self.worth(i, *b)[0])).unwrap_or(mean)
        };
        (0..self.start.len()).map(best).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::ask::trial::normals;

    /// One number has its best at 0.7 and is worth 0.09 there, one is the better the lower it is, and one does nothing.
    #[test]
    fn it_tells_what_each_number_does_through_noise() {
        let truth = |x: &[f64]| 0.09 - (x[0] - 0.7).powi(2) - 0.2 * (x[1] - 0.5);
        let start = [0.4, 0.5, 0.5];
        let one = |i: u64| {
            let [shares, noise] = [0, 1].map(|what| normals(3, what, i, 3));
            let shares: Vec<f64> = shares.iter().zip(start).map(|(z, x)| x + 0.2 * z).collect();
            Tried { advantage: truth(&shares) - truth(&start) + 0.05 * noise[0], shares, error: 0.05 }
        };
        let tried: Vec<Tried> = (0..150).map(one).collect();
        let response = Response::fit(&start, &tried).unwrap();
        let near = |[value, error]: [f64; 2], truth: f64| (value - truth).abs() < 3.0 * error && error < 0.02;
        assert!(near(response.worth(0, 0.6), 0.08), "{:?}", response.worth(0, 0.6));
        assert!(near(response.worth(1, 0.3), 0.04), "{:?}", response.worth(1, 0.3));
        assert!(near(response.worth(2, 0.7), 0.0), "{:?}", response.worth(2, 0.7));
        let best = response.best();
        assert!(best[0] > 0.55 && best[1] < 0.35, "{best:?}");
        let loss = response.loss(&[0.2, 0.0, 0.0]);
        assert!((loss - 0.04).abs() < 0.01, "{loss}");
        assert!(Response::fit(&start, &[]).is_none());
    }
}
