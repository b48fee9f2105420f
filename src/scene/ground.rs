//! The ground as rectangles: the patch on which the robot starts, the ground around it, and the walls between the two.

use nalgebra::Point3;
use serde::Serialize;
use standfast_sim::Ground;

#[derive(Debug, Clone, Copy)]
pub struct GroundFace {
    pub part: GroundPart,
    /// Corners in the frame of the plane (m), counter-clockwise as seen from above.
    pub corners: [Point3<f64>; 4],
}

/// The part of the ground to which a face belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GroundPart {
    Around,
    Patch,
    Wall,
}

/// The faces of the ground up to `reach_m` to each side of the origin of its plane (m), in tiles of at most `tile_m`
/// (m). Without a step there are neither a patch nor walls.
pub fn faces(ground: &Ground, reach_m: f64, tile_m: f64) -> Vec<GroundFace> {
    let Ground {
        step_m,
        patch: [least, most],
        ..
    } = *ground;
    let has_step = step_m != 0.0;
    // The lines between tiles include the edges of the patch.
    let lines = |i: usize| {
        let count = (2.0 * reach_m / tile_m).ceil() as usize;
        let mut lines: Vec<f64> = (0..=count)
            .map(|k| (k as f64 * tile_m - reach_m).min(reach_m))
            .collect();
        lines.extend(
            [least[i], most[i]]
                .into_iter()
                .filter(|at| has_step && at.abs() < reach_m),
        );
        lines.sort_by(f64::total_cmp);
        lines
    };
    let (xs, ys) = (lines(0), lines(1));
    let mut faces = Vec::new();
    for (x, y) in xs
        .windows(2)
        .flat_map(|x| ys.windows(2).map(move |y| (x, y)))
    {
        let is_inside =
            |pair: &[f64], i: usize| (least[i]..=most[i]).contains(&(0.5 * (pair[0] + pair[1])));
        let is_patch = has_step && is_inside(x, 0) && is_inside(y, 1);
        let (part, z) = if is_patch {
            (GroundPart::Patch, 0.0)
        } else {
            (GroundPart::Around, step_m)
        };
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Point3::new(x[i], y[j], z));
        faces.push(GroundFace { part, corners });
    }
    if has_step {
        let rim = [
            (least.x, least.y),
            (most.x, least.y),
            (most.x, most.y),
            (least.x, most.y),
        ];
        faces.extend((0..4).map(|i| {
            let [(ax, ay), (bx, by)] = [rim[i], rim[(i + 1) % 4]];
            let corners = [
                (ax, ay, 0.0),
                (bx, by, 0.0),
                (bx, by, step_m),
                (ax, ay, step_m),
            ];
            GroundFace {
                part: GroundPart::Wall,
                corners: corners.map(|(x, y, z)| Point3::new(x, y, z)),
            }
        }));
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point2, UnitQuaternion, Vector3};

    /// The level faces cover the plan once, each at the height of the ground there, and walls join them.
    #[test]
    fn faces_cover_the_ground_at_its_height() {
        let slope = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.1);
        let patch = [Point2::new(-0.1, -0.2), Point2::new(0.3, 0.2)];
        for (step_m, tile_m, count) in [
            (0.0, 2.0, 1),
            (0.0, 0.5, 16),
            (0.02, 2.0, 9 + 4),
            (-0.02, 0.5, 36 + 4),
        ] {
            let ground = Ground {
                slope,
                step_m,
                patch,
                tilting_s: 0.0,
            };
            let faces = faces(&ground, 1.0, tile_m);
            assert_eq!(faces.len(), count);
            let mut area = 0.0;
            for GroundFace {
                part,
                corners: [a, b, c, d],
            } in faces
            {
                let around = (c - a).cross(&(d - b)) / 2.0;
                if part == GroundPart::Wall {
                    assert!(around.z == 0.0 && (c.z - a.z) == step_m);
                    continue;
                }
                area += around.z;
                let middle = slope * nalgebra::center(&a, &c);
                assert!(
                    (middle.z - ground.height_m(middle.xy())).abs() < 1e-12,
                    "{part:?} {middle}"
                );
            }
            assert!((area - 4.0).abs() < 1e-12, "{area}");
        }
    }
}
