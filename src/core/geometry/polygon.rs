//! Convex support polygons, in which the ZMP can be (eq. 4, 15-18 of the paper).
//!
//! A polygon is a value of fixed size, so the controller can build a new one at every tick without allocating.

use nalgebra::{Point2, Vector2};

/// A convex polygon with counter-clockwise vertices, at most [`SupportPolygon::MAX`] of them (two soles have eight).
///
/// Lengths are in metres. The frame is the caller's; the gain sets need the control frame. The area is always positive:
/// no two vertices coincide and no three lie on a line (up to 10^-8 of its size).
#[derive(Debug, Clone, Copy)]
pub struct SupportPolygon {
    vertices: [Point2<f64>; Self::MAX],
    len: usize,
}

/// The half plane `normal . z <= distance` with a unit normal that points out of the polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfPlane {
    pub normal: Vector2<f64>,
    /// Distance of the edge from the origin (m), positive if the origin lies strictly inside.
    pub distance: f64,
}

impl HalfPlane {
    /// Distance of `point` from the line of the edge (m), positive outside.
    pub fn excess(&self, point: Point2<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.distance
    }
}

/// Largest number of points for a hull: the vertices of a polygon that was cut by the half planes of another one.
const SCRATCH: usize = 2 * SupportPolygon::MAX;

/// Distance of a vertex to the line through its neighbours below which it is removed, as a share of the distance from
/// the first vertex to the farthest one.
const FLAT: f64 = 1e-8;

impl SupportPolygon {
    /// Largest number of vertices.
    pub const MAX: usize = 8;

    /// Convex hull of at most 16 points. None if the points do not span an area, are not finite, or are too many.
    ///
    /// If the hull has more than [`Self::MAX`] vertices, those that contribute least area are removed. The result is
    /// then smaller than the hull, never larger.
    pub fn hull(points: &[Point2<f64>]) -> Option<Self> {
        if points.len() > SCRATCH || points.iter().any(|p| !p.x.is_finite() || !p.y.is_finite()) {
            return None;
        }
        let mut sorted = [Point2::origin(); SCRATCH];
        let sorted = &mut sorted[..points.len()];
        sorted.copy_from_slice(points);
        sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));

        // Andrew's monotone chain: the lower hull from left to right, then the upper one back.
        let mut chain = [Point2::origin(); 2 * SCRATCH];
        let mut len = 0;
        for upper in [false, true] {
            let start = len;
            for i in 0..sorted.len() {
                let p = if upper {
                    sorted[sorted.len() - 1 - i]
                } else {
                    sorted[i]
                };
                while len >= start + 2 && turn(chain[len - 2], chain[len - 1], p) <= 0.0 {
                    len -= 1;
                }
                chain[len] = p;
                len += 1;
            }
            // The last point of one chain is the first of the other.
            len = len.saturating_sub(1);
        }
        Self::simplified(&mut chain, len)
    }

    /// Removes the flattest vertices until the polygon fits and has no flat vertex left.
    fn simplified(vertices: &mut [Point2<f64>], mut len: usize) -> Option<Self> {
        let size = vertices[..len]
            .iter()
            .map(|v| (v - vertices[0]).norm())
            .fold(0.0, f64::max);
        loop {
            if len < 3 {
                return None;
            }
            let corner = |i: usize| {
                let (a, b, c) = (
                    vertices[(i + len - 1) % len],
                    vertices[i],
                    vertices[(i + 1) % len],
                );
                (turn(a, b, c), (c - a).norm())
            };
            let flattest = (0..len).min_by(|&i, &j| corner(i).0.total_cmp(&corner(j).0))?;
            let flat = (0..len).find(|&i| corner(i).0 <= FLAT * size * corner(i).1);
            match flat.or((len > Self::MAX).then_some(flattest)) {
                None => break,
                Some(i) => {
                    vertices.copy_within(i + 1..len, i);
                    len -= 1;
                }
            }
        }
        let mut kept = [Point2::origin(); Self::MAX];
        kept[..len].copy_from_slice(&vertices[..len]);
        Some(Self {
            vertices: kept,
            len,
        })
    }

    /// The axis-parallel rectangle of eq. 16; None unless `xmin < xmax` and `ymin < ymax`.
    pub fn rectangle(xmin: f64, xmax: f64, ymin: f64, ymax: f64) -> Option<Self> {
        if !(xmin < xmax && ymin < ymax) {
            return None;
        }
        Self::hull(
            &[(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)]
                .map(|(x, y)| Point2::new(x, y)),
        )
    }

    /// Vertices, counter-clockwise.
    pub fn vertices(&self) -> &[Point2<f64>] {
        &self.vertices[..self.len]
    }

    /// Edges as pairs of vertices, counter-clockwise.
    pub fn edges(&self) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> + '_ {
        (0..self.len).map(|i| (self.vertices[i], self.vertices[(i + 1) % self.len]))
    }

    /// The half planes of the edges, in the order of [`Self::edges`]. `normal / distance` is a row of M_Z in eq. 15.
    pub fn half_planes(&self) -> impl Iterator<Item = HalfPlane> + '_ {
        self.edges().map(|(a, b)| {
            let along = b - a;
            let normal = Vector2::new(along.y, -along.x).normalize();
            HalfPlane {
                normal,
                distance: normal.dot(&a.coords),
            }
        })
    }

    /// Whether `point` lies in the polygon or on its boundary.
    pub fn contains(&self, point: Point2<f64>) -> bool {
        self.half_planes().all(|h| h.excess(point) <= 0.0)
    }

    /// Distance to the boundary (m): positive outside, negative inside.
    pub fn signed_distance(&self, point: Point2<f64>) -> f64 {
        let deepest = self
            .half_planes()
            .map(|h| h.excess(point))
            .fold(f64::NEG_INFINITY, f64::max);
        if deepest <= 0.0 {
            deepest
        } else {
            (point - self.nearest_on_boundary(point)).norm()
        }
    }

    /// The point of the polygon nearest to `point`, which is `point` itself if it lies inside.
    pub fn nearest(&self, point: Point2<f64>) -> Point2<f64> {
        if self.contains(point) {
            point
        } else {
            self.nearest_on_boundary(point)
        }
    }

    fn nearest_on_boundary(&self, point: Point2<f64>) -> Point2<f64> {
        let mut best = self.vertices[0];
        for (a, b) in self.edges() {
            let along = b - a;
            let t = ((point - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let candidate = a + along * t;
            if (point - candidate).norm_squared() < (point - best).norm_squared() {
                best = candidate;
            }
        }
        best
    }

    /// The polygon of all points at least `margin` (m) inside; None if no area is left.
    pub fn inset(&self, margin: f64) -> Option<Self> {
        let mut kept = [Point2::origin(); SCRATCH];
        kept[..self.len].copy_from_slice(self.vertices());
        let mut len = self.len;
        for h in self.half_planes() {
            let inner = HalfPlane {
                distance: h.distance - margin,
                ..h
            };
            let mut cut = [Point2::origin(); SCRATCH];
            let mut cut_len = 0;
            let mut push = |p: Point2<f64>| {
                // A convex polygon gains at most one vertex with each cut, so 8 + 8 always fit.
                if cut_len < SCRATCH {
                    cut[cut_len] = p;
                    cut_len += 1;
                }
            };
            for i in 0..len {
                let (a, b) = (kept[i], kept[(i + 1) % len]);
                let (ea, eb) = (inner.excess(a), inner.excess(b));
                if ea <= 0.0 {
                    push(a);
                }
                if (ea <= 0.0) != (eb <= 0.0) {
                    push(a + (b - a) * (ea / (ea - eb)));
                }
            }
            (kept, len) = (cut, cut_len);
        }
        Self::hull(&kept[..len])
    }

    /// Area (m^2).
    pub fn area(&self) -> f64 {
        let origin = self.vertices[0];
        self.edges()
            .map(|(a, b)| (a - origin).perp(&(b - origin)) / 2.0)
            .sum()
    }

    /// Distance (m) from `origin` along `direction` (of any length) to where this ray leaves the polygon; None if it
    /// misses.
    pub fn distance_along(&self, origin: Point2<f64>, direction: Vector2<f64>) -> Option<f64> {
        let direction = direction.try_normalize(0.0)?;
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for h in self.half_planes() {
            let (excess, rate) = (h.excess(origin), h.normal.dot(&direction));
            if rate > 0.0 {
                leave = leave.min(-excess / rate);
            } else if rate < 0.0 {
                enter = enter.max(-excess / rate);
            } else if excess > 0.0 {
                return None;
            }
        }
        (enter <= leave).then_some(leave)
    }
}

impl PartialEq for SupportPolygon {
    fn eq(&self, other: &Self) -> bool {
        self.vertices() == other.vertices()
    }
}

/// Twice the area of the triangle a b c; positive for a left turn.
fn turn(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry2;
    use proptest::prelude::*;

    fn soles(stride: f64, yaw: f64) -> Vec<Point2<f64>> {
        let corners = [
            (-0.0481, -0.0346),
            (0.0481, -0.0346),
            (0.0481, 0.0346),
            (-0.0481, 0.0346),
        ];
        let left = Isometry2::new(Vector2::new(stride, 0.0485), yaw);
        let right = Isometry2::new(Vector2::new(-stride, -0.0485), -yaw);
        [left, right]
            .iter()
            .flat_map(|pose| corners.map(|(x, y)| pose * Point2::new(x, y)))
            .collect()
    }

    #[test]
    fn parallel_soles_make_a_rectangle_and_a_stride_a_hexagon() {
        let home = SupportPolygon::hull(&soles(0.0, 0.0)).unwrap();
        assert_eq!(home.vertices().len(), 4);
        assert!((home.area() - 4.0 * 0.0481 * 0.0831).abs() < 1e-12);
        assert!(
            home.vertices()
                .iter()
                .map(|v| v.coords)
                .sum::<Vector2<f64>>()
                .norm()
                < 1e-12
        );
        assert_eq!(
            SupportPolygon::hull(&soles(0.05, 0.0))
                .unwrap()
                .vertices()
                .len(),
            6
        );
    }

    #[test]
    fn what_spans_no_area_is_no_polygon() {
        let line: Vec<_> = (0..8)
            .map(|i| Point2::new(0.1 * i as f64, 0.05 * i as f64))
            .collect();
        assert!(SupportPolygon::hull(&line).is_none());
        assert!(SupportPolygon::hull(&[]).is_none());
        assert!(SupportPolygon::hull(&[Point2::origin(); 4]).is_none());
        assert!(SupportPolygon::hull(&[Point2::new(f64::NAN, 0.0); 4]).is_none());
        assert!(SupportPolygon::rectangle(0.1, -0.1, -0.1, 0.1).is_none());
        assert!(
            SupportPolygon::rectangle(-0.05, 0.05, -0.08, 0.08)
                .unwrap()
                .inset(0.051)
                .is_none()
        );
    }

    #[test]
    fn distances_have_their_sign_and_size() {
        let r = SupportPolygon::rectangle(-0.05, 0.10, -0.08, 0.08).unwrap();
        assert!((r.signed_distance(Point2::new(0.0, 0.0)) + 0.05).abs() < 1e-12);
        assert!((r.signed_distance(Point2::new(0.13, 0.12)) - 0.05).abs() < 1e-12);
        assert!((r.nearest(Point2::new(0.13, 0.12)) - Point2::new(0.10, 0.08)).norm() < 1e-12);
        assert_eq!(r.nearest(Point2::new(0.01, 0.02)), Point2::new(0.01, 0.02));
        let along =
            |x: f64, dx: f64, dy: f64| r.distance_along(Point2::new(x, 0.0), Vector2::new(dx, dy));
        assert!((along(0.0, 3.0, 0.0).unwrap() - 0.10).abs() < 1e-12);
        assert!((along(-0.2, 1.0, 0.0).unwrap() - 0.30).abs() < 1e-12);
        assert_eq!(along(0.2, 1.0, 0.0), None);
        assert_eq!(along(0.2, 0.0, 1.0), None);
        assert_eq!(along(0.0, 0.0, 0.0), None);
    }

    proptest! {
        #[test]
        fn a_hull_holds_its_points_and_its_inset_keeps_the_margin(
            stride in -0.1..0.1f64, yaw in -0.8..0.8f64, margin in 0.001..0.02f64
        ) {
            let points = soles(stride, yaw);
            let hull = SupportPolygon::hull(&points).unwrap();
            for p in &points {
                prop_assert!(hull.signed_distance(*p) <= 2.0 * FLAT);
            }
            for v in hull.inset(margin).unwrap().vertices() {
                prop_assert!(hull.signed_distance(*v) <= -margin + 2.0 * FLAT);
            }
        }

        #[test]
        fn the_nearest_point_lies_in_the_polygon_at_the_signed_distance(
            yaw in -0.8..0.8f64, x in -0.3..0.3f64, y in -0.3..0.3f64
        ) {
            let hull = SupportPolygon::hull(&soles(0.02, yaw)).unwrap();
            let p = Point2::new(x, y);
            let nearest = hull.nearest(p);
            prop_assert!(hull.signed_distance(nearest) <= 1e-12);
            prop_assert!(((p - nearest).norm() - hull.signed_distance(p).max(0.0)).abs() < 1e-12);
        }
    }
}
