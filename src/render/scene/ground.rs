//! The ground as rectangles: the patch on which the robot starts, what is around it, and the walls between the two.

use crate::sim::Ground;
use nalgebra::Point3;
use serde::Serialize;

/// A rectangle of the ground.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub part: GroundPart,
    /// In the frame of the plane (m), in order around it; from above counter-clockwise.
    pub corners: [Point3<f64>; 4],
}

/// What of the ground it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GroundPart {
    Around,
    Patch,
    Wall,
}

/// The ground so far to each side of the origin of its plane (m), in tiles of at most so much (m). Where it has no step there is neither a patch
/// nor a wall.
pub fn faces(ground: &Ground, reach_m: f64, tile_m: f64) -> Vec<Face> {
    let Ground { step_m, patch: [least, most], .. } = *ground;
    let has_step = step_m != 0.0;
    // Lines between tiles; those along the patch too.
    let lines = |i: usize| {
        let count = (2.0 * reach_m / tile_m).ceil() as usize;
        let mut lines: Vec<f64> = (0..=count).map(|k| (k as f64 * tile_m - reach_m).min(reach_m)).collect();
        lines.extend([least[i], most[i]].into_iter().filter(|at| has_step && at.abs() < reach_m));
        lines.sort_by(f64::total_cmp);
        lines
    };
    let (xs, ys) = (lines(0), lines(1));
    let mut faces = Vec::new();
    for (x, y) in xs.windows(2).flat_map(|x| ys.windows(2).map(move |y| (x, y))) {
        let is_inside = |pair: &[f64], i: usize| (least[i]..=most[i]).contains(&(0.5 * (pair[0] + pair[1])));
        let is_patch = has_step && is_inside(x, 0) && is_inside(y, 1);
        let (part, z) = if is_patch { (GroundPart::Patch, 0.0) } else { (GroundPart::Around, step_m) };
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Point3::new(x[i], y[j], z));
        faces.push(Face { part, corners });
    }
    if has_step {
        let rim = [(least.x, least.y), (most.x, least.y), (most.x, most.y), (least.x, most.y)];
        faces.extend((0..4).map(|i| {
            let [(ax, ay), (bx, by)] = [rim[i], rim[(i + 1) % 4]];
            let corners = [(ax, ay, 0.0), (bx, by, 0.0), (bx, by, step_m), (ax, ay, step_m)];
            Face { part: GroundPart::Wall, corners: corners.map(|(x, y, z)| Point3::new(x, y, z)) }
        }));
    }
    faces
}
