//! The marks of a moment: one list, for whoever draws them.

use super::palette::{Overlay, Sheet, Style};
use super::scale::RobotScale;
use super::sign::Sign;
use crate::episode::Snapshot;
use crate::episode::snapshot::Arrow;
use crate::sim::Ground;
use nalgebra::{Point2, Point3, Vector3};

/// Something to draw, in its overlay's colour.
#[derive(Debug, Clone)]
pub struct Mark {
    pub overlay: Overlay,
    pub drawing: Drawing,
}

/// World (m); what lies on the ground ([`on_ground`]) is given in the plan. Widths are in points of a screen.
#[derive(Debug, Clone)]
pub enum Drawing {
    /// A convex polygon on the ground.
    Polygon { corners: Vec<Point2<f64>>, sheet: Sheet },
    /// On the ground.
    Spot { at: Point2<f64>, sign: Sign },
    /// In the air, with a plumb line to the ground and another sign where that ends.
    Com { center: Point3<f64>, sign: Sign, foot: Sign },
    /// Of a force, which attacks where the arrow `ends`, or else where it begins.
    Arrow { tail: Point3<f64>, along: Vector3<f64>, ends: bool, width: f64, force_n: f64 },
}

/// The marks of a moment, lowest first.
pub(super) fn of(now: &Snapshot, scale: RobotScale, shown: &[Overlay]) -> Vec<Mark> {
    let mut marks = Vec::new();
    for overlay in Overlay::ALL.into_iter().filter(|overlay| shown.contains(overlay)) {
        let mut add = |drawing| marks.push(Mark { overlay, drawing });
        match overlay.look().style {
            Style::Polygon { of, sheet } => add(Drawing::Polygon { corners: of(now), sheet }),
            Style::Sets { resting, acting } => {
                let acts = |i: usize| now.gain == Some(i);
                // Slow to fast: the set of a slower gain is larger, mostly.
                let sets = || now.slices.iter().cloned().enumerate();
                let with = |sheet| move |(_, corners)| Drawing::Polygon { corners, sheet };
                sets().filter(|(i, _)| !acts(*i)).map(with(resting)).for_each(&mut add);
                sets().filter(|(i, _)| acts(*i)).map(with(acting)).for_each(add);
            }
            Style::Spot { of, sign } => of(now).map(|at| Drawing::Spot { at, sign }).into_iter().for_each(add),
            Style::Com { sign, foot } => add(Drawing::Com { center: now.com, sign, foot }),
            Style::Arrow { of, ends, .. } => {
                of(now).iter().filter_map(|force| arrow_along(overlay, force, ends, scale)).for_each(add);
            }
        }
    }
    marks
}

/// A force in the manner of an overlay; its arrow ends at the point of attack or begins there. None of an overlay
/// without arrows.
pub fn arrow_along(overlay: Overlay, Arrow { point, force }: &Arrow, ends: bool, scale: RobotScale) -> Option<Drawing> {
    let Style::Arrow { m_per_n, width, .. } = overlay.look().style else { return None };
    let along = force * scale.m_per_n(m_per_n);
    let tail = if ends { point - along } else { *point };
    Some(Drawing::Arrow { tail, along, ends, width, force_n: force.norm() })
}

/// The point of the ground below or above a point of the plan.
pub fn on_ground(at: Point2<f64>, ground: &Ground) -> Point3<f64> {
    Point3::new(at.x, at.y, ground.height_m(at))
}
