//! Maximal CPI sets by linear programs (paper, Sect. III.C, eq. 19-22).
//!
//! The maximal constraint positively invariant (CPI) set of a closed loop with a support polygon Z is the set of all
//! states from which the loop runs to the origin without the ZMP ever leaving Z. It is a polytope with finitely many
//! rows (eq. 22). With a pole at -omega the set is unbounded along the convergent mode, since the feedback does not
//! read this mode.
//!
//! The set of a gain with a [`Spread`] is the maximal robust CPI set: the ZMP stays inside for all disturbances. Then
//! the rows of each prediction are relative to Z less the spread at that prediction.

use super::disturbance::Spread;
use super::gains::{Gain, GainFamily};
use super::pendulum::Pendulum;
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::geometry::polytope::Polytope;
use nalgebra::{DMatrix, Vector2};
use std::sync::{Mutex, PoisonError};

/// Largest number of periods in a search. A search that needs more fails.
pub const MAX_HORIZON: usize = 8192;
/// Excess below which a row is redundant: no state of the set exceeds the row by more.
const REDUNDANT: f64 = 1e-9;
/// Excess below which sets count as nested: no state of the inner set exceeds a row of the outer set by more.
const NESTED: f64 = 1e-6;

/// The maximal CPI set (O_inf) of one gain on one support polygon.
#[doc(alias = "MOAS")]
#[derive(Debug, Clone)]
pub struct CpiSet {
    pub gain: String,
    pub pendulum: Pendulum,
    pub polygon: SupportPolygon,
    /// k of eq. 22: the predictions from 0 to k periods ahead define the set.
    pub horizon: usize,
    /// How far disturbances can move the ZMP, in x and y (m); 0 without disturbances.
    pub spread_m: [f64; 2],
    /// S of eq. 22: p (k + 1) rows on the state of eq. 5, for p edges. The rows of one prediction stand together.
    pub set: Polytope,
}

impl CpiSet {
    /// Computes the set of `gain` on `polygon` (control frame).
    ///
    /// It fails if the origin is not strictly inside the polygon less the spread of the gain, since the set is then
    /// empty, or if the search does not end within [`MAX_HORIZON`].
    pub fn search(gain: &Gain, pendulum: Pendulum, polygon: &SupportPolygon) -> Result<Self> {
        let (horizon, set) = smallest_horizon(Stack::of(gain, polygon)?).map_err(|e| match e {
            Error::Numeric { what, problem } => Error::Numeric {
                what: format!("gain {:?}: {what}", gain.name),
                problem,
            },
            other => other,
        })?;
        Ok(Self {
            gain: gain.name.clone(),
            pendulum,
            polygon: *polygon,
            horizon,
            spread_m: gain.spread.limit(),
            set,
        })
    }

    /// The sets of all gains of a family, slow to fast. It fails as [`Self::search`] does.
    pub fn search_family(family: &GainFamily, polygon: &SupportPolygon) -> Result<Vec<Self>> {
        family
            .gains
            .iter()
            .map(|gain| Self::search(gain, family.pendulum, polygon))
            .collect()
    }

    /// The rows of eq. 22 and 25 for a given k, which need not be large enough.
    pub fn stacked(gain: &Gain, polygon: &SupportPolygon, horizon: usize) -> Result<Polytope> {
        Ok(Stack::of(gain, polygon)?.up_to(horizon))
    }

    /// Largest COM velocity along `direction` (m/s, that is impulse per mass) for which the set contains the state,
    /// with COM and ZMP at the origin.
    pub fn largest_com_vel_from_rest(&self, direction: Vector2<f64>) -> f64 {
        let d = direction.normalize();
        1.0 / self.set.gauge(&[0.0, d.x, 0.0, 0.0, d.y, 0.0])
    }

    /// Largest impulse J from rest along `direction`, divided by `m omega d`, with d from the origin to the polygon's
    /// edge. The value 1 would be the largest impulse without a footstep.
    pub fn largest_impulse_from_rest(&self, direction: Vector2<f64>) -> f64 {
        let d = self
            .polygon
            .distance_along(nalgebra::Point2::origin(), direction)
            .unwrap_or(f64::NAN);
        self.largest_com_vel_from_rest(direction) / (self.pendulum.omega * d)
    }

    /// Whether this set lies inside `other`, up to a millionth of its size. Fails if the solver gives up.
    pub fn is_subset_of(&self, other: &CpiSet) -> Result<bool> {
        self.set.is_subset_of(&other.set, NESTED)
    }
}

/// Which CPI sets of a family lie inside which.
#[derive(Debug, Clone, PartialEq)]
pub struct Inclusion {
    /// Names of the gains, slow to fast.
    pub names: Vec<String>,
    /// `inside[i][j]` tells whether the set of gain i lies inside the set of gain j.
    pub inside: Vec<Vec<bool>>,
}

impl Inclusion {
    /// Compares all pairs. Fails if the solver gives up.
    pub fn of(sets: &[CpiSet]) -> Result<Self> {
        let n = sets.len();
        let mut inside = vec![vec![false; n]; n];
        // Neighbours come first: inclusion is transitive, and proving it costs far more than a counter-example.
        for distance in 0..n {
            for i in 0..n {
                for j in [i.checked_sub(distance), Some(i + distance)]
                    .into_iter()
                    .flatten()
                    .filter(|j| *j < n)
                {
                    let between = i.min(j) + 1..i.max(j);
                    inside[i][j] = i == j
                        || between.clone().any(|b| inside[i][b] && inside[b][j])
                        || sets[i].is_subset_of(&sets[j])?;
                }
            }
        }
        Ok(Self {
            names: sets.iter().map(|s| s.gain.clone()).collect(),
            inside,
        })
    }

    /// Pairs (slow, fast) of neighbouring gains whose sets do not nest.
    pub fn failures(&self) -> Vec<(usize, usize)> {
        (1..self.names.len())
            .filter(|&fast| !self.inside[fast][fast - 1])
            .map(|fast| (fast - 1, fast))
            .collect()
    }

    /// A warning if the sets of the family do not nest; None if they do.
    pub fn warning(&self) -> Option<String> {
        warning(&self.names, &self.failures())
    }
}

/// Checks inclusion when a family is loaded: returns a warning if the CPI set of a gain is not inside the set of its
/// slower neighbour. This is faster than [`Inclusion::of`], which compares all pairs. For the same gains on the same
/// polygon the result is computed once in a process, since it takes hundreds of linear programs.
///
/// It fails as [`CpiSet::search`] does.
pub fn nesting_warning(family: &GainFamily, support: &SupportPolygon) -> Result<Option<String>> {
    static KNOWN: Mutex<Vec<(GainFamily, SupportPolygon, Option<String>)>> = Mutex::new(Vec::new());
    // The lock is held during the search, so that threads with the same question wait for one answer.
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    for (other, polygon, warning) in known.iter() {
        if (&other.pendulum, &other.gains) == (&family.pendulum, &family.gains)
            && polygon.vertices() == support.vertices()
        {
            return Ok(warning.clone());
        }
    }
    let sets = CpiSet::search_family(family, support)?;
    let names: Vec<String> = sets.iter().map(|s| s.gain.clone()).collect();
    let mut failures = Vec::new();
    for fast in 1..sets.len() {
        if !sets[fast].is_subset_of(&sets[fast - 1])? {
            failures.push((fast - 1, fast));
        }
    }
    let warning = warning(&names, &failures);
    known.push((family.clone(), *support, warning.clone()));
    Ok(warning)
}

fn warning(names: &[String], failures: &[(usize, usize)]) -> Option<String> {
    if failures.is_empty() {
        return None;
    }
    let pairs: Vec<String> = failures
        .iter()
        .map(|&(slow, fast)| format!("{:?} is not inside {:?}", names[fast], names[slow]))
        .collect();
    Some(format!(
        "the CPI sets of the gains do not nest: {}; after a switch to a faster gain, the slower set may not contain the state",
        pairs.join(", ")
    ))
}

/// The maximal CPI set of `x(j+1) = a x(j)` with `s0 x(j) <= 1` for all j: its k and its rows (eq. 20-22).
///
/// It fails if there is no k up to [`MAX_HORIZON`], with a pole at or near the stability limit, or if the solver gives
/// up.
pub fn maximal_cpi(a: &DMatrix<f64>, s0: &DMatrix<f64>) -> Result<(usize, Polytope)> {
    smallest_horizon(Stack {
        a: a.clone(),
        blocks: vec![s0.clone()],
        spread: Spread::default(),
    })
}

/// The smallest k of a stack that has all rows of the set, with these rows.
///
/// The paper increases i until all rows of prediction i + 1 are redundant, each tested by a linear program on Set(S_i).
/// From then on they stay redundant (`Set(S_i) = Set(S_i+1)` is invariant), so doubling and bisection find k with fewer
/// programs. This also holds with disturbances (Kolmanovsky and Gilbert 1998, theorem 6.3).
fn smallest_horizon(mut stack: Stack) -> Result<(usize, Polytope)> {
    // The smallest k that passes the test lies in low..=high.
    let (mut low, mut high) = (0, 8);
    while !stack.ends_at(high)? {
        (low, high) = (high + 1, 2 * high);
        if high > MAX_HORIZON {
            return Err(Error::Numeric {
                what: "maximal CPI set".into(),
                problem: format!(
                    "the search did not end within {MAX_HORIZON} periods: a pole is too slow, or the loop is unstable"
                ),
            });
        }
    }
    while low < high {
        let middle = (low + high) / 2;
        if stack.ends_at(middle)? {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    Ok((high, stack.up_to(high)))
}

/// The rows `s0 a^j` of the predictions computed so far.
struct Stack {
    a: DMatrix<f64>,
    blocks: Vec<DMatrix<f64>>,
    /// The disturbances, for a state as in eq. 5.
    spread: Spread,
}

impl Stack {
    /// The stack of a gain on a polygon. It fails if the CPI set is empty.
    fn of(gain: &Gain, polygon: &SupportPolygon) -> Result<Self> {
        let stack = Self {
            a: closed_loop(gain),
            blocks: vec![constraint_rows(polygon)?],
            spread: gain.spread.clone(),
        };
        if (0..stack.blocks[0].nrows()).any(|edge| stack.distance(edge, gain.spread.limit()) <= 0.0)
        {
            let [x, y] = gain.spread.limit();
            let (gain, value) = (&gain.name, format!("{x:.4} m in x and {y:.4} m in y"));
            let problem = format!(
                "moves the ZMP of gain {gain:?} out of the support, so no set contains any state"
            );
            return Err(Error::value(
                "support",
                "spread",
                value,
                problem,
                "a smaller zmp_disturbance",
            ));
        }
        Ok(stack)
    }

    /// Distance of an edge of Z less a spread (m), as a share of the distance of the edge of Z.
    fn distance(&self, edge: usize, [x, y]: [f64; 2]) -> f64 {
        let row = self.blocks[0].row(edge);
        1.0 - row[2].abs() * x - row[5].abs() * y
    }

    /// The rows of prediction j.
    fn block(&mut self, j: usize) -> DMatrix<f64> {
        while self.blocks.len() <= j {
            let next = &self.blocks[self.blocks.len() - 1] * &self.a;
            self.blocks.push(next);
        }
        let mut block = self.blocks[j].clone();
        if !self.spread.is_none() {
            for (edge, mut row) in block.row_iter_mut().enumerate() {
                row /= self.distance(edge, self.spread.after(j));
            }
        }
        block
    }

    /// S_k of eq. 21 and 22.
    fn up_to(&mut self, k: usize) -> Polytope {
        let (p, n) = self.blocks[0].shape();
        let mut rows = DMatrix::zeros(p * (k + 1), n);
        for j in 0..=k {
            rows.rows_mut(p * j, p).copy_from(&self.block(j));
        }
        Polytope { rows }
    }

    /// Whether Set(S_k) = Set(S_k+1).
    fn ends_at(&mut self, k: usize) -> Result<bool> {
        let mut programs = self.up_to(k).programs()?;
        let next = self.block(k + 1);
        for row in next.row_iter() {
            if programs.maximise(&row.into_owned())?.value > 1.0 + REDUNDANT {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

fn closed_loop(gain: &Gain) -> DMatrix<f64> {
    DMatrix::from_column_slice(6, 6, gain.closed_loop().as_slice())
}

/// M_Z C (eq. 14, 15, 20), with one row for each edge.
fn constraint_rows(polygon: &SupportPolygon) -> Result<DMatrix<f64>> {
    let mut rows = DMatrix::zeros(polygon.vertices().len(), 6);
    for (i, h) in polygon.half_planes().enumerate() {
        if h.distance <= 0.0 {
            let vertices: Vec<String> = polygon
                .vertices()
                .iter()
                .map(|v| format!("({}, {})", v.x, v.y))
                .collect();
            let (problem, accepted) = (
                "the origin is not inside, so no set contains any state",
                "a polygon with the origin strictly inside",
            );
            return Err(Error::value(
                "support",
                "polygon",
                vertices.join(" "),
                problem,
                accepted,
            ));
        }
        (rows[(i, 2)], rows[(i, 5)]) = (h.normal.x / h.distance, h.normal.y / h.distance);
    }
    Ok(rows)
}
