//! CMA-ES, the evolution strategy that adapts its covariance matrix: it searches the arguments with which a function is
//! least, and uses no more of the function than which of several points has the lower value.
//!
//! Source: Hansen, "The CMA Evolution Strategy: A Tutorial", 2016 (arXiv:1604.00772); numbers of equations are of that text.
//! Points of a generation are drawn from a normal distribution. Its mean moves to the weighted average of the better half;
//! its step size grows where the mean goes on in one direction, and shrinks where it goes to and fro; its covariance matrix
//! learns from the path of the mean (rank one) and from the points (rank mu, with negative weights for the worse half).
//!
//! A function has n arguments, and lengths are in the unit of these arguments. Matrices and weights have no unit.

use crate::ask::trial::normals;
use nalgebra::{DMatrix, DVector};

/// The best costs of the last generations are within this range, in the unit of costs, when a search has converged (TolFun).
const FLAT: f64 = 1e-12;
/// Spreads, as shares of the first step size, below which a search has converged (TolX), and above which it has diverged
/// (TolXUp).
const SPREADS: [f64; 2] = [1e-12, 1e8];
/// Largest ratio of the eigenvalues of the covariance matrix (ConditionCov).
const CONDITION: f64 = 1e14;

/// A search on its way. The points of the next generation are normal, with mean `mean` and covariance `step`^2 `covariance`.
#[derive(Debug, Clone)]
pub struct CmaEs {
    rates: Rates,
    seed: u64,
    /// The number of generations that were told is g.
    generation: u64,
    /// The mean m is n lengths.
    mean: DVector<f64>,
    /// The step size sigma is a length, as is the first one.
    step: f64,
    first_step: f64,
    /// The covariance matrix C is n x n and symmetric.
    covariance: DMatrix<f64>,
    /// The columns of B, n x n, are the eigenvectors of C = B D^2 B^T, and the n numbers of D the roots of their eigenvalues.
    axes: DMatrix<f64>,
    roots: DVector<f64>,
    /// The evolution paths p_sigma and p_c are n numbers each.
    step_path: DVector<f64>,
    covariance_path: DVector<f64>,
    /// The least cost of each generation, in any unit.
    least: Vec<f64>,
}

/// Weights and learning rates are the default parameters of table 1, and have no unit.
#[derive(Debug, Clone)]
struct Rates {
    /// The weights w are as many as a generation has points, and that of the best point is the first. The positive ones have
    /// the sum 1 (49 to 53).
    weights: Vec<f64>,
    /// The next mean is made of mu points, which are worth mu_eff points of equal weight (8).
    parents: usize,
    mu_eff: f64,
    /// The rate c_sigma and the damping d_sigma are those of the step size (55).
    step: f64,
    damping: f64,
    /// The rates of the covariance are c_c of its path (56), c_1 of its rank-one (57) and c_mu of its rank-mu update (58).
    path: f64,
    rank_one: f64,
    rank_mu: f64,
}

impl Rates {
    fn new(n: usize, points: usize) -> Self {
        let (n, parents) = (n as f64, points / 2);
        let raw: Vec<f64> = (1..=points)
            .map(|i| ((points as f64 + 1.0) / 2.0).ln() - (i as f64).ln())
            .collect();
        let worth =
            |raw: &[f64]| raw.iter().sum::<f64>().powi(2) / raw.iter().map(|w| w * w).sum::<f64>();
        let [mu_eff, mu_eff_worse] = [&raw[..parents], &raw[parents..]].map(worth);
        let step = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let rank_one = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let rank_mu = (2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff))
            .min(1.0 - rank_one);
        // The sum of the negative weights is the least of three (50 to 52); with the last, C stays positive definite.
        let worse = [
            1.0 + rank_one / rank_mu,
            1.0 + 2.0 * mu_eff_worse / (mu_eff + 2.0),
            (1.0 - rank_one - rank_mu) / (n * rank_mu),
        ];
        let sum = |sign: f64| raw.iter().map(|w| (sign * w).max(0.0)).sum::<f64>();
        let [better, worse] = [
            1.0 / sum(1.0),
            worse.into_iter().fold(f64::INFINITY, f64::min) / sum(-1.0),
        ];
        Self {
            weights: raw
                .iter()
                .map(|w| w * if *w > 0.0 { better } else { worse })
                .collect(),
            parents,
            mu_eff,
            step,
            damping: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + step,
            path: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            rank_one,
            rank_mu,
        }
    }
}

impl CmaEs {
    /// The search begins about `mean`, which is n lengths, and has so many points in each generation, at least four.
    pub fn new(mean: Vec<f64>, step: f64, points: usize, seed: u64) -> Self {
        let n = mean.len();
        Self {
            rates: Rates::new(n, points),
            seed,
            generation: 0,
            mean: mean.into(),
            step,
            first_step: step,
            covariance: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            roots: DVector::from_element(n, 1.0),
            step_path: DVector::zeros(n),
            covariance_path: DVector::zeros(n),
            least: Vec::new(),
        }
    }

    /// The points of the next generation are n lengths each (38 to 40). They follow from the seed, from the number of the
    /// generation and from what was told.
    pub fn ask(&self) -> Vec<DVector<f64>> {
        let point = |number: usize| {
            let normal = DVector::from(normals(
                self.seed,
                self.generation,
                number as u64,
                self.mean.len(),
            ));
            &self.mean + &self.axes * self.roots.component_mul(&normal) * self.step
        };
        (0..self.rates.weights.len()).map(point).collect()
    }

    /// The search learns from a generation: from the points that were asked for, and from the cost of each, a number in any
    /// unit. Of equal costs the first is taken for the better one.
    pub fn tell(&mut self, points: &[DVector<f64>], costs: &[f64]) {
        let Rates {
            weights,
            parents,
            mu_eff,
            step,
            damping,
            path,
            rank_one,
            rank_mu,
        } = &self.rates;
        let n = self.mean.len() as f64;
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        // y = (x - m) / sigma, the best point first.
        let steps: Vec<DVector<f64>> = order
            .iter()
            .map(|i| (&points[*i] - &self.mean) / self.step)
            .collect();

        // The mean (41, 42).
        let mut moved = DVector::zeros(self.mean.len());
        weights
            .iter()
            .zip(&steps)
            .take(*parents)
            .for_each(|(w, y)| moved.axpy(*w, y, 1.0));
        self.mean.axpy(self.step, &moved, 1.0);

        // The step size (43, 44). Its path has the length `expected` where the steps of the mean are independent.
        let push = (step * (2.0 - step) * mu_eff).sqrt();
        self.step_path
            .axpy(push, &self.whitened(&moved), 1.0 - step);
        let (length, expected) = (
            self.step_path.norm(),
            n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        );
        self.step *= (step / damping * (length / expected - 1.0)).exp();

        // The covariance (45 to 47). Its path rests while that of the step size is long, lest it grow too fast.
        self.generation += 1;
        let begun = (1.0 - (1.0 - step).powi(2 * self.generation as i32)).sqrt();
        let (push, rest) = match length / begun < (1.4 + 2.0 / (n + 1.0)) * expected {
            true => ((path * (2.0 - path) * mu_eff).sqrt(), 0.0),
            false => (0.0, path * (2.0 - path)),
        };
        self.covariance_path.axpy(push, &moved, 1.0 - path);
        let kept = 1.0 + rank_one * rest - rank_one - rank_mu * weights.iter().sum::<f64>();
        let of_points = weights.iter().zip(&steps).map(|(w, y)| match *w < 0.0 {
            true => w * n / self.whitened(y).norm_squared(),
            false => *w,
        });
        let of_points: Vec<f64> = of_points.collect();
        self.covariance.ger(
            *rank_one,
            &self.covariance_path,
            &self.covariance_path,
            kept,
        );
        of_points
            .iter()
            .zip(&steps)
            .for_each(|(w, y)| self.covariance.ger(rank_mu * w, y, y, 1.0));

        let eigen = self.covariance.clone().symmetric_eigen();
        (self.axes, self.roots) = (
            eigen.eigenvectors,
            eigen.eigenvalues.map(|value| value.max(0.0).sqrt()),
        );
        self.least.push(costs[order[0]]);
    }

    /// C^(-1/2) times a vector of n numbers.
    fn whitened(&self, vector: &DVector<f64>) -> DVector<f64> {
        &self.axes * self.axes.tr_mul(vector).component_div(&self.roots)
    }

    /// Nothing is to be expected of further generations by the criteria of appendix B.3, without Stagnation: that one
    /// asks first after five times 100 + 100 n^1.5 / points generations, 6585 for 44 arguments and 24 points.
    pub fn has_converged(&self) -> bool {
        let n = self.mean.len();
        let last = 10 + (30 * n).div_ceil(self.rates.weights.len());
        let last = self
            .least
            .len()
            .checked_sub(last)
            .map(|from| &self.least[from..]);
        let is_flat = last.is_some_and(|last| {
            let [least, most] =
                [f64::min, f64::max].map(|of| last.iter().copied().reduce(of).unwrap_or_default());
            most - least < FLAT
        });
        let [tiny, huge] = SPREADS.map(|share| share * self.first_step);
        let spread = self
            .covariance
            .diagonal()
            .map(|variance| self.step * variance.sqrt());
        let is_tiny = spread
            .iter()
            .chain((&self.covariance_path * self.step).iter())
            .all(|length| length.abs() < tiny);
        // It is infinite if C is not positive definite.
        let condition = (self.roots.max() / self.roots.min()).powi(2);
        let axis = self.generation as usize % n;
        let along = self.axes.column(axis) * (0.1 * self.step * self.roots[axis]);
        let has_no_effect = &self.mean + along == self.mean
            || self
                .mean
                .iter()
                .zip(&spread)
                .any(|(mean, spread)| mean + 0.2 * spread == *mean);
        let is_huge = self.step * self.roots.max() > huge;
        is_flat || is_tiny || is_huge || has_no_effect || condition > CONDITION
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quadratic whose principal axes are turned (by a reflection) and whose curvatures along them go from 1 to 1e4; its
    /// least value is 0.
    fn quadratic(x: &[f64]) -> f64 {
        let (n, x) = (x.len(), DVector::from_column_slice(x));
        let mirror = DVector::from_fn(n, |i, _| (i as f64 + 1.0).sin()).normalize();
        let turned = &x - &mirror * (2.0 * mirror.dot(&x));
        let along =
            |(i, x): (usize, &f64)| 1e4_f64.powf(i as f64 / (n as f64 - 1.0)) * (x - 1.0).powi(2);
        turned.iter().enumerate().map(along).sum()
    }

    /// Rosenbrock's valley, least at (1, 1, ...) with the value 0.
    fn valley(x: &[f64]) -> f64 {
        x.windows(2)
            .map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2))
            .sum()
    }

    fn generation(search: &mut CmaEs, of: impl Fn(&[f64]) -> f64) -> f64 {
        let points = search.ask();
        let costs: Vec<f64> = points.iter().map(|point| of(point.as_slice())).collect();
        search.tell(&points, &costs);
        costs.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Evaluations after which a search of n numbers, which begins at 0 with steps of 0.5, has found a cost below 1e-10.
    fn evaluations(n: usize, seed: u64, of: fn(&[f64]) -> f64) -> usize {
        let points = 4 + (3.0 * (n as f64).ln()) as usize;
        let mut search = CmaEs::new(vec![0.0; n], 0.5, points, seed);
        let mut count = points;
        while generation(&mut search, of) > 1e-10 {
            count += points;
            assert!(
                !search.has_converged() && count < 20_000,
                "not found, seed {seed}"
            );
        }
        count
    }

    /// Of 20 seeds, the worst need 1836 and 1848 evaluations.
    #[test]
    fn turned_and_bent_valleys_are_followed() {
        for (n, of) in [(6, quadratic as fn(&[f64]) -> f64), (4, valley)] {
            let counts: Vec<usize> = (0..20).map(|seed| evaluations(n, seed, of)).collect();
            assert!(
                counts.iter().all(|count| *count <= 2200),
                "{n} arguments: {counts:?}"
            );
        }
    }

    fn close(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs(),
            "{found} is not {expected}"
        );
    }

    // Expected values here and below: package cmaes 0.13.1 of Python, which is another program after the same text.
    #[test]
    fn rates_are_those_of_others() {
        let Rates {
            weights,
            parents,
            mu_eff,
            step,
            damping,
            path,
            rank_one,
            rank_mu,
        } = Rates::new(44, 24);
        assert_eq!((weights.len(), parents), (24, 12));
        for (found, expected) in [
            (mu_eff, 7.026375557592154),
            (step, 0.1611093965611521),
            (damping, 1.161109396561152),
            (path, 0.08608741032487968),
            (rank_one, 0.0009712904155105933),
            (rank_mu, 0.004869177796234728),
            (weights[0], 0.24470488689697073),
            (weights[11], 0.0039550335601169434),
            (weights[23], -0.17431257237809647),
            (weights.iter().sum(), -0.19947729496788558),
        ] {
            close(found, expected);
        }
    }

    /// Five generations of points that are given. The path of the covariance rests in the first and in the last two.
    #[test]
    fn what_is_learned_is_what_others_learn() {
        let mut search = CmaEs::new(vec![0.0; 3], 0.5, 6, 0);
        for g in 0..5 {
            let at = |k: usize, j: usize| {
                1.7 * (1.0 + 2.3 * (18 * g + 3 * k + j) as f64).sin()
                    + if g < 3 { 0.0 } else { 4.0 }
            };
            let points: Vec<_> = (0..6)
                .map(|k| DVector::from_fn(3, |j, _| at(k, j)))
                .collect();
            let cost = |x: &DVector<f64>| {
                (x[0] - 1.0).powi(2) + 10.0 * (x[1] + x[0]).powi(2) + 100.0 * (x[2] - 2.0).powi(2)
            };
            let costs: Vec<f64> = points.iter().map(cost).collect();
            search.tell(&points, &costs);
        }
        close(search.step, 7.592020827866406);
        let mean = [2.96260579388818, 5.598766450337456, 2.906954707138821];
        search
            .mean
            .iter()
            .zip(mean)
            .for_each(|(found, expected)| close(*found, expected));
        let [a, b, c] = [0.7934936116994937, 0.6375306473816117, -0.7258309823015];
        let covariance = [
            1.678060417134882,
            a,
            b,
            a,
            4.225292482326282,
            c,
            b,
            c,
            1.7497031833937302,
        ];
        search
            .covariance
            .iter()
            .zip(covariance)
            .for_each(|(found, expected)| close(*found, expected));
    }

    #[test]
    fn of_equal_costs_the_first_is_better() {
        let told = |costs: [f64; 4]| {
            let mut search = CmaEs::new(vec![0.0; 2], 0.5, 4, 3);
            search.tell(&search.ask(), &costs);
            search.ask()
        };
        assert_eq!(told([1.0; 4]), told([1.0, 2.0, 3.0, 4.0]));
        assert_ne!(told([1.0; 4]), told([4.0, 3.0, 2.0, 1.0]));
    }

    /// Only the order of the costs counts, so a cost may have any unit.
    #[test]
    fn seed_and_order_alone_tell_the_points_to_the_bit() {
        let points = |seed: u64, of: fn(&[f64]) -> f64| {
            let mut search = CmaEs::new(vec![0.0; 4], 0.5, 8, seed);
            for _ in 0..50 {
                generation(&mut search, of);
            }
            search
                .ask()
                .iter()
                .flat_map(|point| point.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let first = points(5, valley);
        assert_eq!(first, points(5, valley));
        assert_eq!(first, points(5, |x| 1024.0 * valley(x)));
        assert_ne!(first, points(6, valley));
    }

    #[test]
    fn a_search_ends_where_nothing_is_to_be_found() {
        let generations = |of: fn(&[f64]) -> f64| {
            let mut search = CmaEs::new(vec![0.0; 44], 1.0, 24, 1);
            let ends = |_: &usize| {
                generation(&mut search, of);
                search.has_converged()
            };
            ((1..500).find(ends), search)
        };
        // A plain: as many generations as are looked at.
        assert_eq!(generations(|_| 1.0).0, Some(65));
        // A slope without an end: the steps grow.
        let (ended, search) = generations(|x| x[0]);
        assert!(
            ended.is_some() && search.step > 1e6,
            "{ended:?} {}",
            search.step
        );

        let new = || CmaEs::new(vec![1.0; 3], 1.0, 7, 1);
        assert!(!new().has_converged());
        let flawed: [fn(&mut CmaEs); 6] = [
            |search| search.roots[1] = 0.0,
            |search| search.roots[1] = 1.1e7,
            |search| search.step = 1e-13,
            |search| search.step = 1.1e8,
            // The covariance has no root.
            |search| {
                search.covariance[(1, 1)] = -9.0;
                generation(search, valley);
            },
            // No step is felt along this axis.
            |search| search.mean[0] = 1e17,
        ];
        for (number, flaw) in flawed.into_iter().enumerate() {
            let mut search = new();
            flaw(&mut search);
            assert!(search.has_converged(), "flaw {number}");
        }
    }
}
