//! Small linear programs with equalities and bounds (by Clarabel). For many programs on one set of half spaces around
//! the origin, see [`super::polytope`].

use crate::error::{Error, Result};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT,
};
use nalgebra::DMatrix;

/// Accuracy of the solver. In the programs of a polytope it is relative to right-hand sides of 1.
const TOLERANCE: f64 = 1e-10;
/// If the constraints have to be relaxed by more than this, no x meets them.
const MISSED: f64 = 1e-7;

/// Maximises `cost . x` subject to rows `a . x = b` and `a . x <= b`.
#[derive(Debug, Clone, Default)]
pub struct LinearProgram {
    pub cost: Vec<f64>,
    /// The rows (a, b) of `a . x = b`.
    pub equal: Vec<Row>,
    /// The rows (a, b) of `a . x <= b`.
    pub at_most: Vec<Row>,
    /// Whether this is the [`elastic`](Self::elastic) program of another one.
    is_elastic: bool,
}

/// A row: a, which is as long as the cost, and b.
pub type Row = (Vec<f64>, f64);

impl LinearProgram {
    /// A program without constraints so far.
    pub fn maximise(cost: Vec<f64>) -> Self {
        Self { cost, ..Default::default() }
    }

    /// Adds `least <= a . x <= most`.
    pub fn between(&mut self, a: Vec<f64>, least: f64, most: f64) {
        self.at_most.push((a.iter().map(|c| -c).collect(), -least));
        self.at_most.push((a, most));
    }

    /// The maximum and a point where it is reached; None if no x meets the constraints.
    ///
    /// It fails if the value is unbounded or if the solver gives up.
    pub fn solve(&self) -> Result<Option<(f64, Vec<f64>)>> {
        // If a row must be at most b and at least b, it equals b. Between such rows, the solver finds no interior
        // point.
        let is_opposite = |(a, b): &Row, (c, d): &Row| *b == -*d && a.iter().zip(c).all(|(x, y)| *x == -*y);
        let opposites = |row: &Row| self.at_most.iter().position(|other| is_opposite(row, other));
        let (mut equal, mut at_most): (Vec<&Row>, Vec<&Row>) = (self.equal.iter().collect(), Vec::new());
        for (i, row) in self.at_most.iter().enumerate() {
            match opposites(row) {
                Some(other) if other > i => equal.push(row),
                Some(_) => {}
                None => at_most.push(row),
            }
        }
        let (n, rows) = (self.cost.len(), equal.len() + at_most.len());
        let all = || equal.iter().chain(&at_most);
        let mut a = DMatrix::zeros(rows, n);
        for (i, (row, _)) in all().enumerate() {
            row.iter().enumerate().for_each(|(j, value)| a[(i, j)] = *value);
        }
        let b: Vec<f64> = all().map(|(_, b)| *b).collect();
        let cost: Vec<f64> = self.cost.iter().map(|c| -c).collect();
        let cones = [ZeroConeT(equal.len()), NonnegativeConeT(at_most.len())];
        let mut solver = solver(&cost, &a, &b, &cones)?;
        solver.solve();
        let solution = solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Ok(Some((-solution.obj_val, solution.x))),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Ok(None),
            // In one of some thousands of infeasible programs, the solver does not recognise this by itself.
            _ if !self.is_elastic && self.elastic().solve()?.is_some_and(|(value, _)| -value > MISSED) => Ok(None),
            status => Err(failure(format!("{status:?}"))),
        }
    }

    /// The program that finds by how much (as a negative number) the constraints must be relaxed for some x to meet
    /// them. It is feasible for any constraints.
    fn elastic(&self) -> Self {
        let unknowns = self.cost.len();
        let with = |a: &[f64], sign: f64| a.iter().map(|c| sign * c).chain([-1.0]).collect::<Vec<_>>();
        let mut program = Self::maximise([vec![0.0; unknowns], vec![-1.0]].concat());
        program.is_elastic = true;
        program.at_most.push((with(&vec![0.0; unknowns], 1.0), 0.0));
        program.at_most.extend(self.at_most.iter().map(|(a, b)| (with(a, 1.0), *b)));
        program.at_most.extend(self.equal.iter().flat_map(|(a, b)| [(with(a, 1.0), *b), (with(a, -1.0), -b)]));
        program
    }
}

/// A solver for `min cost . x` subject to `a x + s = b` with s in the cones.
pub(super) fn solver(
    cost: &[f64],
    a: &DMatrix<f64>,
    b: &[f64],
    cones: &[SupportedConeT<f64>],
) -> Result<DefaultSolver<f64>> {
    let (rows, n) = a.shape();
    let starts = (0..=n).map(|j| j * rows).collect();
    let places = (0..n).flat_map(|_| 0..rows).collect();
    let a = CscMatrix::new(rows, n, starts, places, a.as_slice().to_vec());
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .max_threads(1)
        .presolve_enable(false)
        .tol_gap_abs(TOLERANCE)
        .tol_gap_rel(TOLERANCE)
        .tol_feas(TOLERANCE)
        .build()
        .map_err(failure)?;
    DefaultSolver::new(&CscMatrix::zeros((n, n)), cost, &a, b, cones, settings).map_err(failure)
}

pub(super) fn failure(problem: impl ToString) -> Error {
    Error::Numeric { what: "linear program".into(), problem: problem.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The maximum of x + y on the segment x = 2 y with y in [least, 3].
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
    fn what_nothing_meets_is_missed_by_so_much() {
        for (least, missed) in [(-1.0, 0.0), (3.0, 0.0), (3.5, 0.25)] {
            let (value, _) = segment(least).elastic().solve().unwrap().unwrap();
            assert!((value + missed).abs() < 1e-7, "{least}: {value}");
        }
    }

    #[test]
    fn no_bound_is_an_error() {
        let mut program = LinearProgram::maximise(vec![1.0, 1.0]);
        program.at_most.push((vec![1.0, 0.0], 1.0));
        assert!(program.solve().is_err());
    }
}
