//! Marks as flat strokes over a picture, in points of a screen, so that a renderer only has to fill polygons and draw
//! lines.

use super::marks::{Drawing, SceneMark};
use super::palette::{Color, HEAD, PLUMB};
use super::sign::{FlatShape, Piece, ScreenPoint, Sign};
use nalgebra::Point3;

/// One shape to draw. Opacity is from 0 to 1.
#[derive(Debug, Clone)]
pub struct Stroke {
    pub form: FlatShape,
    pub color: Color,
    pub opacity: f64,
}

/// The strokes of a mark in the order in which they are drawn. `project` gives the place in the picture of a point in
/// the world, or None if the point is behind the viewer. The filling of a polygon is not among the strokes, since it
/// lies on the ground, where the robot may hide it.
pub fn strokes(
    mark: &SceneMark,
    project: impl Fn(&Point3<f64>) -> Option<ScreenPoint>,
) -> Vec<Stroke> {
    let color = mark.overlay.color();
    let (forms, opacity) = match &mark.drawing {
        Drawing::Polygon { corners, sheet } => {
            let path: Option<Vec<ScreenPoint>> = corners.iter().map(project).collect();
            (path.map(|path| outline(path, sheet.width)), sheet.edge)
        }
        Drawing::Sign { at, sign } => {
            return project(at).map_or_else(Vec::new, |at| sign_at(*sign, at, color));
        }
        Drawing::Plumb { from, to } => (
            project(from)
                .zip(project(to))
                .map(|(from, to)| dashes(from, to)),
            PLUMB.opacity,
        ),
        Drawing::Arrow {
            tail, along, width, ..
        } => (
            project(tail)
                .zip(project(&(tail + along)))
                .map(|(from, to)| arrow(from, to, *width)),
            1.0,
        ),
    };
    forms
        .into_iter()
        .flatten()
        .map(|form| Stroke {
            form,
            color,
            opacity,
        })
        .collect()
}

/// The closed line around a polygon. If it has a corner so sharp that joined sides would make a spike, as for a sole
/// that stands on its edge, the sides are separate lines.
fn outline(mut path: Vec<ScreenPoint>, width: f64) -> Vec<FlatShape> {
    let way = |a: ScreenPoint, b: ScreenPoint| [b[0] - a[0], b[1] - a[1]];
    let length = |[x, y]: ScreenPoint| x.hypot(y);
    path.dedup_by(|a, b| length(way(*a, *b)) < 1.0);
    let count = path.len();
    let side = |i: usize| way(path[i % count], path[(i + 1) % count]);
    let has_spike = (0..count).any(|i| {
        let (a, b) = (side(i), side(i + 1));
        a[0] * b[0] + a[1] * b[1] < -0.9 * length(a) * length(b)
    });
    if has_spike {
        return (0..count)
            .map(|i| FlatShape::Line {
                path: [path[i], path[(i + 1) % count]],
                width,
            })
            .collect();
    }
    if count > 2 {
        vec![FlatShape::Outline { path, width }]
    } else {
        Vec::new()
    }
}

/// The strokes of a sign at a place in the picture.
fn sign_at(sign: Sign, at: ScreenPoint, color: Color) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    for Piece { mut form, is_white } in sign.pieces() {
        let path: &mut [ScreenPoint] = match &mut form {
            FlatShape::Area { path } | FlatShape::Outline { path, .. } => path,
            FlatShape::Line { path, .. } => path,
        };
        for corner in path {
            *corner = [corner[0] + at[0], corner[1] + at[1]];
        }
        strokes.push(Stroke {
            form,
            color: if is_white { Color::WHITE } else { color },
            opacity: 1.0,
        });
    }
    strokes
}

/// An arrow with a shaft of this width. The head of a short arrow is smaller, and an arrow too short to be seen is
/// empty.
pub fn arrow(from: ScreenPoint, to: ScreenPoint, width: f64) -> Vec<FlatShape> {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]);
    if length < 1.0 {
        return Vec::new();
    }
    let [x, y] = along.map(|v| v / length);
    let head = (HEAD[0] * width).min(length);
    let half = 0.5 * head * HEAD[1] / HEAD[0];
    let neck = [to[0] - head * x, to[1] - head * y];
    let side = |sign: f64| [neck[0] - sign * half * y, neck[1] + sign * half * x];
    vec![
        FlatShape::Line {
            path: [from, neck],
            width,
        },
        FlatShape::Area {
            path: vec![to, side(1.0), side(-1.0)],
        },
    ]
}

/// The dashed plumb line.
fn dashes(from: ScreenPoint, to: ScreenPoint) -> Vec<FlatShape> {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let at = |way: f64| [0, 1].map(|i| from[i] + (to[i] - from[i]) * (way.min(length) / length));
    let starts = (0..)
        .map(|k| f64::from(k) * (PLUMB.dash + PLUMB.gap))
        .take_while(|start| *start < length);
    starts
        .map(|start| FlatShape::Line {
            path: [at(start), at(start + PLUMB.dash)],
            width: PLUMB.width,
        })
        .collect()
}
