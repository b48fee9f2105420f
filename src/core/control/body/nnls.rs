//! Non-negative least squares of small fixed size, without allocation: `min 1/2 f' G f - c' f` over `f >= 0`. It uses
//! the active-set method of Lawson and Hanson (Solving Least Squares Problems, ch. 23), started from the last solution.
//!
//! Every iterate is feasible and no worse than the one before, so the result is usable even if the iterations run out.

use nalgebra::{SMatrix, SVector};

/// Number of unknowns: two soles with four corners each, and four friction edges per corner.
pub const SIZE: usize = 32;

pub type Unknowns = SVector<f64, SIZE>;
pub type Quadratic = SMatrix<f64, SIZE, SIZE>;

/// Largest number of factorisations per solve: three times the number of unknowns, as Lawson and Hanson advise.
const MOST_ROUNDS: usize = 3 * SIZE;

/// The solver and its last solution, from which the next solve starts.
#[derive(Debug, Clone)]
pub struct Nnls {
    /// The solution: never negative, and exactly 0 where the bound is active.
    pub f: Unknowns,
    /// Number of factorisations in the last solve.
    pub rounds: usize,
    /// Whether the last solve met the conditions of optimality before the rounds ran out.
    pub is_optimal: bool,
    free: [bool; SIZE],
    factor: Quadratic,
    trial: Unknowns,
}

impl Default for Nnls {
    fn default() -> Self {
        Self {
            f: Unknowns::zeros(),
            rounds: 0,
            is_optimal: true,
            free: [false; SIZE],
            factor: Quadratic::zeros(),
            trial: Unknowns::zeros(),
        }
    }
}

impl Nnls {
    /// Solves for a positive definite `g`, of which the lower triangle is read. Entries that are not `allowed` are 0.
    pub fn solve(&mut self, g: &Quadratic, c: &Unknowns, allowed: &[bool; SIZE]) {
        for (i, &is_allowed) in allowed.iter().enumerate() {
            self.free[i] &= is_allowed && self.f[i] > 0.0;
            if !self.free[i] {
                self.f[i] = 0.0;
            }
        }
        // The tolerance is relative to the terms of the slopes, to stay above rounding errors.
        let tolerance = 1e-10 * c.amax();
        let mut from_last = self.free.contains(&true);
        self.rounds = 0;
        self.is_optimal = false;
        while self.rounds < MOST_ROUNDS {
            if !from_last {
                let Some(next) = self.steepest(g, c, allowed, tolerance) else {
                    self.is_optimal = true;
                    return;
                };
                self.free[next] = true;
            }
            from_last = false;
            self.descend(g, c);
        }
    }

    /// The bound whose release lowers the objective fastest; None at the optimum.
    fn steepest(
        &self,
        g: &Quadratic,
        c: &Unknowns,
        allowed: &[bool; SIZE],
        tolerance: f64,
    ) -> Option<usize> {
        let mut steepest = (tolerance, None);
        for i in (0..SIZE).filter(|&i| allowed[i] && !self.free[i]) {
            // Only the lower triangle is stored.
            let slope = c[i]
                - (0..SIZE)
                    .map(|j| g[(i.max(j), i.min(j))] * self.f[j])
                    .sum::<f64>();
            if slope > steepest.0 {
                steepest = (slope, Some(i));
            }
        }
        steepest.1
    }

    /// Goes to the minimum of the objective over the free entries. Entries that would become negative are bound to 0.
    fn descend(&mut self, g: &Quadratic, c: &Unknowns) {
        while self.rounds < MOST_ROUNDS {
            self.rounds += 1;
            if !self.solve_free(g, c) {
                return;
            }
            let mut share = 1.0;
            let mut first = None;
            for i in (0..SIZE).filter(|&i| self.free[i] && self.trial[i] <= 0.0) {
                // An entry that was just freed and would turn negative stays at its bound: the step is 0.
                let step = if self.f[i] > 0.0 {
                    self.f[i] / (self.f[i] - self.trial[i])
                } else {
                    0.0
                };
                if first.is_none() || step < share {
                    (share, first) = (step, Some(i));
                }
            }
            for i in 0..SIZE {
                if self.free[i] {
                    self.f[i] += share * (self.trial[i] - self.f[i]);
                    self.free[i] = self.f[i] > 0.0 && first != Some(i);
                }
                if !self.free[i] {
                    self.f[i] = 0.0;
                }
            }
            if first.is_none() {
                return;
            }
        }
    }

    /// Writes the unconstrained minimum over the free entries to `trial`, by Cholesky factorisation. Returns false if
    /// `g` is not positive definite there.
    fn solve_free(&mut self, g: &Quadratic, c: &Unknowns) -> bool {
        let mut index = [0; SIZE];
        let mut count = 0;
        for i in (0..SIZE).filter(|&i| self.free[i]) {
            index[count] = i;
            count += 1;
        }
        let l = &mut self.factor;
        let mut y = [0.0; SIZE];
        for a in 0..count {
            for b in 0..=a {
                let sum: f64 = (0..b).map(|k| l[(a, k)] * l[(b, k)]).sum();
                let rest = g[(index[a], index[b])] - sum;
                if a > b {
                    l[(a, b)] = rest / l[(b, b)];
                } else if rest > 0.0 {
                    l[(a, a)] = rest.sqrt();
                } else {
                    return false;
                }
            }
            let sum: f64 = (0..a).map(|k| l[(a, k)] * y[k]).sum();
            y[a] = (c[index[a]] - sum) / l[(a, a)];
        }
        for a in (0..count).rev() {
            let sum: f64 = (a + 1..count).map(|k| l[(k, a)] * y[k]).sum();
            y[a] = (y[a] - sum) / l[(a, a)];
            self.trial[index[a]] = y[a];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A least-squares problem of six rows, with a small quadratic term for each unknown, as the soles give rise to.
    fn problem(entries: &[f64], wanted: &[f64]) -> (Quadratic, Unknowns) {
        let rows = SMatrix::<f64, 6, SIZE>::from_row_slice(entries);
        let wanted = SVector::<f64, 6>::from_row_slice(wanted);
        (
            rows.transpose() * rows + Quadratic::identity() * 1e-6,
            rows.transpose() * wanted,
        )
    }

    /// Checks the Karush-Kuhn-Tucker conditions: feasible, zero slope for free entries, no descent for bound ones. The
    /// problem is convex, so they imply the optimum.
    fn check(
        nnls: &Nnls,
        g: &Quadratic,
        c: &Unknowns,
        allowed: &[bool; SIZE],
    ) -> Result<(), TestCaseError> {
        let slope = c - g * nnls.f;
        for i in 0..SIZE {
            let (f, slope) = (nnls.f[i], slope[i]);
            let good = match (allowed[i], f > 0.0) {
                (false, _) => f == 0.0,
                (true, true) => slope.abs() < 1e-7,
                (true, false) => f == 0.0 && slope < 1e-7,
            };
            if !good {
                return Err(TestCaseError::fail(format!(
                    "entry {i}: {f}, slope {slope}, {} rounds",
                    nnls.rounds
                )));
            }
        }
        if nnls.is_optimal {
            Ok(())
        } else {
            Err(TestCaseError::fail("out of rounds"))
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

        /// Starts from zero, and from the solution of another problem.
        #[test]
        fn the_answer_is_the_optimum(
            entries in prop::collection::vec(-1.0..1.0f64, 6 * SIZE),
            wanted in prop::collection::vec(-10.0..10.0f64, 6),
            other in prop::collection::vec(-10.0..10.0f64, 6),
            allowed in prop::collection::vec(prop::bool::weighted(0.7), SIZE),
        ) {
            let allowed: [bool; SIZE] = allowed.try_into().unwrap();
            let (g, c) = problem(&entries, &wanted);
            let mut cold = Nnls::default();
            cold.solve(&g, &c, &allowed);
            check(&cold, &g, &c, &allowed)?;
            let mut warm = Nnls::default();
            warm.solve(&g, &problem(&entries, &other).1, &[true; SIZE]);
            warm.solve(&g, &c, &allowed);
            check(&warm, &g, &c, &allowed)?;
            prop_assert!((warm.f - cold.f).amax() < 1e-3, "{}", (warm.f - cold.f).amax());
            warm.solve(&g, &c, &allowed);
            prop_assert_eq!(warm.rounds, 1, "the same problem again is solved at once");
        }
    }
}
