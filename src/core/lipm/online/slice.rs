//! The slice of a maximal CPI set over COM positions, for pictures: the COM positions for which the CPI set contains
//! the state, at the present COM velocity and ZMP.
//!
//! Each predicted ZMP is affine in the COM, so each edge of Z cuts off a half-plane of COM positions (eq. 22, two of
//! its six columns). The cutting ends by the rule that ends the test of a state: if at every corner of the remaining
//! slice all points lie in Z less the limit of the spread, they do so on the whole slice, and nothing more is cut off.

use super::{MAX_TICKS, OnlineSets, Points, is_finite};
use crate::lipm::pendulum::State;
use nalgebra::Point2;

/// Limit of the slice's distance from the origin, in distances of the farthest edge of Z: no leg stands beyond it.
const FARTHEST: f64 = 20.0;

impl OnlineSets {
    /// Corners of the slice of the CPI set of gain `index`, at the COM velocity and ZMP of `state` (m, control frame),
    /// counter-clockwise; empty if no COM position is in the CPI set.
    pub fn slice(&self, index: usize, state: &State) -> Vec<Point2<f64>> {
        let cascade = &self.cascades[index];
        if !cascade.limit.holds_origin || !is_finite(state) {
            return Vec::new();
        }
        let far = FARTHEST * cascade.region.farthest();
        let near = -far;
        let mut corners: Vec<Corner> = [(near, near), (far, near), (far, far), (near, far)]
            .map(|(x, y)| {
                let com = Point2::new(x, y);
                Corner {
                    com,
                    points: cascade.start(&State::new(com, state.com_vel(), state.zmp())),
                }
            })
            .to_vec();
        for tick in 0..MAX_TICKS {
            let region = cascade.region.less(cascade.spread.after(tick));
            for (x, y) in region.x.iter().zip(region.y) {
                corners = cut(&corners, |corner| {
                    let [zmp_x, zmp_y] = cascade.zmp(&corner.points);
                    x * zmp_x + y * zmp_y - 1.0
                });
            }
            if corners
                .iter()
                .all(|corner| cascade.bound(&corner.points, 0.0) <= 1.0)
            {
                break;
            }
            for corner in &mut corners {
                cascade.advance(&mut corner.points);
            }
        }
        corners.into_iter().map(|corner| corner.com).collect()
    }
}

/// A corner of the slice, with its present prediction.
#[derive(Clone, Copy)]
struct Corner {
    com: Point2<f64>,
    points: Points,
}

impl Corner {
    /// A corner between two others. The prediction is linear in the COM.
    fn between(a: &Self, b: &Self, share: f64) -> Self {
        let mut points = a.points;
        for (p, q) in points.iter_mut().zip(b.points) {
            for (p, q) in p.iter_mut().zip(q) {
                *p += share * (q - *p);
            }
        }
        Self {
            com: a.com + share * (b.com - a.com),
            points,
        }
    }
}

/// The part of a convex polygon without excess.
fn cut(corners: &[Corner], excess: impl Fn(&Corner) -> f64) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (i, a) in corners.iter().enumerate() {
        let b = &corners[(i + 1) % corners.len()];
        let (of_a, of_b) = (excess(a), excess(b));
        if of_a <= 0.0 {
            kept.push(*a);
        }
        if (of_a < 0.0 && of_b > 0.0) || (of_a > 0.0 && of_b < 0.0) {
            kept.push(Corner::between(a, b, of_a / (of_a - of_b)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::SupportPolygon;
    use crate::lipm::testing::family;
    use nalgebra::Vector2;

    /// The definition: a COM is in the slice if and only if the CPI set contains the state with that COM.
    #[test]
    fn the_slice_is_where_the_set_holds_the_state() {
        let family = family();
        let mut sets = OnlineSets::new(&family);
        let z = SupportPolygon::hull(
            &[(-0.05, -0.08), (0.07, -0.06), (0.04, 0.08), (-0.05, 0.06)]
                .map(|(x, y)| Point2::new(x, y)),
        );
        sets.update(&z.unwrap());
        for (com_vel, zmp) in [
            ((0.0, 0.0), (0.0, 0.0)),
            ((0.15, -0.1), (0.01, 0.02)),
            ((-0.2, 0.2), (-0.03, 0.0)),
        ] {
            let state = |com: Point2<f64>| {
                State::new(
                    com,
                    Vector2::new(com_vel.0, com_vel.1),
                    Point2::new(zmp.0, zmp.1),
                )
            };
            for gain in 0..family.gains.len() {
                let slice = sets.slice(gain, &state(Point2::origin()));
                assert!(slice.len() >= 3, "gain {gain}: {slice:?}");
                let middle =
                    slice.iter().map(|p| p.coords).sum::<Vector2<f64>>() / slice.len() as f64;
                for (i, a) in slice.iter().enumerate() {
                    let b = slice[(i + 1) % slice.len()];
                    for on_edge in [*a, a + 0.5 * (b - a)] {
                        let moved = |share: f64| {
                            state(Point2::from(middle + share * (on_edge.coords - middle)))
                        };
                        assert!(
                            sets.holds(gain, &moved(1.0 - 1e-6)),
                            "gain {gain}: {on_edge} is not in the set"
                        );
                        assert!(
                            !sets.holds(gain, &moved(1.0 + 1e-6)),
                            "gain {gain}: {on_edge} is not at the border"
                        );
                    }
                }
            }
        }
        // The COM is faster than this support can stop, with the ZMP far behind.
        let lost = State::new(
            Point2::origin(),
            Vector2::new(3.0, 0.0),
            Point2::new(-0.5, 0.0),
        );
        assert!(sets.slice(0, &lost).is_empty());
        sets.clear();
        assert!(sets.slice(0, &State::default()).is_empty());
    }
}
