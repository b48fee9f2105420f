//! Maximal CPI sets at every tick, on any support polygon, without a search (in place of eq. 23-25).
//!
//! Eq. 25 keeps the number k of periods for which eq. 22 looks at the predicted ZMP. That k was found for one polygon,
//! so on another one the set can be too large, which is the unsafe side. Here the rows are not stored. A row of eq. 22
//! states that the ZMP predicted j periods ahead lies inside an edge of Z, so the prediction is computed forward and
//! each predicted ZMP is tested against the edges. This needs a stopping rule that holds for every polygon.
//!
//! **The rule.** The observable part of a closed loop with poles `l_1 >= ... >= l_m` in [0, 1) is a cascade of
//! first-order lags with unit gain. With the output `y_m = zmp` and `y_{k-1}(j) = (y_k(j+1) - l_k y_k(j)) / (1 - l_k)`,
//!
//! ```text
//! y_k(j+1) = l_k y_k(j) + (1 - l_k) y_{k-1}(j),    y_0 = 0 (Cayley-Hamilton).
//! ```
//!
//! The `y_k` are points of the plane, because both axes run through the same lags, namely the poles of x and y
//! together. Each `y_k(j+1)` is a convex combination of two of the points 0, y_1(j), ..., y_m(j). So if these points
//! lie in a convex Z that contains the origin, all later ones do too, including the ZMP. Therefore a state is
//!
//! - *outside* of the maximal CPI set if a predicted ZMP leaves Z, and
//! - *inside* if at some j, with no such ZMP before, the points y_1 ... y_m lie in Z.
//!
//! One of the two happens, because y tends to 0, which is inside Z. So the result is the maximal CPI set itself on
//! every polygon with the origin inside, also if the polygon is off-centre or oblique, and with different poles in x
//! and y. This also holds for scaled Z. So the gauge `max over j of gauge_Z(zmp(j))` is known as soon as no y_k(j) has
//! a larger gauge than the ZMPs up to j, mostly when the ZMP is at its peak. In terms of eq. 25, k suits the present
//! polygon and state.
//!
//! **With disturbances** the ZMP predicted j periods ahead must lie in Z less the [`Spread`] at j, which grows to a
//! limit. The rule stays exact: a state is outside if a predicted ZMP leaves Z less the spread at its j, and inside if
//! at some j, with no such ZMP before, all points lie in Z less the limit, because all later ZMPs then lie there, too.
//! A gauge is relative to Z less the spread. If the limit leaves nothing of Z about the origin, the set is empty.

mod slice;

use super::disturbance::Spread;
use super::gains::{Gain, GainFamily};
use super::pendulum::{Pendulum, State};
use crate::geometry::SupportPolygon;
use nalgebra::{RowVector3, Vector2};

/// Largest number of lags of one gain: three poles for each axis.
const LAGS: usize = 6;
/// Largest number of ticks in a prediction. After them, the points that were reached count as the worst ones; they
/// bound all later ones. This is too strict, and never too generous.
const MAX_TICKS: usize = 4096;
/// Distance of an edge from the origin below which the CPI set is empty, as a share of the distance of the farthest
/// vertex.
const NEAREST_EDGE: f64 = 1e-8;
/// Distance of an edge of Z less the spread from the origin below which it is empty, as a share of the distance of the
/// edge of Z.
const MIN_DISTANCE: f64 = 1e-6;

/// The maximal CPI sets of a family on the present support polygon. An index beyond the gains panics.
#[derive(Debug, Clone)]
pub struct OnlineSets {
    cascades: Vec<Cascade>,
}

impl OnlineSets {
    /// The sets of a family, which are empty until [`Self::update`] sets the support polygon.
    pub fn new(family: &GainFamily) -> Self {
        let cascades = family
            .gains
            .iter()
            .map(|g| Cascade::new(&family.pendulum, g))
            .collect();
        Self { cascades }
    }

    /// Sets the support `polygon` in the control frame, whose origin is the desired place of the COM. If the origin is
    /// not strictly inside, the CPI sets are empty. It neither allocates nor searches.
    pub fn update(&mut self, polygon: &SupportPolygon) {
        let region = ZmpRows::new(polygon);
        for cascade in &mut self.cascades {
            cascade.update(region);
        }
    }

    /// Removes the support, so the sets are empty.
    pub fn clear(&mut self) {
        for cascade in &mut self.cascades {
            cascade.update(ZmpRows::EMPTY);
        }
    }

    /// Number of gains.
    pub(crate) fn len(&self) -> usize {
        self.cascades.len()
    }

    /// Margin of a state in the set of gain `index`: `min over rows of 1 - row . x` (eq. 22 with all rows). It is not
    /// negative inside the set, and 1 at rest at the origin; at -1 the polygon would have to be twice as large. It is
    /// negative infinity if the set is empty or the state is not finite.
    pub fn margin(&self, index: usize, state: &State) -> f64 {
        let (mut worst, mut bound) = (0.0_f64, f64::INFINITY);
        for (tick, points) in self.predictions(index, state) {
            let gauge = self.cascades[index].gauge(tick, &points);
            worst = worst.max(gauge);
            bound = self.cascades[index].bound(&points, gauge);
            if bound <= worst {
                break;
            }
        }
        1.0 - worst.max(bound)
    }

    /// Whether the set of gain `index` contains the state. This is the sign of [`Self::margin`], computed faster.
    pub fn holds(&self, index: usize, state: &State) -> bool {
        for (tick, points) in self.predictions(index, state) {
            let gauge = self.cascades[index].gauge(tick, &points);
            if gauge > 1.0 {
                return false;
            }
            if self.cascades[index].bound(&points, gauge) <= 1.0 {
                return true;
            }
        }
        false
    }

    /// The fastest gain whose set contains the state (Sect. III.D). None means that a footstep is necessary (eq. 26).
    pub fn fastest_holding(&self, state: &State) -> Option<usize> {
        (0..self.len()).rev().find(|&i| self.holds(i, state))
    }

    /// The ZMP error that a footstep has to make good (m), the paper's Delta p_Z, which the paper does not define. Of
    /// the ZMPs that gain `index` is going to ask for, take the one farthest outside of the support polygon, and
    /// subtract the nearest point of the polygon. The error points to where the robot is driven. It is zero if no such
    /// ZMP is outside.
    ///
    /// "Farthest" and "nearest" are by the gauge of the polygon, so the nearest point lies on the line to the origin.
    /// With plain distances, every push beyond a long edge, even a diagonal one, would give an error straight forward
    /// or backward. The error is also zero when there are no sets: in flight, or on one sole (with the origin outside).
    pub fn zmp_error(&self, index: usize, state: &State) -> Vector2<f64> {
        let (mut worst, mut error) = (1.0_f64, Vector2::zeros());
        for (tick, points) in self.predictions(index, state) {
            let gauge = self.cascades[index].gauge(tick, &points);
            if gauge > worst {
                (worst, error) = (
                    gauge,
                    Vector2::from(self.cascades[index].zmp(&points)) * (1.0 - 1.0 / gauge),
                );
            }
            // Later ZMPs are no farther outside than the present points, as for the CPI sets.
            if self.cascades[index].bound(&points, gauge) <= worst {
                break;
            }
        }
        error
    }

    /// The points of a gain now and at the coming ticks, with the number of the tick. There is no point if the sets are
    /// empty or the state is not finite.
    fn predictions(&self, index: usize, state: &State) -> impl Iterator<Item = (usize, Points)> {
        let cascade = &self.cascades[index];
        let ticks = if cascade.limit.holds_origin && is_finite(state) {
            MAX_TICKS
        } else {
            0
        };
        let mut points = cascade.start(state);
        (0..ticks).map(move |tick| {
            if tick > 0 {
                cascade.advance(&mut points);
            }
            (tick, points)
        })
    }
}

/// Z as the rows of M_Z (eq. 15), padded with zeros.
#[derive(Debug, Clone, Copy)]
struct ZmpRows {
    x: [f64; SupportPolygon::MAX],
    y: [f64; SupportPolygon::MAX],
    holds_origin: bool,
}

impl ZmpRows {
    const EMPTY: Self = Self {
        x: [0.0; SupportPolygon::MAX],
        y: [0.0; SupportPolygon::MAX],
        holds_origin: false,
    };

    fn new(polygon: &SupportPolygon) -> Self {
        let mut region = Self {
            holds_origin: true,
            ..Self::EMPTY
        };
        let farthest = polygon
            .vertices()
            .iter()
            .map(|v| v.coords.norm())
            .fold(0.0, f64::max);
        for (i, h) in polygon.half_planes().enumerate() {
            region.holds_origin &= h.distance > NEAREST_EDGE * farthest;
            (region.x[i], region.y[i]) = (h.normal.x / h.distance, h.normal.y / h.distance);
        }
        if region.holds_origin {
            region
        } else {
            Self::EMPTY
        }
    }

    /// Distance of the farthest edge from the origin (m).
    fn farthest(&self) -> f64 {
        let rows = self
            .x
            .iter()
            .zip(&self.y)
            .map(|(x, y)| x.hypot(*y))
            .filter(|norm| *norm > 0.0);
        1.0 / rows.fold(f64::INFINITY, f64::min)
    }

    /// Z less the rectangle of +-`spread` (m): the points that stay in Z if they are moved by any vector of the
    /// rectangle. It is empty unless it contains the origin.
    fn less(&self, [x, y]: [f64; 2]) -> Self {
        let mut rest = *self;
        for i in 0..SupportPolygon::MAX {
            let distance = 1.0 - self.x[i].abs() * x - self.y[i].abs() * y;
            rest.holds_origin &= distance > MIN_DISTANCE;
            (rest.x[i], rest.y[i]) = (self.x[i] / distance, self.y[i] / distance);
        }
        if rest.holds_origin { rest } else { Self::EMPTY }
    }

    /// The factor by which Z must be scaled for z to lie on its edge; at most 1 inside.
    fn gauge(&self, z: [f64; 2]) -> f64 {
        let mut largest = [0.0; 4];
        for (i, largest) in largest.iter_mut().enumerate() {
            let a = self.x[i] * z[0] + self.y[i] * z[1];
            let b = self.x[i + 4] * z[0] + self.y[i + 4] * z[1];
            *largest = if a > b { a } else { b };
        }
        largest.iter().fold(0.0, |m, &v| if v > m { v } else { m })
    }
}

/// The closed loop of one gain as a cascade of lags. It replaces Phi of eq. 24, for any number of periods.
#[derive(Debug, Clone)]
struct Cascade {
    /// The l_k, from slow to fast.
    lags: [f64; LAGS],
    /// Rows that map the x axis of the state to the x part of y_k. The last one in use gives the ZMP.
    x: [RowVector3<f64>; LAGS],
    y: [RowVector3<f64>; LAGS],
    len: usize,
    spread: Spread,
    /// Z.
    region: ZmpRows,
    /// Z less the limit of the spread. It is empty if this leaves no CPI set. Without disturbances it is Z.
    limit: ZmpRows,
}

/// The points y_1 ... y_m.
type Points = [[f64; 2]; LAGS];

impl Cascade {
    fn new(pendulum: &Pendulum, gain: &Gain) -> Self {
        let (of_x, of_y) = (gain.x.observable_poles(), gain.y.observable_poles());
        // The poles of both axes together. A pole of both axes appears as often as in the axis that has it more often.
        let mut poles = of_x.clone();
        let mut unmatched = of_x.clone();
        for p in &of_y {
            match unmatched.iter().position(|q| q == p) {
                Some(i) => drop(unmatched.swap_remove(i)),
                None => poles.push(*p),
            }
        }
        poles.sort_by(f64::total_cmp);

        let len = poles.len();
        let region = ZmpRows::EMPTY;
        let spread = gain.spread.clone();
        let mut cascade = Self {
            lags: [0.0; LAGS],
            x: Default::default(),
            y: Default::default(),
            len,
            spread,
            region,
            limit: region,
        };
        let lags = gain
            .x
            .cascade(pendulum, &poles)
            .into_iter()
            .zip(gain.y.cascade(pendulum, &poles));
        for (k, ((lag, of_x), (_, of_y))) in lags.enumerate() {
            (cascade.lags[k], cascade.x[k], cascade.y[k]) = (lag, of_x, of_y);
        }
        cascade
    }

    fn start(&self, state: &State) -> Points {
        let mut points = [[0.0; 2]; LAGS];
        for (k, point) in points[..self.len].iter_mut().enumerate() {
            *point = [(self.x[k] * state.x)[0], (self.y[k] * state.y)[0]];
        }
        points
    }

    fn advance(&self, points: &mut Points) {
        for k in (0..self.len).rev() {
            let before = if k == 0 { [0.0; 2] } else { points[k - 1] };
            for (p, b) in points[k].iter_mut().zip(before) {
                *p = self.lags[k] * *p + (1.0 - self.lags[k]) * b;
            }
        }
    }

    /// The last point, which is the ZMP.
    fn zmp(&self, points: &Points) -> [f64; 2] {
        points[self.len - 1]
    }

    fn update(&mut self, region: ZmpRows) {
        (self.region, self.limit) = (region, region.less(self.spread.limit()));
    }

    /// Gauge of the ZMP predicted for `tick` in Z less the spread at that tick.
    fn gauge(&self, tick: usize, points: &Points) -> f64 {
        if self.spread.is_none() {
            return self.region.gauge(self.zmp(points));
        }
        self.region
            .less(self.spread.after(tick))
            .gauge(self.zmp(points))
    }

    /// Bound of the gauges of all ZMPs from a tick on. `gauge` is the gauge at that tick.
    fn bound(&self, points: &Points, gauge: f64) -> f64 {
        let zmp = if self.spread.is_none() {
            gauge
        } else {
            self.limit.gauge(self.zmp(points))
        };
        points[..self.len - 1]
            .iter()
            .map(|p| self.limit.gauge(*p))
            .fold(zmp, |m, v| if v > m { v } else { m })
    }
}

fn is_finite(state: &State) -> bool {
    state.x.iter().chain(state.y.iter()).all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::super::testing::{cases, family};
    use super::*;
    use nalgebra::Point2;
    use proptest::prelude::*;

    /// The definition: simulate the closed loop for three seconds, take the ZMP farthest outside of Z, and subtract the
    /// point of Z on the line from it to the origin.
    fn by_roll_out(gain: &Gain, start: &State, z: &SupportPolygon) -> Vector2<f64> {
        let (mut state, mut farthest, mut worst) = (*start, 1.0, Vector2::zeros());
        for _ in 0..=1500 {
            let zmp = state.zmp().coords;
            if let Some(edge) = z.distance_along(Point2::origin(), zmp)
                && zmp.norm() / edge > farthest
            {
                (farthest, worst) = (zmp.norm() / edge, zmp - zmp.normalize() * edge);
            }
            state = gain.successor(&state);
        }
        worst
    }

    /// The polygon of both soles at home about the origin, the same polygon shifted, and the polygon of a diagonal
    /// stride.
    fn polygons() -> [SupportPolygon; 3] {
        let stride = [(0.02, 0.01), (0.11, 0.01), (0.11, 0.08), (0.02, 0.08)];
        let points: Vec<_> = stride
            .iter()
            .flat_map(|&(x, y)| [Point2::new(x, y), Point2::new(-x, -y)])
            .collect();
        [
            SupportPolygon::rectangle(-0.048, 0.048, -0.083, 0.083).unwrap(),
            SupportPolygon::rectangle(-0.08, 0.016, -0.01, 0.15).unwrap(),
            SupportPolygon::hull(&points).unwrap(),
        ]
    }

    proptest! {
        #![proptest_config(cases(4, 256))]

        #[test]
        fn the_zmp_error_is_that_of_a_roll_out(
            gain in 0..5_usize, which in 0..3_usize,
            com in [-0.05..0.05f64, -0.08..0.08f64], com_vel in [-0.8..0.8f64, -0.8..0.8f64],
            zmp in [-0.06..0.06f64, -0.1..0.1f64],
        ) {
            let (family, z) = (family(), polygons()[which]);
            let state = State::new(com.into(), com_vel.into(), zmp.into());
            let mut sets = OnlineSets::new(&family);
            sets.update(&z);
            let (found, wanted) =
                (sets.zmp_error(gain, &state), by_roll_out(&family.gains[gain], &state, &z));
            prop_assert!((found.norm() - wanted.norm()).abs() < 1e-9, "{found} {wanted}");
            // Two ZMPs may be equally far outside in different directions. Then either is right.
            prop_assert!((found - wanted).norm() < 1e-6, "{found} {wanted}");
            // There is an error exactly where no set contains the state.
            let margin = sets.margin(gain, &state);
            prop_assume!(margin.abs() > 1e-9);
            prop_assert_eq!(found == Vector2::zeros(), margin > 0.0, "{} {}", found, margin);
        }
    }

    #[test]
    fn the_zmp_error_points_where_the_robot_is_driven() {
        let family = family();
        let mut sets = OnlineSets::new(&family);
        sets.update(&polygons()[0]);
        let error = |sets: &OnlineSets, vx: f64, vy: f64| {
            sets.zmp_error(
                0,
                &State::new(Point2::origin(), Vector2::new(vx, vy), Point2::origin()),
            )
        };
        // This also holds if the ZMP leaves only the long edge.
        let diagonal = error(&sets, -0.4, -0.4);
        assert!(
            diagonal.x < -0.005 && (diagonal.y - diagonal.x).abs() < 1e-12,
            "{diagonal}"
        );
        assert_eq!(
            error(&sets, f64::NAN, 0.0),
            Vector2::zeros(),
            "a state that is no state asks for no footstep"
        );
        // One sole, beside the origin.
        sets.update(&SupportPolygon::rectangle(-0.048, 0.048, 0.014, 0.083).unwrap());
        assert_eq!(error(&sets, -0.5, 0.0), Vector2::zeros());
    }
}
