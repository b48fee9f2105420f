//! The shapes of solids, each in its own frame.

use super::mesh::Mesh;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Shapes of URDF (m). Each collides as its convex hull.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box with its half extents.
    Box {
        half: Vector3<f64>,
    },
    /// A cylinder about the z axis, centred at the origin.
    Cylinder {
        radius: f64,
        length: f64,
    },
    /// A cylinder of this length about the z axis, centred at the origin, with a half ball at each end.
    Capsule {
        radius: f64,
        length: f64,
    },
    Sphere {
        radius: f64,
    },
    Mesh(Arc<Mesh>),
}

/// Number of points around a round shape, and of rings from the equator of a ball to its pole.
const SIDES: usize = 24;
const RINGS: usize = 6;

impl Shape {
    /// Points on the surface, whose convex hull is the shape. A round shape is represented by rings of points about the
    /// z axis, between which the surface lies up to 2 % of the radius outside of the hull.
    pub fn points(&self) -> Vec<Point3<f64>> {
        match self {
            Shape::Box { half } => {
                let sign = |k: usize, axis: usize| {
                    if k >> axis & 1 == 1 {
                        half[axis]
                    } else {
                        -half[axis]
                    }
                };
                (0..8)
                    .map(|k| Point3::new(sign(k, 0), sign(k, 1), sign(k, 2)))
                    .collect()
            }
            &Shape::Cylinder { radius, length } => [-0.5, 0.5]
                .into_iter()
                .flat_map(|end| ring(radius, end * length))
                .collect(),
            &Shape::Sphere { radius } => ball(radius, 0.0).collect(),
            &Shape::Capsule { radius, length } => ball(radius, 0.5 * length).collect(),
            Shape::Mesh(mesh) => mesh.hull.clone(),
        }
    }

    /// How far the shape reaches from its origin along a direction (m, for a direction of length 1).
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        match self {
            Shape::Box { half } => half.dot(&direction.abs()),
            Shape::Cylinder { radius, length } => {
                radius * direction.xy().norm() + 0.5 * length * direction.z.abs()
            }
            Shape::Capsule { radius, length } => {
                radius * direction.norm() + 0.5 * length * direction.z.abs()
            }
            Shape::Sphere { radius } => radius * direction.norm(),
            Shape::Mesh(mesh) => mesh
                .hull
                .iter()
                .map(|p| p.coords.dot(direction))
                .fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// A ball that contains the shape: its centre, and its radius (m).
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let radius_m = match self {
            Shape::Box { half } => half.norm(),
            Shape::Cylinder { radius, length } => radius.hypot(0.5 * length),
            Shape::Capsule { radius, length } => radius + 0.5 * length,
            Shape::Sphere { radius } => *radius,
            Shape::Mesh(mesh) => return mesh.ball(),
        };
        (Point3::origin(), radius_m)
    }
}

/// The meshes among some shapes, each once. Models and pages name a mesh by its number in this list.
#[derive(Debug)]
pub struct Meshes<'a>(pub Vec<&'a Arc<Mesh>>);

impl<'a> Meshes<'a> {
    pub fn of(shapes: impl Iterator<Item = &'a Shape>) -> Self {
        let mut meshes = Self(Vec::new());
        for shape in shapes {
            if let Shape::Mesh(mesh) = shape
                && meshes.number(mesh).is_none()
            {
                meshes.0.push(mesh);
            }
        }
        meshes
    }

    /// The number of a mesh. It is None if no shape has this mesh.
    pub fn number(&self, mesh: &Arc<Mesh>) -> Option<usize> {
        self.0.iter().position(|other| Arc::ptr_eq(mesh, other))
    }
}

/// Points on a circle about the z axis.
fn ring(radius: f64, z: f64) -> impl Iterator<Item = Point3<f64>> {
    let turn = |k: usize| (TAU * k as f64 / SIDES as f64).sin_cos();
    (0..SIDES).map(move |k| Point3::new(radius * turn(k).1, radius * turn(k).0, z))
}

/// Points on two half balls, whose centres lie `apart_m` above and below the origin.
fn ball(radius: f64, apart_m: f64) -> impl Iterator<Item = Point3<f64>> {
    let rings = (0..RINGS).flat_map(move |k| {
        let (sin, cos) = (0.25 * TAU * k as f64 / RINGS as f64).sin_cos();
        [-1.0, 1.0]
            .into_iter()
            .flat_map(move |up| ring(radius * cos, up * (apart_m + radius * sin)))
    });
    rings.chain([-1.0, 1.0].map(|up| Point3::new(0.0, 0.0, up * (apart_m + radius))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_reach_as_far_as_the_shape() {
        let corners = [
            [0.0, 0.0, 0.0],
            [0.3, 0.0, 0.0],
            [0.0, 0.2, 0.0],
            [0.0, 0.0, 0.1],
        ]
        .map(Point3::from);
        let tetrahedron = Mesh::new(
            corners.to_vec(),
            vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        );
        for shape in [
            Shape::Box {
                half: Vector3::new(0.1, 0.2, 0.3),
            },
            Shape::Cylinder {
                radius: 0.1,
                length: 0.4,
            },
            Shape::Capsule {
                radius: 0.1,
                length: 0.4,
            },
            Shape::Sphere { radius: 0.2 },
            Shape::Mesh(Arc::new(tetrahedron)),
        ] {
            let (center, radius_m) = shape.ball();
            for direction in [
                [1.0, 0.0, 0.0],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, -1.0],
                [0.6, 0.0, 0.8],
                [-0.48, 0.6, 0.64],
            ] {
                let direction = Vector3::from(direction);
                let along = |point: &Point3<f64>| point.coords.dot(&direction);
                let by_points = shape
                    .points()
                    .iter()
                    .map(along)
                    .fold(f64::NEG_INFINITY, f64::max);
                let reach_m = shape.reach_m(&direction);
                assert!(
                    by_points <= reach_m + 1e-12 && by_points > reach_m - 0.005,
                    "{shape:?}: {by_points} {reach_m}"
                );
                assert!(
                    reach_m <= along(&center) + radius_m + 1e-12,
                    "{shape:?}: outside of its ball"
                );
            }
        }
        let low = Shape::Capsule {
            radius: 0.1,
            length: 0.4,
        }
        .reach_m(&-Vector3::z());
        assert!((low - 0.3).abs() < 1e-12, "{low}");
    }
}
