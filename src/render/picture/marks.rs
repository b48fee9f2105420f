//! Marks as triangles. Fillings of polygons lie just above the ground, where the robot can hide them; everything else
//! lies over the picture.

use super::camera::View;
use super::triangle::{Light, Triangle, Vertex, linear};
use crate::render::scene::palette::Color;
use crate::render::scene::{At, Drawing, Form, Mark, strokes};
use crate::sim::Ground;
use nalgebra::{Point2, Vector2, Vector3};

/// Height of a filling above the ground, for a robot of the size of UT-mu2 (m).
const LIFT_M: f64 = 0.0005;
/// One over the depth of marks over the picture (1/m), which is nearer than everything else.
const OVER_ALL: f64 = 1e6;

fn light(color: Color) -> Light {
    linear(color.parts())
}

/// The fillings of polygons on the ground, in the order in which they are drawn. `large` is the length of the robot as
/// a multiple of UT-mu2's.
pub(super) fn on_the_ground(view: &View, ground: &Ground, large: f64, marks: &[Mark]) -> Vec<Triangle> {
    let lift = ground.slope * Vector3::z() * (LIFT_M * large);
    let mut triangles = Vec::new();
    for Mark { overlay, drawing } in marks {
        let Drawing::Polygon { corners, sheet } = drawing else { continue };
        let light = light(overlay.color());
        let corners: Vec<_> = corners.iter().map(|at| view.vertex(at + lift, light)).collect();
        for i in 2..corners.len() {
            if let [Some(a), Some(b), Some(c)] = [0, i - 1, i].map(|i| corners[i]) {
                let cover = sheet.fill as f32;
                triangles.push(Triangle { corners: [a, b, c], cover, hides: false });
            }
        }
    }
    triangles
}

/// The strokes over the picture, in the order in which they are drawn. `point_px` is the number of pixels for each
/// point of a screen.
pub(super) fn over_all(view: &View, point_px: f64, marks: &[Mark]) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for stroke in marks
        .iter()
        .flat_map(|mark| strokes(mark, |at| view.project(*at).map(|[x, y, _]| [x / point_px, y / point_px])))
    {
        let vertex =
            |[x, y]: At| Vertex { at: [x * point_px, y * point_px], near: OVER_ALL, light: light(stroke.color) };
        let corners = match &stroke.form {
            Form::Area { path } => (2..path.len()).map(|i| [path[0], path[i - 1], path[i]]).collect(),
            Form::Outline { path, width } => band(path, *width),
            Form::Line { path: [from, to], width } => line(*from, *to, *width),
        };
        triangles.extend(corners.into_iter().map(|corners: [At; 3]| Triangle {
            corners: corners.map(vertex),
            cover: stroke.opacity as f32,
            hides: false,
        }));
    }
    triangles
}

/// A line as two triangles.
fn line(from: At, to: At, width: f64) -> Vec<[At; 3]> {
    let along = Vector2::new(to[0] - from[0], to[1] - from[1]);
    let half = along.try_normalize(1e-9).unwrap_or_default() * width / 2.0;
    let [a, b, c, d] = [(from, 1.0), (to, 1.0), (to, -1.0), (from, -1.0)]
        .map(|(end, side)| [end[0] - side * half.y, end[1] + side * half.x]);
    vec![[a, b, c], [a, c, d]]
}

/// The closed line around a convex polygon, as the band between an inner and an outer polygon, so that no place is
/// painted twice.
fn band(path: &[At], width: f64) -> Vec<[At; 3]> {
    let (n, corner) = (path.len(), |i: usize| Point2::from(path[i % path.len()]));
    let along = |i: usize| (corner(i + 1) - corner(i)).try_normalize(1e-9).unwrap_or_default();
    let aside = |i: usize| Vector2::new(-along(i).y, along(i).x);
    let shifted = |i: usize, by: f64| -> At {
        let (a, b) = (aside(i + n - 1), aside(i));
        // The length of the mitre at a sharp corner is limited.
        (corner(i) + (a + b) * (by / (1.0 + a.dot(&b)).max(0.3))).into()
    };
    let sides = |i: usize| [shifted(i, width / 2.0), shifted(i, -width / 2.0)];
    (0..n)
        .flat_map(|i| {
            let ([a, b], [c, d]) = (sides(i), sides((i + 1) % n));
            [[a, c, d], [a, d, b]]
        })
        .collect()
}
