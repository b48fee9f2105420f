//! Marks as triangles: flat ones just above the ground, and balls and arrows in space.

use super::camera::View;
use super::canvas::{Canvas, Paint};
use super::triangle::{Light, Triangle, linear};
use crate::render::scene::mesh::{arrow, rod, sphere};
use crate::render::scene::palette::{Color, THROUGH};
use crate::render::scene::scale::RobotScale;
use crate::render::scene::{Drawing, Mark, on_ground};
use crate::sim::Ground;
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// How much larger a point is with its white rim.
const RIM: f64 = 1.22;
/// For a robot as large as UT-mu2: how high marks lie above the ground, the radii of the ring at the foot of a plumb
/// line, and of the line (m).
const LIFT_M: f64 = 0.0005;
const FOOT_M: [f64; 2] = [0.0165, 0.0145];
const PLUMB_M: f64 = 0.00135;
/// Corners of a round mark.
const ROUND: usize = 24;

fn light(color: Color) -> Light {
    linear(color.parts())
}

/// A mark on the ground where it is hidden.
pub(super) fn hidden(mark: &Triangle) -> Triangle {
    Triangle { cover: 0.0, through: THROUGH as f32 * mark.cover, ..*mark }
}

/// What lies on the ground, lowest first.
pub(super) fn on_the_ground(view: &View, ground: &Ground, scale: RobotScale, marks: &[Mark]) -> Vec<Triangle> {
    let mut flat = Flat { view, ground, large: scale.length(), triangles: Vec::new() };
    for Mark { overlay, drawing } in marks {
        let color = overlay.color();
        match drawing {
            Drawing::Polygon { corners, sheet } => {
                flat.polygon(corners, color, sheet.fill as f32);
                flat.outline(corners, 0.001 * sheet.width, color, sheet.edge as f32);
            }
            Drawing::Spot { at, radius_m, .. } => {
                flat.polygon(&circle(*at, *radius_m), color, 1.0);
                flat.band(&circle(*at, RIM * radius_m), &circle(*at, *radius_m), Color::WHITE, 1.0);
            }
            Drawing::Ball { center, .. } => {
                let [outer, inner] = FOOT_M.map(|radius_m| circle(center.xy(), radius_m * scale.length()));
                flat.band(&outer, &inner, color, 1.0);
            }
            Drawing::Arrow { .. } => {}
        }
    }
    flat.triangles
}

/// Balls with what they hang on, and arrows.
pub(super) fn in_space(canvas: &mut Canvas, ground: &Ground, scale: RobotScale, marks: &[Mark]) {
    for Mark { overlay, drawing } in marks {
        let light = light(overlay.color());
        let paint = |through: f64| Paint { light, cover: 1.0, through: through as f32, throws_shadow: false };
        match *drawing {
            Drawing::Ball { center, radius_m, through } => {
                let foot = on_ground(center.xy(), ground);
                let plumb = center - foot;
                if plumb.norm() > radius_m {
                    let line = rod(PLUMB_M * scale.length(), plumb.norm());
                    canvas.body(&line, &pose_along(foot, plumb), &paint(0.6 * through));
                }
                canvas.body(&sphere(radius_m), &Isometry3::from(center.coords), &paint(through));
            }
            Drawing::Arrow { tail, along, radius_m, through, .. } => {
                canvas.body(&arrow(along.norm(), radius_m), &pose_along(tail, along), &paint(through));
            }
            Drawing::Polygon { .. } | Drawing::Spot { .. } => {}
        }
    }
}

/// At `from`, z along `direction`.
fn pose_along(from: Point3<f64>, direction: Vector3<f64>) -> Isometry3<f64> {
    // Not along z: what is turned about its axis there.
    let side = if direction.x.abs() < 0.9 * direction.norm() { Vector3::x() } else { Vector3::y() };
    Isometry3::from_parts(from.into(), UnitQuaternion::face_towards(&direction, &side))
}

/// Flat marks just above the ground.
struct Flat<'a> {
    view: &'a View,
    ground: &'a Ground,
    /// The robot's length by UT-mu2's.
    large: f64,
    triangles: Vec<Triangle>,
}

impl Flat<'_> {
    fn triangle(&mut self, corners: [Point2<f64>; 3], light: Light, cover: f32) {
        let lift = self.ground.slope * Vector3::z() * (LIFT_M * self.large);
        let corners = corners.map(|at| self.view.vertex(on_ground(at, self.ground) + lift, light));
        if let [Some(a), Some(b), Some(c)] = corners {
            self.triangles.push(Triangle { corners: [a, b, c], cover, through: 0.0, hides: false });
        }
    }

    /// A convex polygon.
    fn polygon(&mut self, corners: &[Point2<f64>], color: Color, cover: f32) {
        for pair in corners.windows(2).skip(1) {
            self.triangle([corners[0], pair[0], pair[1]], light(color), cover);
        }
    }

    /// The band between a closed line and another inside of it with as many corners.
    fn band(&mut self, outer: &[Point2<f64>], inner: &[Point2<f64>], color: Color, cover: f32) {
        for i in 0..outer.len() {
            let next = (i + 1) % outer.len();
            self.triangle([outer[i], outer[next], inner[next]], light(color), cover);
            self.triangle([outer[i], inner[next], inner[i]], light(color), cover);
        }
    }

    /// The border of a convex polygon, inside of it; corners counter-clockwise or clockwise.
    fn outline(&mut self, corners: &[Point2<f64>], breadth: f64, color: Color, cover: f32) {
        let breadth = breadth * self.large;
        let mut corners = corners.to_vec();
        corners.dedup_by(|a, b| (*a - *b).norm() < 1e-6);
        if corners.len() < 3 {
            return;
        }
        let n = corners.len();
        let along = |i: usize| (corners[(i + 1) % n] - corners[i]).normalize();
        let turn: f64 = (0..n).map(|i| along(i).perp(&along((i + 1) % n))).sum();
        let inwards = |i: usize| Vector2::new(-along(i).y, along(i).x) * turn.signum();
        let inner: Vec<_> = (0..n)
            .map(|i| {
                let (a, b) = (inwards((i + n - 1) % n), inwards(i));
                // The mitre of a sharp corner is cut.
                corners[i] + (a + b) * (breadth / (1.0 + a.dot(&b)).max(0.3))
            })
            .collect();
        self.band(&corners, &inner, color, cover);
    }
}

fn circle(at: Point2<f64>, radius_m: f64) -> Vec<Point2<f64>> {
    let corner = |k: usize| {
        let (sin, cos) = (360.0 * k as f64 / ROUND as f64).to_radians().sin_cos();
        at + Vector2::new(cos, sin) * radius_m
    };
    (0..ROUND).map(corner).collect()
}
