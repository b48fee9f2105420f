//! The robot's solids as triangles, lit and with a shadow.

use super::colors;
use super::mesh::{Rgb, Triangles, light};
use crate::robot::{Kinematics, Pose, Robot, Shape};
use kiss3d::glamx::{Quat, Vec3};
use nalgebra::{UnitQuaternion, Vector3};
use std::f32::consts::{PI, TAU};

/// Sides of what is round.
const SIDES: usize = 20;

/// Towards the sun, world.
fn to_sun() -> Vec3 {
    Vec3::new(0.35, 0.25, 1.0).normalize()
}

/// A corner of a triangle: place and outward normal.
type Corner = (Vec3, Vec3);

/// The surface of one solid, in the frame of the link that carries it.
struct Surface {
    link: usize,
    color: Rgb,
    corners: Vec<Corner>,
}

/// The surfaces of a robot.
pub struct Surfaces {
    surfaces: Vec<Surface>,
}

impl Surfaces {
    pub fn new(robot: &Robot) -> Self {
        let mut surfaces = Vec::new();
        for (link, body) in robot.links.iter().enumerate() {
            surfaces.extend(body.drawn().iter().map(|solid| {
                let place = Place::of(&solid.pose);
                let corners = corners(&solid.shape).into_iter().map(|corner| place.of_corner(corner)).collect();
                Surface { link, color: light(&solid.color), corners }
            }));
        }
        Self { surfaces }
    }

    /// Adds the robot as it stands to a picture seen from `eye`, and its shadow on the plane through the origin with this
    /// rotation, or rather so much above it (m): it is not to be hidden by the floor.
    pub fn draw(
        &self,
        kinematics: &Kinematics,
        eye: Vec3,
        (slope, above_m): (&UnitQuaternion<f64>, f64),
        out: &mut Triangles,
    ) {
        let up = {
            let normal = slope * Vector3::z();
            Vec3::new(normal.x as f32, normal.y as f32, normal.z as f32)
        };
        let (sun, shadow) = (to_sun(), colors::SHADOW.linear());
        for surface in &self.surfaces {
            let place = Place::of(kinematics.link_pose(surface.link));
            for triangle in surface.corners.chunks_exact(3) {
                let triangle = [0, 1, 2].map(|i| place.of_corner(triangle[i]));
                for (at, normal) in triangle {
                    out.corner(at, surface.color * brightness(normal, (eye - at).normalize(), sun));
                }
                // One side of what is closed throws the whole shadow.
                if triangle.iter().all(|(_, normal)| normal.dot(sun) <= 0.0) {
                    continue;
                }
                for (at, _) in triangle {
                    out.corner(at - sun * ((at.dot(up) - above_m as f32) / sun.dot(up)), shadow);
                }
            }
        }
    }
}

/// How much of its colour a surface sends to the eye: the sky above and the floor below, the sun, and a little light that
/// comes with the viewer, so that no side is without shape.
fn brightness(normal: Vec3, to_eye: Vec3, to_sun: Vec3) -> f32 {
    0.42 + 0.12 * normal.z + 0.50 * normal.dot(to_sun).max(0.0) + 0.16 * normal.dot(to_eye).max(0.0)
}

/// A pose in single precision.
struct Place {
    rotation: Quat,
    origin: Vec3,
}

impl Place {
    fn of(pose: &Pose) -> Self {
        let (r, o) = (pose.rotation, pose.translation.vector);
        Self {
            rotation: Quat::from_xyzw(r.i as f32, r.j as f32, r.k as f32, r.w as f32),
            origin: Vec3::new(o.x as f32, o.y as f32, o.z as f32),
        }
    }

    fn of_corner(&self, (at, normal): Corner) -> Corner {
        (self.rotation * at + self.origin, self.rotation * normal)
    }
}

/// Triangles of a shape, three corners in a row each.
fn corners(shape: &Shape) -> Vec<Corner> {
    match *shape {
        Shape::Box { half } => box_corners(Vec3::new(half.x as f32, half.y as f32, half.z as f32)),
        Shape::Cylinder { radius, length } => {
            let (r, h) = (radius as f32, length as f32 / 2.0);
            // Each ring: radius, height, and the normal's share along z.
            let side = lathe(&[([r, -h], [1.0, 0.0]), ([r, h], [1.0, 0.0])]);
            let ends = [-1.0, 1.0].map(|z| lathe(&[([r, z * h], [0.0, z]), ([0.0, z * h], [0.0, z])]));
            [side, ends.concat()].concat()
        }
        Shape::Sphere { radius } => {
            let r = radius as f32;
            let rings: Vec<_> = (0..=SIDES / 2)
                .map(|i| {
                    let (sin, cos) = (PI * i as f32 / (SIDES / 2) as f32).sin_cos();
                    ([r * sin, -r * cos], [sin, -cos])
                })
                .collect();
            lathe(&rings)
        }
    }
}

fn box_corners(half: Vec3) -> Vec<Corner> {
    let mut corners = Vec::with_capacity(36);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let unit = |i: usize| Vec3::AXES[i % 3];
            let (normal, u, v) = (side * unit(axis), unit(axis + 1), unit(axis + 2));
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                corners.push(((normal + a * u + b * v) * half, normal));
            }
        }
    }
    corners
}

/// A surface of revolution about z: each ring by its radius and height, and the normal's parts along both.
fn lathe(rings: &[([f32; 2], [f32; 2])]) -> Vec<Corner> {
    let mut corners = Vec::new();
    let around = |([r, z], [n_r, n_z]): ([f32; 2], [f32; 2]), i: usize| {
        let (sin, cos) = (TAU * i as f32 / SIDES as f32).sin_cos();
        (Vec3::new(r * cos, r * sin, z), Vec3::new(n_r * cos, n_r * sin, n_z))
    };
    for pair in rings.windows(2) {
        for i in 0..SIDES {
            let [a, b, c, d] = [around(pair[0], i), around(pair[0], i + 1), around(pair[1], i + 1), around(pair[1], i)];
            corners.extend([a, b, c, a, c, d]);
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// By the divergence theorem a closed surface encloses the sum of x . n dA / 3.
    #[test]
    fn surfaces_enclose_the_volume_of_their_solids_and_face_outwards() {
        let exact = [
            (Shape::Box { half: Vector3::new(0.1, 0.2, 0.3) }, 0.048),
            (Shape::Cylinder { radius: 0.1, length: 0.5 }, 0.005 * f64::from(PI)),
            (Shape::Sphere { radius: 0.1 }, 4.0 / 3000.0 * f64::from(PI)),
        ];
        for (shape, volume) in exact {
            let corners = corners(&shape);
            let sum: f32 = corners
                .chunks_exact(3)
                .map(|t| {
                    let area = 0.5 * (t[1].0 - t[0].0).cross(t[2].0 - t[0].0).length();
                    let (middle, normal) = ((t[0].0 + t[1].0 + t[2].0) / 3.0, t[0].1 + t[1].1 + t[2].1);
                    middle.dot(normal.normalize()) * area / 3.0
                })
                .sum();
            let ratio = f64::from(sum) / volume;
            // What is round has flat sides here.
            assert!((0.93..1.001).contains(&ratio), "{shape:?}: {ratio}");
        }
    }
}
