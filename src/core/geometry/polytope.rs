//! Convex polytopes `{x | S x <= 1}`, and linear programs on them (by Clarabel).

use crate::error::{Error, Result};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use nalgebra::{DMatrix, DVector, RowDVector};

/// A convex set with the origin inside: `{x | S x <= 1}`, with one row of S for each half space. It may be unbounded.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    /// S, which may contain redundant rows.
    pub rows: DMatrix<f64>,
}

/// The largest value of a linear function on a polytope.
#[derive(Debug, Clone, PartialEq)]
pub struct Maximum {
    /// The maximum; infinite if the function is unbounded on the set.
    pub value: f64,
    /// The point of the maximum; the origin if the function is unbounded.
    pub at: DVector<f64>,
}

/// Accuracy of the solver, relative to right-hand sides of 1.
const TOLERANCE: f64 = 1e-10;
/// Relative size of a linear function's part outside of the span of the rows, above which it counts as unbounded.
const SPAN_TOLERANCE: f64 = 1e-9;

impl Polytope {
    /// `min over rows of 1 - row . x`, which is not negative inside the set and 1 at the origin.
    pub fn margin(&self, x: &[f64]) -> f64 {
        1.0 - self.gauge(x)
    }

    /// `max(0, max over rows of row . x)`: the factor by which the set must be scaled for x to lie on its boundary.
    pub fn gauge(&self, x: &[f64]) -> f64 {
        self.rows
            .row_iter()
            .map(|row| row.iter().zip(x).map(|(r, x)| r * x).sum())
            .fold(0.0, f64::max)
    }

    /// Whether x lies in the set.
    pub fn contains(&self, x: &[f64]) -> bool {
        self.margin(x) >= 0.0
    }

    /// Prepares linear programs on this set. It fails if the solver refuses the problem.
    pub fn programs(&self) -> Result<Programs> {
        let (count, n) = self.rows.shape();
        let column = DVector::from_iterator(
            n,
            self.rows
                .column_iter()
                .map(|c| if c.amax() > 0.0 { c.amax() } else { 1.0 }),
        );
        let mut scaled = self.rows.clone();
        for (mut c, s) in scaled.column_iter_mut().zip(column.iter()) {
            c /= *s;
        }
        let svd = scaled.clone().svd(false, true);
        let v_t = svd.v_t.ok_or_else(|| failure("no singular vectors"))?;
        let largest = svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|&i| svd.singular_values[i] > 1e-11 * largest)
            .collect();
        let rank = kept.len();
        let size = (count as f64).sqrt();
        let sigma = |k: usize| svd.singular_values[kept[k]] / size;
        let dual = DMatrix::from_fn(n, rank, |i, k| v_t[(kept[k], i)] / sigma(k));
        let basis = DMatrix::from_fn(n, rank, |i, k| v_t[(kept[k], i)] * sigma(k));

        let solver = solver(&(scaled * &dual))?;
        Ok(Programs {
            basis,
            dual,
            column,
            solver,
        })
    }

    /// Whether this set is a subset of `other`, up to `tolerance` on the right-hand sides of `other`. It solves one
    /// linear program for each row of `other`, and ends at the first that fails.
    pub fn is_subset_of(&self, other: &Polytope, tolerance: f64) -> Result<bool> {
        let mut programs = self.programs()?;
        // Distant rows come first: neighbouring rows are similar, so this finds a violation early.
        const STRIDE: usize = 16;
        for i in (0..STRIDE).flat_map(|start| (start..other.rows.nrows()).step_by(STRIDE)) {
            if programs.maximise(&other.rows.row(i).into_owned())?.value > 1.0 + tolerance {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Linear programs on one polytope. The solver is set up once for all of them.
///
/// They are solved in coordinates in which the rows of S are about orthonormal, because the rows of a sampled system
/// are nearly parallel. The set may be unbounded in directions that no row contains; these are left out.
pub struct Programs {
    /// x = basis * reduced coordinates.
    basis: DMatrix<f64>,
    /// reduced row = row * dual, and `dual * basis^T` is the projector on the span of the rows.
    dual: DMatrix<f64>,
    /// Scale of each column of S, since units differ by column.
    column: DVector<f64>,
    solver: DefaultSolver<f64>,
}

impl Programs {
    /// Maximises `row . x` over the set. It fails if the solver gives up.
    pub fn maximise(&mut self, row: &RowDVector<f64>) -> Result<Maximum> {
        let unbounded = || Maximum {
            value: f64::INFINITY,
            at: DVector::zeros(self.column.len()),
        };
        let scaled = RowDVector::from_iterator(
            row.len(),
            row.iter().zip(self.column.iter()).map(|(r, c)| r / c),
        );
        let reduced = &scaled * &self.dual;
        let unseen = &scaled - &reduced * self.basis.transpose();
        if unseen.norm() > SPAN_TOLERANCE * scaled.norm() {
            return Ok(unbounded());
        }
        // Equilibration was done for another cost, and remains meaningful with a cost of unit size.
        let size = reduced.norm();
        if size == 0.0 {
            return Ok(Maximum {
                value: 0.0,
                at: DVector::zeros(self.column.len()),
            });
        }
        let cost: Vec<f64> = reduced.iter().map(|c| -c / size).collect();
        self.solver.update_q(&cost).map_err(failure)?;
        self.solver.solve();
        let solution = &self.solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => {
                let reduced_at = DVector::from_column_slice(&solution.x);
                let at = (&self.dual * reduced_at).component_div(&self.column);
                Ok(Maximum {
                    value: -solution.obj_val * size,
                    at,
                })
            }
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Ok(unbounded()),
            status => Err(failure(format!("{status:?}"))),
        }
    }
}

/// A solver for programs on `a x <= 1`, still without a cost.
fn solver(a: &DMatrix<f64>) -> Result<DefaultSolver<f64>> {
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
    let (cost, one) = (vec![0.0; n], vec![1.0; rows]);
    DefaultSolver::new(
        &CscMatrix::zeros((n, n)),
        &cost,
        &a,
        &one,
        &[NonnegativeConeT(rows)],
        settings,
    )
    .map_err(failure)
}

fn failure(problem: impl ToString) -> Error {
    Error::Numeric {
        what: "linear program".into(),
        problem: problem.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    /// The set |x| <= 2, |y| <= 4, with z free.
    fn slab() -> Polytope {
        Polytope {
            rows: dmatrix![0.5, 0.0, 0.0; -0.5, 0.0, 0.0; 0.0, 0.25, 0.0; 0.0, -0.25, 0.0],
        }
    }

    #[test]
    fn a_linear_function_is_largest_at_a_corner_or_unbounded() {
        let mut programs = slab().programs().unwrap();
        let corner = programs
            .maximise(&RowDVector::from_row_slice(&[1.0, -3.0, 0.0]))
            .unwrap();
        assert!((corner.value - 14.0).abs() < 1e-7);
        assert!((corner.at[0] - 2.0).abs() < 1e-7 && (corner.at[1] + 4.0).abs() < 1e-7);
        assert_eq!(
            programs
                .maximise(&RowDVector::from_row_slice(&[0.0, 0.0, 1e-3]))
                .unwrap()
                .value,
            f64::INFINITY
        );
        assert_eq!(programs.maximise(&RowDVector::zeros(3)).unwrap().value, 0.0);
    }

    #[test]
    fn a_cone_is_unbounded_within_the_span_of_its_rows() {
        let quadrant = Polytope {
            rows: dmatrix![1.0, 0.0; 0.0, 1.0],
        };
        let mut programs = quadrant.programs().unwrap();
        assert_eq!(
            programs
                .maximise(&RowDVector::from_row_slice(&[-1.0, 0.0]))
                .unwrap()
                .value,
            f64::INFINITY
        );
        assert!(
            (programs
                .maximise(&RowDVector::from_row_slice(&[1.0, 1.0]))
                .unwrap()
                .value
                - 2.0)
                .abs()
                < 1e-7
        );
    }
}
