//! Thins the meshes of a robot, so that all together have no more triangles than can be drawn at once.

use super::{Triangles, bounds};
use nalgebra::{Point3, Vector3};
use std::collections::{HashMap, HashSet};

/// Distance below which points of a mesh are one point, as a share of the mesh's size.
const SAME_SHARE: f64 = 1e-6;
/// Size of the first cells as a share of the largest mesh, and factor by which the cells grow until the rest is small
/// enough.
const FIRST_SHARE: f64 = 2e-3;
const GROWTH: f64 = 1.15;

/// Thins meshes, each given with the number of times that it is drawn, until at most `most` triangles are drawn in all.
/// The cells of a mesh grow with the root of its size, so that a finger is not lost for the details of a trunk.
pub fn thin(meshes: &mut [(Triangles, usize)], most: usize) {
    let size = |(mesh, _): &(Triangles, usize)| {
        let (least, greatest) = bounds(&mesh.points);
        (greatest - least).norm()
    };
    let sizes: Vec<f64> = meshes.iter().map(size).collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let mut share = SAME_SHARE;
    let mut next = FIRST_SHARE;
    while share < 1.0 {
        for ((mesh, _), size) in meshes.iter_mut().zip(&sizes) {
            let cell = if share == SAME_SHARE {
                share * size
            } else {
                share * (size * largest).sqrt()
            };
            if cell > 0.0 {
                *mesh = clustered(mesh, cell);
            }
        }
        if meshes
            .iter()
            .map(|(mesh, times)| mesh.triangles.len() * times)
            .sum::<usize>()
            <= most
        {
            return;
        }
        (share, next) = (next, GROWTH * next);
    }
}

/// Merges all points of a cubic cell into one, at their mean.
fn clustered(mesh: &Triangles, cell: f64) -> Triangles {
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
    let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
    let mut merged: Vec<u32> = Vec::with_capacity(mesh.points.len());
    for point in &mesh.points {
        let key = [point.x, point.y, point.z].map(|x| (x / cell).round() as i64);
        let index = *cells.entry(key).or_insert_with(|| {
            sums.push((Vector3::zeros(), 0.0));
            sums.len() as u32 - 1
        });
        let (sum, count) = &mut sums[index as usize];
        *sum += point.coords;
        *count += 1.0;
        merged.push(index);
    }
    let mut seen = HashSet::new();
    let mut triangles = Vec::new();
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| merged[i as usize]);
        let least = a.min(b).min(c);
        let turned = if least == a {
            [a, b, c]
        } else if least == b {
            [b, c, a]
        } else {
            [c, a, b]
        };
        if a != b && b != c && c != a && seen.insert(turned) {
            triangles.push([a, b, c]);
        }
    }
    let points = sums
        .into_iter()
        .map(|(sum, count)| Point3::from(sum / count))
        .collect();
    Triangles { points, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 1 m with rings of corners, without shared corners, like a file in STL.
    fn ball(rings: usize) -> Triangles {
        let at = |i: usize, k: usize| {
            let (up, around) = (
                i as f64 / rings as f64 * 180_f64,
                k as f64 / rings as f64 * 360_f64,
            );
            let (r, z) = up.to_radians().sin_cos();
            let (y, x) = around.to_radians().sin_cos();
            Point3::new(r * x, r * y, z)
        };
        let mut mesh = Triangles::default();
        for (i, k) in (0..rings).flat_map(|i| (0..rings).map(move |k| (i, k))) {
            let first = mesh.points.len() as u32;
            mesh.points
                .extend([at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]);
            mesh.fan(&[first, first + 1, first + 2, first + 3]);
        }
        mesh
    }

    #[test]
    fn meshes_are_thinned_together_to_what_can_be_drawn() {
        let mut meshes = [(ball(100), 2), (ball(20), 1)];
        assert!(2 * meshes[0].0.triangles.len() + meshes[1].0.triangles.len() > 40_000);
        thin(&mut meshes, 5000);
        let drawn = 2 * meshes[0].0.triangles.len() + meshes[1].0.triangles.len();
        assert!((2500..=5000).contains(&drawn), "{drawn}");
        for (mesh, _) in &meshes {
            let at = |i: u32| mesh.points[i as usize].coords;
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|&[a, b, c]| at(a).cross(&at(b)).dot(&at(c)) / 6.0)
                .sum();
            assert!(
                (3.8..4.19).contains(&volume),
                "{volume}: a ball of radius 1 has 4.19"
            );
        }
    }

    #[test]
    fn a_mesh_that_is_small_enough_keeps_all_triangles_and_shares_corners() {
        let mut meshes = [(ball(10), 1)];
        let before = meshes[0].0.clone();
        thin(&mut meshes, 5000);
        // At the poles, one of two triangles has no area.
        assert_eq!(meshes[0].0.triangles.len(), before.triangles.len() - 20);
        assert_eq!((before.points.len(), meshes[0].0.points.len()), (400, 92));
    }
}
