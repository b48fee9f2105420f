//! Marks as triangles. Fillings of polygons are painted on the ground before the robot, all other marks over the
//! picture.

use super::camera::CameraView;
use super::triangle::{Triangle, Vertex, linear};
use crate::scene::{Drawing, FlatShape, SceneMark, ScreenPoint, Stroke, strokes};
use nalgebra::{Point2, Vector2};

/// One over the depth of marks (1/m). Marks are nearer than all that is in the picture when they are painted.
const OVER_ALL: f64 = 1e6;

/// The fillings of polygons, in the order in which they are drawn.
pub(super) fn on_the_ground(view: &CameraView, marks: &[SceneMark]) -> Vec<Triangle> {
    let mut fillings = Vec::new();
    for SceneMark { overlay, drawing } in marks {
        let Drawing::Polygon { corners, sheet } = drawing else {
            continue;
        };
        let path: Option<_> = corners
            .iter()
            .map(|at| view.project(*at).map(|[x, y, _]| [x, y]))
            .collect();
        if let Some(path) = path {
            let stroke = Stroke {
                form: FlatShape::Area { path },
                color: overlay.color(),
                opacity: sheet.fill,
            };
            fillings.extend(triangles(&stroke, 1.0));
        }
    }
    fillings
}

/// The strokes over the picture, in the order in which they are drawn. `point_px` is the number of pixels for each
/// point of a screen.
pub(super) fn over_all(view: &CameraView, point_px: f64, marks: &[SceneMark]) -> Vec<Triangle> {
    let project = |at: &_| {
        view.project(*at)
            .map(|[x, y, _]| [x / point_px, y / point_px])
    };
    marks
        .iter()
        .flat_map(|mark| strokes(mark, project))
        .flat_map(|stroke| triangles(&stroke, point_px))
        .collect()
}

fn triangles(stroke: &Stroke, point_px: f64) -> Vec<Triangle> {
    let light = linear(stroke.color.parts());
    let corners: Vec<[ScreenPoint; 3]> = match &stroke.form {
        FlatShape::Area { path } => (2..path.len())
            .map(|i| [path[0], path[i - 1], path[i]])
            .collect(),
        FlatShape::Outline { path, width } => band(path, *width),
        FlatShape::Line {
            path: [from, to],
            width,
        } => line(*from, *to, *width),
    };
    let cover = stroke.opacity as f32;
    corners
        .into_iter()
        .map(|corners| Triangle {
            corners: corners.map(|[x, y]| Vertex {
                at: [x * point_px, y * point_px],
                near: OVER_ALL,
                light,
            }),
            cover,
            hides: false,
        })
        .collect()
}

/// A line as two triangles.
fn line(from: ScreenPoint, to: ScreenPoint, width: f64) -> Vec<[ScreenPoint; 3]> {
    let along = Vector2::new(to[0] - from[0], to[1] - from[1]);
    let half = along.try_normalize(1e-9).unwrap_or_default() * width / 2.0;
    let [a, b, c, d] = [(from, 1.0), (to, 1.0), (to, -1.0), (from, -1.0)]
        .map(|(end, side)| [end[0] - side * half.y, end[1] + side * half.x]);
    vec![[a, b, c], [a, c, d]]
}

/// The closed line around a convex polygon, as the band between an inner and an outer polygon, so that no place is
/// painted twice.
fn band(path: &[ScreenPoint], width: f64) -> Vec<[ScreenPoint; 3]> {
    let n = path.len();
    let corner = |i: usize| Point2::from(path[i % n]);
    let mut sides: Vec<[ScreenPoint; 2]> = Vec::with_capacity(n);
    for i in 0..n {
        let [a, b] = [i + n - 1, i].map(|i| {
            let along = (corner(i + 1) - corner(i))
                .try_normalize(1e-9)
                .unwrap_or_default();
            Vector2::new(-along.y, along.x)
        });
        // The length of the mitre at a sharp corner is limited.
        let mitre = (1.0 + a.dot(&b)).max(0.3);
        sides.push(
            [width / 2.0, -width / 2.0].map(|by| (corner(i) + (a + b) * (by / mitre)).into()),
        );
    }
    let mut triangles = Vec::with_capacity(2 * n);
    for i in 0..n {
        let ([a, b], [c, d]) = (sides[i], sides[(i + 1) % n]);
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    triangles
}
