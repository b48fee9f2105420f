//! The covariance matrix adaptation evolution strategy (CMA-ES) in the unit cube, by Hansen's tutorial (2016,
//! arXiv:1604.00772, its default constants). Whoever uses it draws the random numbers and ranks the samples, by whatever
//! means; only the ranks count.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// How far samples are from the first mean, as a share of the ranges: the root of the sum over all coordinates.
const DISTANCE: f64 = 0.4;

/// A search in the unit cube.
#[derive(Debug, Clone)]
pub struct Cma {
    mean: DVector<f64>,
    /// Size of a step, as a share of each range, if the covariance is the identity.
    step: f64,
    covariance: DMatrix<f64>,
    /// The paths of the mean, by which step and covariance adapt.
    step_path: DVector<f64>,
    path: DVector<f64>,
    /// How many generations were told.
    generation: i32,
    /// Weights of the better half, which add up to 1.
    weights: Vec<f64>,
}

impl Cma {
    /// Begins at a point of the unit cube.
    pub fn new(start: &[f64]) -> Self {
        let n = start.len();
        let parents = Self::samples_of(n) / 2;
        let weight = |rank: usize| (parents as f64 + 0.5).ln() - (rank as f64).ln();
        let sum: f64 = (1..=parents).map(weight).sum();
        Self {
            mean: DVector::from_column_slice(start),
            step: Self::first_step(n),
            covariance: DMatrix::identity(n, n),
            step_path: DVector::zeros(n),
            path: DVector::zeros(n),
            generation: 0,
            weights: (1..=parents).map(|rank| weight(rank) / sum).collect(),
        }
    }

    fn first_step(n: usize) -> f64 {
        DISTANCE / (n as f64).sqrt()
    }

    /// Samples of a generation in so many dimensions.
    pub fn samples_of(n: usize) -> usize {
        4 + (3.0 * (n as f64).ln()) as usize
    }

    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// The spread of each coordinate.
    pub fn spread(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| self.step * variance.sqrt()).collect()
    }

    /// The sample for a vector of standard normal numbers. What is outside of the cube is mirrored into it.
    pub fn sample(&self, normal: &[f64]) -> Vec<f64> {
        let eigen = SymmetricEigen::new(self.covariance.clone());
        let scaled = DVector::from_iterator(
            normal.len(),
            eigen.eigenvalues.iter().zip(normal).map(|(variance, z)| variance.max(0.0).sqrt() * z),
        );
        let sample = &self.mean + self.step * (eigen.eigenvectors * scaled);
        sample.iter().map(|x| mirrored(*x)).collect()
    }

    /// Moves on, given all samples of a generation, the best one first.
    pub fn tell(&mut self, ranked: &[&[f64]]) {
        let n = self.mean.len() as f64;
        let effective = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        let of_step = (effective + 2.0) / (n + effective + 5.0);
        let of_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let of_one = 2.0 / ((n + 1.3).powi(2) + effective);
        let of_all = (2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective)).min(1.0 - of_one);
        let damping = 1.0 + of_step + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0);
        let usual_length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

        let moves: Vec<DVector<f64>> = ranked
            .iter()
            .take(self.weights.len())
            .map(|sample| (DVector::from_column_slice(sample) - &self.mean) / self.step)
            .collect();
        let mut mean_move = DVector::zeros(self.mean.len());
        moves.iter().zip(&self.weights).for_each(|(sample, weight)| mean_move += *weight * sample);
        self.mean += self.step * &mean_move;
        self.generation += 1;

        let eigen = SymmetricEigen::new(self.covariance.clone());
        let whitened = eigen.eigenvalues.map(|variance| 1.0 / variance.max(1e-20).sqrt());
        let straight = &eigen.eigenvectors * whitened.component_mul(&(eigen.eigenvectors.transpose() * &mean_move));
        self.step_path = (1.0 - of_step) * &self.step_path + (of_step * (2.0 - of_step) * effective).sqrt() * straight;
        let length = self.step_path.norm() / (1.0 - (1.0 - of_step).powi(2 * self.generation)).sqrt();
        let is_steady = length < (1.4 + 2.0 / (n + 1.0)) * usual_length;
        self.path *= 1.0 - of_path;
        if is_steady {
            self.path += (of_path * (2.0 - of_path) * effective).sqrt() * mean_move;
        }
        let lost = if is_steady { 0.0 } else { of_one * of_path * (2.0 - of_path) };
        self.covariance *= 1.0 - of_one - of_all + lost;
        self.covariance += of_one * &self.path * self.path.transpose();
        for (sample, weight) in moves.iter().zip(&self.weights) {
            self.covariance += of_all * *weight * sample * sample.transpose();
        }
        self.step *= ((of_step / damping) * (self.step_path.norm() / usual_length - 1.0)).exp();
        self.step = self.step.min(2.0 * Self::first_step(self.mean.len()));
    }
}

/// The number, mirrored at 0 and 1 until it is between them.
fn mirrored(x: f64) -> f64 {
    let x = x.rem_euclid(2.0);
    if x > 1.0 { 2.0 - x } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::ask::trial::normals;

    /// How near it comes to the least of `cost`, from a corner, in so many samples.
    fn found(n: usize, samples: usize, cost: impl Fn(&[f64]) -> f64) -> f64 {
        let mut search = Cma::new(&vec![0.9; n]);
        let each = Cma::samples_of(n);
        for generation in 0..samples / each {
            let mut of: Vec<Vec<f64>> =
                (0..each).map(|i| search.sample(&normals(1, generation as u64, i as u64, n))).collect();
            of.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
            search.tell(&of.iter().map(Vec::as_slice).collect::<Vec<_>>());
        }
        cost(search.mean())
    }

    #[test]
    fn it_finds_the_least_of_a_bowl_and_of_a_bent_valley() {
        let bowl = |x: &[f64]| x.iter().map(|x| (x - 0.3).powi(2)).sum();
        assert!(found(1, 200, bowl) < 1e-6 && found(8, 2000, bowl) < 1e-8);
        // Rosenbrock's, scaled into the cube: only a search that learns the covariance follows it.
        let valley = |x: &[f64]| {
            let at = |i: usize| 4.0 * x[i] - 2.0;
            (0..4).map(|i| 100.0 * (at(i + 1) - at(i).powi(2)).powi(2) + (1.0 - at(i)).powi(2)).sum()
        };
        assert!(found(5, 6000, valley) < 1e-6);
    }

    #[test]
    fn samples_stay_in_the_cube() {
        let search = Cma::new(&[0.0, 1.0]);
        for i in 0..200 {
            let sample = search.sample(&normals(2, 0, i, 2));
            assert!(sample.iter().all(|x| (0.0..=1.0).contains(x)), "{sample:?}");
        }
        assert_eq!([-0.25, 1.25, 2.5, 0.5].map(mirrored), [0.25, 0.75, 0.5, 0.5]);
    }
}
