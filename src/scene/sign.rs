//! Signs that mark points: flat shapes about the point with a white rim, so that they are visible on a robot of any
//! colour. The window and replays draw the same signs.

use serde::{Serialize, Serializer};
use std::f64::consts::TAU;

/// A place in points of a screen, to the right and down from the upper left corner of a picture, or from the marked
/// point.
pub type ScreenPoint = [f64; 2];

/// A flat shape. Lines are centred on their path, with a width in points.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "form", rename_all = "lowercase")]
pub enum FlatShape {
    /// A convex polygon, filled.
    Area { path: Vec<ScreenPoint> },
    /// The closed line around a convex polygon.
    Outline { path: Vec<ScreenPoint>, width: f64 },
    /// A straight line between two ends.
    Line { path: [ScreenPoint; 2], width: f64 },
}

/// The shape of a sign, which distinguishes its point from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    Disc,
    Ring,
    Diamond,
    Cross,
    /// A disc in quarters, the usual sign for a centre of mass.
    Quartered,
}

/// In the script of a page, a sign is the list of its pieces.
impl Serialize for Sign {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.pieces().serialize(serializer)
    }
}

/// A part of a sign, either white or in the colour of its overlay.
#[derive(Debug, Clone, Serialize)]
pub struct Piece {
    #[serde(flatten)]
    pub form: FlatShape,
    #[serde(rename = "white")]
    pub is_white: bool,
}

/// Width of the white rim (points).
const RIM: f64 = 1.3;
/// Number of corners of a circle, a multiple of four.
const ROUND: usize = 32;

impl Sign {
    /// The parts in the order in which they are drawn, the white rim first.
    pub fn pieces(self) -> Vec<Piece> {
        let line = |x: f64, y: f64| FlatShape::Line {
            path: [[x, y], [-x, -y]],
            width: 2.4,
        };
        let colored = match self {
            Sign::Disc => vec![FlatShape::Area { path: circle(3.5) }],
            Sign::Ring => vec![FlatShape::Outline {
                path: circle(5.9),
                width: 2.4,
            }],
            Sign::Diamond => vec![FlatShape::Area {
                path: vec![[10.8, 0.0], [0.0, 10.8], [-10.8, 0.0], [0.0, -10.8]],
            }],
            Sign::Cross => vec![line(7.8, 7.8), line(7.8, -7.8)],
            Sign::Quartered => {
                let rim = circle(8.0);
                let quarter = |from: usize| {
                    let arc = (from..=from + ROUND / 4).map(|k| rim[k % ROUND]);
                    FlatShape::Area {
                        path: [[0.0; 2]].into_iter().chain(arc).collect(),
                    }
                };
                vec![
                    quarter(0),
                    quarter(ROUND / 2),
                    FlatShape::Outline {
                        path: rim.clone(),
                        width: 2.0,
                    },
                ]
            }
        };
        let mut white = Vec::new();
        // The space between the quarters is white, too.
        if self == Sign::Quartered {
            white.push(FlatShape::Area { path: circle(8.0) });
        }
        white.extend(colored.iter().map(FlatShape::widened));
        let mut pieces = Vec::new();
        for (forms, is_white) in [(white, true), (colored, false)] {
            pieces.extend(forms.into_iter().map(|form| Piece { form, is_white }));
        }
        pieces
    }
}

impl FlatShape {
    /// The white form below this one: a line that is wider by the rim on each side or, for an area, its outline.
    fn widened(&self) -> FlatShape {
        let wider = |width: f64| width + 2.0 * RIM;
        match self {
            FlatShape::Area { path } => FlatShape::Outline {
                path: path.clone(),
                width: wider(0.0),
            },
            FlatShape::Outline { path, width } => FlatShape::Outline {
                path: path.clone(),
                width: wider(*width),
            },
            FlatShape::Line {
                path: [a, b],
                width,
            } => {
                let length = (a[0] - b[0]).hypot(a[1] - b[1]);
                let beyond = |end: ScreenPoint, other: ScreenPoint| {
                    [0, 1].map(|i| end[i] + (end[i] - other[i]) * RIM / length)
                };
                FlatShape::Line {
                    path: [beyond(*a, *b), beyond(*b, *a)],
                    width: wider(*width),
                }
            }
        }
    }
}

/// A circle about the marked point. Coordinates are rounded, so that pages are the same to the byte on every machine.
fn circle(radius: f64) -> Vec<ScreenPoint> {
    let corners = (0..ROUND).map(|k| {
        let (sin, cos) = (TAU * k as f64 / ROUND as f64).sin_cos();
        [cos, sin].map(|share| (1000.0 * radius * share).round() / 1000.0)
    });
    corners.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Sign; 5] = [
        Sign::Disc,
        Sign::Ring,
        Sign::Diamond,
        Sign::Cross,
        Sign::Quartered,
    ];

    /// Distance from the marked point to which a form reaches (points).
    fn reach(form: &FlatShape) -> f64 {
        let (path, width) = match form {
            FlatShape::Area { path } => (&path[..], 0.0),
            FlatShape::Outline { path, width } => (&path[..], *width),
            FlatShape::Line { path, width } => (&path[..], *width),
        };
        path.iter().map(|at| at[0].hypot(at[1])).fold(0.0, f64::max) + width / 2.0
    }

    #[test]
    fn every_sign_has_a_white_rim_and_is_large_enough_for_a_telephone() {
        for sign in ALL {
            let farthest = |white: bool| {
                let pieces = sign.pieces();
                pieces
                    .iter()
                    .filter(|piece| piece.is_white == white)
                    .map(|piece| reach(&piece.form))
                    .fold(0.0, f64::max)
            };
            assert!(farthest(true) > farthest(false) + 0.9 * RIM, "{sign:?}");
            assert!(farthest(false) >= 3.5, "{sign:?}: {}", farthest(false));
        }
    }
}
