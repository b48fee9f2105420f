//! Triangle meshes: the triangles that are drawn, and the convex hull that collides.

use nalgebra::{Matrix3, Point3, Vector3};
use std::f64::consts::PI;

/// Triangles in the frame of a solid, and the points that span their convex hull.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Corners of the triangles (m).
    pub points: Vec<Point3<f64>>,
    /// Indices into `points`, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Points whose convex hull collides (m): those that lie farthest out in about 64 directions.
    pub hull: Vec<Point3<f64>>,
}

/// Number of directions in which hulls are exact. Between two of them, a ball exceeds its hull by at most 1.2 % of its
/// radius; flat faces and corners between them are exact.
const DIRECTIONS: usize = 64;
/// Least thickness of a hull (m). A flat mesh gets this thickness, since engines need a volume.
const LEAST_THICKNESS_M: f64 = 5e-4;

impl Mesh {
    /// The mesh of some triangles, with the hull of all points. There must be at least one point.
    pub fn new(points: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let hull = thickened(extremal(&points));
        Self {
            points,
            triangles,
            hull,
        }
    }

    /// The same mesh in another size.
    pub fn scaled(&self, by: f64) -> Self {
        let scaled = |points: &[Point3<f64>]| points.iter().map(|p| p * by).collect();
        Self {
            points: scaled(&self.points),
            triangles: self.triangles.clone(),
            hull: scaled(&self.hull),
        }
    }

    /// A ball that contains the hull and the triangles: its centre, and its radius (m).
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let (least, most) = bounds(&self.hull);
        let center = nalgebra::center(&least, &most);
        let farthest = |points: &[Point3<f64>]| {
            points
                .iter()
                .map(|p| (p - center).norm())
                .fold(0.0, f64::max)
        };
        (center, farthest(&self.hull).max(farthest(&self.points)))
    }
}

/// The corners with the least and the largest coordinates of the box around points.
pub fn bounds(points: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let none = (
        Point3::from([f64::INFINITY; 3]),
        Point3::from([f64::NEG_INFINITY; 3]),
    );
    points
        .iter()
        .fold(none, |(least, most), p| (least.inf(p), most.sup(p)))
}

/// The points that lie farthest out in each of the directions, in the order in which the points are given.
fn extremal(points: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let (least, most) = bounds(points);
    let middle = nalgebra::center(&least, &most);
    let mut chosen: Vec<usize> = Vec::new();
    for direction in directions() {
        let along = |i: &usize| points[*i].coords.dot(&direction);
        // Of the points of a face, a corner is taken rather than a point within the face.
        let out = |i: &usize| (points[*i] - middle).norm_squared();
        chosen.extend((0..points.len()).max_by(|a, b| {
            along(a)
                .total_cmp(&along(b))
                .then_with(|| out(a).total_cmp(&out(b)))
        }));
    }
    chosen.sort_unstable();
    chosen.dedup();
    let mut hull: Vec<Point3<f64>> = Vec::with_capacity(chosen.len());
    for point in chosen.into_iter().map(|i| points[i]) {
        if !hull.contains(&point) {
            hull.push(point);
        }
    }
    hull
}

/// Directions that are evenly spread over the sphere, and the directions of the axes.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let golden = PI * (3.0 - 5_f64.sqrt());
    let spread = (0..DIRECTIONS).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / DIRECTIONS as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    });
    let axes = (0..6).map(|k| Vector3::ith(k % 3, if k < 3 { 1.0 } else { -1.0 }));
    axes.chain(spread)
}

/// Points of a hull that has a volume.
fn thickened(hull: Vec<Point3<f64>>) -> Vec<Point3<f64>> {
    let middle: Vector3<f64> =
        hull.iter().map(|p| p.coords).sum::<Vector3<f64>>() / hull.len() as f64;
    let spread: Matrix3<f64> = hull
        .iter()
        .map(|p| (p.coords - middle) * (p.coords - middle).transpose())
        .sum();
    let axes = spread.symmetric_eigen().eigenvectors;
    axes.column_iter().fold(hull, |hull, axis| {
        let along = hull.iter().map(|p| p.coords.dot(&axis));
        let (least, most) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        if most - least >= LEAST_THICKNESS_M {
            return hull;
        }
        let to = [-0.5, 0.5].map(|side| axis * (side * LEAST_THICKNESS_M));
        hull.iter().flat_map(|p| to.map(|to| p + to)).collect()
    })
}
