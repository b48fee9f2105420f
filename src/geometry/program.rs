//! Small linear programs with equalities and bounds (clarabel). Those over one set of half spaces around the origin,
//! many at a time, are in [`super::polytope`].

use crate::error::{Error, Result};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT};
use nalgebra::DMatrix;

/// Accuracy asked of the solver.
const TOLERANCE: f64 = 1e-10;

/// Maximise `cost . x` subject to rows `a . x = b` and `a . x <= b`.
#[derive(Debug, Clone, Default)]
pub struct LinearProgram {
    pub cost: Vec<f64>,
    /// (a, b) of `a . x = b`; a as long as the cost.
    pub equal: Vec<(Vec<f64>, f64)>,
    /// (a, b) of `a . x <= b`.
    pub at_most: Vec<(Vec<f64>, f64)>,
}

impl LinearProgram {
    /// A program without constraints yet.
    pub fn maximise(cost: Vec<f64>) -> Self {
        Self { cost, ..Default::default() }
    }

    /// Adds `least <= a . x <= most`.
    pub fn between(&mut self, a: Vec<f64>, least: f64, most: f64) {
        self.at_most.push((a.iter().map(|c| -c).collect(), -least));
        self.at_most.push((a, most));
    }

    /// The largest value and where it is taken; None if no x meets the constraints.
    ///
    /// Errors: the value has no bound, or the solver gives up.
    pub fn solve(&self) -> Result<Option<(f64, Vec<f64>)>> {
        let (n, rows) = (self.cost.len(), self.equal.len() + self.at_most.len());
        let all = || self.equal.iter().chain(&self.at_most);
        let mut a = DMatrix::zeros(rows, n);
        for (i, (row, _)) in all().enumerate() {
            row.iter().enumerate().for_each(|(j, value)| a[(i, j)] = *value);
        }
        let starts = (0..=n).map(|j| j * rows).collect();
        let places = (0..n).flat_map(|_| 0..rows).collect();
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .max_threads(1)
            .presolve_enable(false)
            .tol_gap_abs(TOLERANCE)
            .tol_gap_rel(TOLERANCE)
            .tol_feas(TOLERANCE)
            .build()
            .map_err(|e| failure(e.to_string()))?;
        let mut solver = DefaultSolver::new(
            &CscMatrix::zeros((n, n)),
            &self.cost.iter().map(|c| -c).collect::<Vec<_>>(),
            &CscMatrix::new(rows, n, starts, places, a.as_slice().to_vec()),
            &all().map(|(_, b)| *b).collect::<Vec<_>>(),
            &[ZeroConeT(self.equal.len()), NonnegativeConeT(self.at_most.len())],
            settings,
        )
        .map_err(|e| failure(e.to_string()))?;
        solver.solve();
        let solution = &solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Ok(Some((-solution.obj_val, solution.x.clone()))),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Ok(None),
            status => Err(failure(format!("{status:?}"))),
        }
    }
}

fn failure(problem: impl Into<String>) -> Error {
    Error::Numeric { what: "linear program".into(), problem: problem.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x + y on the segment x = 2 y with y in [least, 3].
    fn segment(least: f64) -> LinearProgram {
        let mut program = LinearProgram::maximise(vec![1.0, 1.0]);
        program.equal.push((vec![1.0, -2.0], 0.0));
        program.between(vec![0.0, 1.0], least, 3.0);
        program
    }

    #[test]
    fn the_largest_value_lies_at_a_corner() {
        let (value, at) = segment(-1.0).solve().unwrap().unwrap();
        assert!((value - 9.0).abs() < 1e-7 && (at[0] - 6.0).abs() < 1e-7, "{value} {at:?}");
    }

    #[test]
    fn a_point_is_found_and_nothing_is_none() {
        let (value, _) = segment(3.0).solve().unwrap().unwrap();
        assert!((value - 9.0).abs() < 1e-6, "{value}");
        assert_eq!(segment(3.5).solve().unwrap(), None);
    }

    #[test]
    fn no_bound_is_an_error() {
        let mut program = LinearProgram::maximise(vec![1.0, 1.0]);
        program.at_most.push((vec![1.0, 0.0], 1.0));
        assert!(program.solve().is_err());
    }
}
