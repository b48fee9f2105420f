//! The marks of a moment, as one list for the window and replays.

use super::palette::{Overlay, Sheet, Style};
use super::sign::Sign;
use nalgebra::{Point2, Point3, Vector3};
use standfast_core::robot::SizeRatio;
use standfast_sim::Ground;
use standfast_sim::episode::Snapshot;
use standfast_sim::episode::snapshot::Arrow;

/// A mark: its overlay, which gives it its colour, and its shape.
#[derive(Debug, Clone)]
pub struct SceneMark {
    pub overlay: Overlay,
    pub drawing: Drawing,
}

/// The shape of a mark. Places are in the world frame (m), and widths in points of a screen.
#[derive(Debug, Clone)]
pub enum Drawing {
    /// A convex polygon on the ground.
    Polygon {
        corners: Vec<Point3<f64>>,
        sheet: Sheet,
    },
    Sign {
        at: Point3<f64>,
        sign: Sign,
    },
    /// The plumb line from a point in the air to the ground.
    Plumb {
        from: Point3<f64>,
        to: Point3<f64>,
    },
    /// The arrow of a force. If `ends`, the force acts at the end of the arrow, or else at its beginning.
    Arrow {
        tail: Point3<f64>,
        along: Vector3<f64>,
        ends: bool,
        width: f64,
        force_n: f64,
    },
}

/// The marks of a moment with the overlays that are `shown`, in the order in which they are drawn.
pub(super) fn of(
    now: &Snapshot,
    ground: &Ground,
    scale: SizeRatio,
    shown: &[Overlay],
) -> Vec<SceneMark> {
    let mut marks = Vec::new();
    let floor = |at: Point2<f64>| on_ground(at, ground);
    let polygon = |corners: &[Point2<f64>], sheet| Drawing::Polygon {
        corners: corners.iter().map(|at| floor(*at)).collect(),
        sheet,
    };
    for overlay in Overlay::ALL
        .into_iter()
        .filter(|overlay| shown.contains(overlay))
    {
        let mut add = |drawing| marks.push(SceneMark { overlay, drawing });
        match overlay.look().style {
            Style::Polygon { of, sheet } => add(polygon(&of(now), sheet)),
            // The CPI set of the active gain is drawn over the others, which are drawn from slow to fast, since slower
            // ones are larger.
            Style::Sets { resting, acting } => {
                let (active, others): (Vec<_>, Vec<_>) = now
                    .regions
                    .iter()
                    .partition(|region| now.gain.as_ref() == Some(&region.name));
                for region in others {
                    add(polygon(&region.corners, resting));
                }
                for region in active {
                    add(polygon(&region.corners, acting));
                }
            }
            Style::Spot { of, sign } => {
                if let Some(at) = of(now) {
                    add(Drawing::Sign {
                        at: floor(at),
                        sign,
                    });
                }
            }
            Style::Com { sign, foot } => {
                let (from, to) = (now.com, floor(now.com.xy()));
                add(Drawing::Plumb { from, to });
                add(Drawing::Sign { at: to, sign: foot });
                add(Drawing::Sign { at: from, sign });
            }
            // The trail is a matter of many moments, and the body is no mark.
            Style::Trail { .. } | Style::Body { .. } => {}
            Style::Arrow { of, ends, .. } => {
                for force in &of(now) {
                    if let Some(arrow) = arrow_along(overlay, force, ends, scale) {
                        add(arrow);
                    }
                }
            }
        }
    }
    marks
}

/// The arrow of a force in the style of an overlay. If `ends`, it ends at the point where the force acts, or else it
/// begins there. None if the overlay has no arrows.
pub fn arrow_along(
    overlay: Overlay,
    Arrow { point, force }: &Arrow,
    ends: bool,
    scale: SizeRatio,
) -> Option<Drawing> {
    let Style::Arrow { m_per_n, width, .. } = overlay.look().style else {
        return None;
    };
    let along = force * (m_per_n / scale.force_per_length());
    let tail = if ends { point - along } else { *point };
    Some(Drawing::Arrow {
        tail,
        along,
        ends,
        width,
        force_n: force.norm(),
    })
}

/// The point of the ground with these horizontal coordinates (m, world frame).
pub fn on_ground(at: Point2<f64>, ground: &Ground) -> Point3<f64> {
    Point3::new(at.x, at.y, ground.height_m(at))
}
