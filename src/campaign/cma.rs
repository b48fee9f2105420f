//! The covariance matrix adaptation evolution strategy (CMA-ES), by Hansen's tutorial (2016, arXiv:1604.00772, its default
//! constants). Whoever uses it draws the random numbers and ranks the samples, by whatever means; only the ranks count.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

/// A search.
#[derive(Debug, Clone)]
pub struct Cma {
    mean: DVector<f64>,
    /// Size of a step if the covariance is the identity.
    step: f64,
    covariance: DMatrix<f64>,
    /// Eigenvalues and eigenvectors of the covariance.
    eigen: SymmetricEigen<f64, Dyn>,
    /// The paths of the mean, by which step and covariance adapt.
    step_path: DVector<f64>,
    path: DVector<f64>,
    /// How many generations were told.
    generation: i32,
    /// Weights of the better half, which add up to 1.
    weights: Vec<f64>,
}

impl Cma {
    /// Begins at a point, with a first step and so many samples of each generation.
    pub fn new(start: &[f64], first_step: f64, samples: usize) -> Self {
        let n = start.len();
        let parents = samples / 2;
        let weight = |rank: usize| (parents as f64 + 0.5).ln() - (rank as f64).ln();
        let sum: f64 = (1..=parents).map(weight).sum();
        let covariance = DMatrix::identity(n, n);
        Self {
            mean: DVector::from_column_slice(start),
            step: first_step,
            eigen: SymmetricEigen::new(covariance.clone()),
            covariance,
            step_path: DVector::zeros(n),
            path: DVector::zeros(n),
            generation: 0,
            weights: (1..=parents).map(|rank| weight(rank) / sum).collect(),
        }
    }

    /// The usual number of samples of a generation in so many dimensions.
    pub fn samples_of(n: usize) -> usize {
        4 + (3.0 * (n as f64).ln()) as usize
    }

    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    pub fn step(&self) -> f64 {
        self.step
    }

    /// Sets the step, for whoever knows better than the paths which one is good.
    pub fn set_step(&mut self, step: f64) {
        self.step = step;
    }

    /// The spread of each coordinate.
    pub fn spread(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| self.step * variance.sqrt()).collect()
    }

    /// The sample for a vector of standard normal numbers.
    pub fn sample(&self, normal: &[f64]) -> Vec<f64> {
        let scaled = self.eigen.eigenvalues.map(|variance| variance.max(0.0).sqrt());
        let move_by = &self.eigen.eigenvectors * scaled.component_mul(&DVector::from_column_slice(normal));
        (&self.mean + self.step * move_by).as_slice().to_vec()
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

        let SymmetricEigen { eigenvalues, eigenvectors } = &self.eigen;
        let whitened = eigenvalues.map(|variance| 1.0 / variance.max(1e-20).sqrt());
        let straight = eigenvectors * whitened.component_mul(&(eigenvectors.transpose() * &mean_move));
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
        self.eigen = SymmetricEigen::new(self.covariance.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::ask::trial::normals;

    /// How near it comes to the least of `cost`, from a corner, in so many samples.
    fn found(n: usize, samples: usize, cost: impl Fn(&[f64]) -> f64) -> f64 {
        let each = Cma::samples_of(n);
        let mut search = Cma::new(&vec![0.9; n], 0.3, each);
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
}
