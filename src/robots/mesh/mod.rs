//! Triangle meshes in files: which file a URDF means, how it is read, and how much of it is kept.

pub mod bundle;
mod dae;
pub mod files;
pub mod search;
pub mod simplify;

use nalgebra::{Point3, Vector3};
use standfast_core::robot::mesh::bounds;

/// Triangles as they stand in a file.
#[derive(Debug, Clone, Default)]
pub struct Triangles {
    pub points: Vec<Point3<f64>>,
    /// Indices into `points`, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// Adds a polygon by its corners.
    fn fan(&mut self, corners: &[u32]) {
        self.triangles.extend(
            corners
                .windows(2)
                .skip(1)
                .map(|side| [corners[0], side[0], side[1]]),
        );
    }

    /// Scales the points along the axes. Triangles that are mirrored by that still look to the outside.
    pub fn scaled(mut self, scale: &Vector3<f64>) -> Self {
        for point in &mut self.points {
            point.coords.component_mul_assign(scale);
        }
        if scale.product() < 0.0 {
            for triangle in &mut self.triangles {
                triangle.swap(1, 2);
            }
        }
        self
    }
}
