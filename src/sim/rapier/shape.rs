//! The robot's shapes in Rapier.

use super::convert::{pose_to_rapier, vec_to_rapier};
use crate::robot::Shape;
use crate::robot::mesh::{Mesh, bounds};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d::parry::query;
use rapier3d::prelude::{Real, SharedShape};

/// A placed shape.
pub fn placed(shape: &Shape, pose: Isometry3<f64>) -> (SharedShape, Isometry3<f64>) {
    // The axis of cylinders and capsules is z in URDF, and y in Rapier.
    let upright = || pose * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    match *shape {
        Shape::Box { half } => (SharedShape::cuboid(half.x as Real, half.y as Real, half.z as Real), pose),
        Shape::Sphere { radius } => (SharedShape::ball(radius as Real), pose),
        Shape::Cylinder { radius, length } => {
            (SharedShape::cylinder((0.5 * length) as Real, radius as Real), upright())
        }
        Shape::Capsule { radius, length } => {
            (SharedShape::capsule_y((0.5 * length) as Real, radius as Real), upright())
        }
        Shape::Mesh(ref mesh) => hull(mesh, pose),
    }
}

/// The convex hull of a mesh; the box around it if Parry finds no hull.
fn hull(mesh: &Mesh, pose: Isometry3<f64>) -> (SharedShape, Isometry3<f64>) {
    let points: Vec<_> = mesh.hull.iter().map(|point| vec_to_rapier(&point.coords)).collect();
    if let Some(hull) = SharedShape::convex_hull(&points) {
        return (hull, pose);
    }
    let (least, most) = bounds(&mesh.hull);
    let middle = Isometry3::from(nalgebra::center(&least, &most));
    placed(&Shape::Box { half: (most - least) / 2.0 }, pose * middle)
}

/// Gap between two placed shapes (m); 0 if they overlap.
pub fn gap_m((a, a_pose): &(SharedShape, Isometry3<f64>), (b, b_pose): &(SharedShape, Isometry3<f64>)) -> f64 {
    query::distance(&pose_to_rapier(a_pose), &**a, &pose_to_rapier(b_pose), &**b)
        .map_or(f64::INFINITY, |gap| f64::from(gap.distance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use std::sync::Arc;

    /// Gap between a shape and a small ball at a point (m).
    fn gap_to(shape: &Shape, pose: &Isometry3<f64>, at: [f64; 3]) -> f64 {
        let ball = Shape::Sphere { radius: 0.01 };
        gap_m(&placed(shape, *pose), &placed(&ball, Isometry3::translation(at[0], at[1], at[2]))) + 0.01
    }

    #[test]
    fn shapes_stand_where_they_are_put() {
        let corners = Shape::Box { half: Vector3::new(0.1, 0.2, 0.3) }.points();
        // A point within the box does not change its hull.
        let mesh = Mesh::new([corners, vec![Point3::new(0.02, 0.0, 0.1)]].concat(), Vec::new());
        let flat =
            Mesh::new([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0)).into(), Vec::new());
        let pose = Isometry3::translation(1.0, 0.0, 0.0);
        for (shape, at, expected) in [
            (Shape::Box { half: Vector3::new(0.1, 0.2, 0.3) }, [1.0, 0.0, 0.8], 0.5),
            (Shape::Mesh(Arc::new(mesh.clone())), [1.0, 0.0, 0.8], 0.5),
            (Shape::Mesh(Arc::new(mesh)), [1.5, 0.1, 0.2], 0.4),
            (Shape::Mesh(Arc::new(flat)), [1.2, 0.2, 0.5], 0.5),
            (Shape::Cylinder { radius: 0.1, length: 0.6 }, [1.0, 0.0, 0.8], 0.5),
            (Shape::Capsule { radius: 0.1, length: 0.6 }, [1.0, 0.0, 0.8], 0.4),
            (Shape::Capsule { radius: 0.1, length: 0.6 }, [1.0, 0.5, 0.0], 0.4),
        ] {
            let gap_m = gap_to(&shape, &pose, at);
            assert!((gap_m - expected).abs() < 1e-3, "{shape:?}: {gap_m}, not {expected}");
        }
    }
}
