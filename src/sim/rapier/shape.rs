//! The robot's shapes in Rapier.

use super::convert::pose_to_rapier;
use crate::robot::Shape;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d::parry::query;
use rapier3d::prelude::{Real, SharedShape};

/// A placed shape.
pub fn placed(shape: Shape, pose: Isometry3<f64>) -> (SharedShape, Isometry3<f64>) {
    match shape {
        Shape::Box { half } => (SharedShape::cuboid(half.x as Real, half.y as Real, half.z as Real), pose),
        Shape::Sphere { radius } => (SharedShape::ball(radius as Real), pose),
        // A cylinder's axis is z in URDF, and y in Rapier.
        Shape::Cylinder { radius, length } => (
            SharedShape::cylinder((0.5 * length) as Real, radius as Real),
            pose * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
        ),
    }
}

/// Gap between two placed shapes (m); 0 if they overlap.
pub fn gap_m(a: (Shape, Isometry3<f64>), b: (Shape, Isometry3<f64>)) -> f64 {
    let [(a, a_pose), (b, b_pose)] = [a, b].map(|(shape, pose)| placed(shape, pose));
    query::distance(&pose_to_rapier(&a_pose), &*a, &pose_to_rapier(&b_pose), &*b)
        .map_or(f64::INFINITY, |gap| f64::from(gap.distance))
}
