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
