//! Triangle meshes of solids, with normals. Triangles are counter-clockwise as seen from outside. Meshes of primitive
//! shapes are closed and convex.

use nalgebra::{Isometry3, Point3, Vector3};
use standfast_core::robot::{self, Shape};
use std::collections::HashMap;

/// A mesh: its corners with their normals, and the indices of three corners for each face.
#[derive(Debug, Clone, Default)]
pub struct DrawnMesh {
    pub corners: Vec<(Point3<f64>, Vector3<f64>)>,
    pub faces: Vec<[usize; 3]>,
}

/// Number of sides of a round body.
const SIDES: usize = 24;
/// Number of rings of a sphere from pole to pole.
const STACKS: usize = 12;
/// Width of the bevel of an edge (m), and its largest share of the body's size. Bevels catch the light, which makes a
/// box look solid.
const BEVEL_M: f64 = 0.002;
const BEVEL_SHARE: f64 = 0.15;

fn bevelled_box(half: Vector3<f64>) -> DrawnMesh {
    let bevel = BEVEL_M.min(BEVEL_SHARE * half.min());
    let mut mesh = DrawnMesh::default();
    // Corner k of the box has a corner of the mesh on each of its three faces: 3 k + axis.
    let sign = |k: usize, axis: usize| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
    for k in 0..8 {
        for axis in 0..3 {
            let inset = |i: usize| sign(k, i) * (half[i] - if i == axis { 0.0 } else { bevel });
            let mut normal = Vector3::zeros();
            normal[axis] = sign(k, axis);
            mesh.corners
                .push((Point3::new(inset(0), inset(1), inset(2)), normal));
        }
    }
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for k in (0..8).filter(|k| k >> axis & 1 == 0) {
            // The edge that runs along the axis from this corner, between two faces.
            let end = k | 1 << axis;
            mesh.face(&[3 * k + a, 3 * end + a, 3 * end + b, 3 * k + b]);
        }
        for side in [0, 1 << axis] {
            mesh.face(
                &[side, side | 1 << a, side | 1 << a | 1 << b, side | 1 << b].map(|k| 3 * k + axis),
            );
        }
    }
    for k in 0..8 {
        mesh.face(&[3 * k, 3 * k + 1, 3 * k + 2]);
    }
    mesh
}

fn cylinder(radius: f64, length: f64) -> DrawnMesh {
    let bevel = BEVEL_M.min(BEVEL_SHARE * radius.min(length));
    let (h, r) = (length / 2.0, radius - bevel);
    revolved(&[
        [0.0, -h, 0.0, -1.0],
        [r, -h, 0.0, -1.0],
        [radius, bevel - h, 1.0, 0.0],
        [radius, h - bevel, 1.0, 0.0],
        [r, h, 0.0, 1.0],
        [0.0, h, 0.0, 1.0],
    ])
}

/// A capsule, or with the length 0 a sphere.
fn capsule(radius: f64, length: f64) -> DrawnMesh {
    let half_ball = |first: usize, to: f64| {
        (first..=first + STACKS / 2).map(move |k| {
            let (sin, cos) = (180.0 * k as f64 / STACKS as f64).to_radians().sin_cos();
            // Rounding leaves sin a little above 0 at the upper pole.
            let sin = if k == STACKS { 0.0 } else { sin };
            [radius * sin, to - radius * cos, sin, -cos]
        })
    };
    let (lower, upper) = (
        half_ball(0, -0.5 * length),
        half_ball(STACKS / 2, 0.5 * length),
    );
    revolved(
        &lower
            .chain(upper.skip(usize::from(length == 0.0)))
            .collect::<Vec<_>>(),
    )
}

/// Least angle between two triangles that meet at a visible edge (rad). Below it they look like one curved surface.
const CREASE_RAD: f64 = 0.7;

/// A mesh of a file, with normals that show curved surfaces and edges.
fn creased(mesh: &robot::mesh::Mesh) -> DrawnMesh {
    let at = |i: u32| mesh.points[i as usize];
    let across: Vec<Vector3<f64>> = mesh
        .triangles
        .iter()
        .map(|&[a, b, c]| (at(b) - at(a)).cross(&(at(c) - at(a))))
        .collect();
    let normal = |face: usize| across[face].try_normalize(0.0);
    let mut around = vec![Vec::new(); mesh.points.len()];
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        for &corner in triangle {
            around[corner as usize].push(face);
        }
    }
    let mut creased = DrawnMesh::default();
    // The corners made so far for each point, by the faces that share them.
    let mut made: HashMap<(u32, Vec<usize>), usize> = HashMap::new();
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        let Some(own) = normal(face) else { continue };
        creased.faces.push(triangle.map(|point| {
            let shared: Vec<usize> = around[point as usize]
                .iter()
                .copied()
                .filter(|&other| normal(other).is_some_and(|n| n.dot(&own) > CREASE_RAD.cos()))
                .collect();
            let sum: Vector3<f64> = shared.iter().map(|&other| across[other]).sum();
            *made.entry((point, shared)).or_insert_with(|| {
                creased
                    .corners
                    .push((at(point), sum.try_normalize(0.0).unwrap_or(own)));
                creased.corners.len() - 1
            })
        }));
    }
    creased
}

/// A surface of revolution about z. Each row of the profile is a point (r, z) with its normal (r, z), from bottom to
/// top along the outside.
fn revolved(profile: &[[f64; 4]]) -> DrawnMesh {
    let mut mesh = DrawnMesh::default();
    for k in 0..SIDES {
        let (sin, cos) = (360.0 * k as f64 / SIDES as f64).to_radians().sin_cos();
        for &[r, z, nr, nz] in profile {
            mesh.corners.push((
                Point3::new(r * cos, r * sin, z),
                Vector3::new(nr * cos, nr * sin, nz),
            ));
        }
    }
    for k in 0..SIDES {
        let (this, next) = (k * profile.len(), (k + 1) % SIDES * profile.len());
        // Two points at the same place are an edge, with different normals and no face between them.
        let stretches = profile
            .windows(2)
            .enumerate()
            .filter(|(_, ends)| ends[0][..2] != ends[1][..2]);
        for (i, ends) in stretches {
            // Next to a point on the axis, a face is a single triangle.
            if ends[0][0] > 0.0 {
                mesh.faces.push([this + i, next + i, next + i + 1]);
            }
            if ends[1][0] > 0.0 {
                mesh.faces.push([this + i, next + i + 1, this + i + 1]);
            }
        }
    }
    mesh
}

impl DrawnMesh {
    /// The mesh of a solid, in its own frame (m).
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Box { half } => bevelled_box(half),
            Shape::Cylinder { radius, length } => cylinder(radius, length),
            Shape::Capsule { radius, length } => capsule(radius, length),
            Shape::Sphere { radius } => capsule(radius, 0.0),
            Shape::Mesh(ref mesh) => creased(mesh),
        }
    }

    pub fn at(mut self, pose: &Isometry3<f64>) -> Self {
        for (at, normal) in &mut self.corners {
            (*at, *normal) = (pose * *at, pose * *normal);
        }
        self
    }

    /// Adds a convex polygon, oriented so that its front is on the side of its normals.
    fn face(&mut self, corners: &[usize]) {
        let at = |i: usize| self.corners[corners[i]].0;
        let outward: Vector3<f64> = corners.iter().map(|&i| self.corners[i].1).sum();
        let turned = (at(1) - at(0)).cross(&(at(2) - at(0))).dot(&outward) < 0.0;
        for i in 1..corners.len() - 1 {
            let [a, b] = if turned { [i + 1, i] } else { [i, i + 1] };
            self.faces.push([corners[0], corners[a], corners[b]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The volume by the divergence theorem, which is right only if the surface is closed and every face looks outward.
    fn volume(mesh: &DrawnMesh) -> f64 {
        let at = |i: usize| mesh.corners[i].0.coords;
        mesh.faces
            .iter()
            .map(|f| at(f[0]).cross(&at(f[1])).dot(&at(f[2])) / 6.0)
            .sum()
    }

    /// The normals of the meshes point to the front of their faces.
    #[test]
    fn meshes_are_closed_look_outward_and_have_the_right_volume() {
        let ball = 4.0 / 3.0 * PI * 0.001;
        for (mesh, exact, least) in [
            (
                bevelled_box(Vector3::new(0.05, 0.1, 0.15)),
                8.0 * 0.05 * 0.1 * 0.15,
                0.998,
            ),
            (cylinder(0.05, 0.2), PI * 0.0025 * 0.2, 0.98),
            (capsule(0.1, 0.0), ball, 0.95),
            (capsule(0.1, 0.3), ball + PI * 0.01 * 0.3, 0.95),
        ] {
            let share = volume(&mesh) / exact;
            assert!(share < 1.0 && share > least, "{share}");
            for face in &mesh.faces {
                let [a, b, c] = face.map(|i| mesh.corners[i].0);
                let outward = (b - a).cross(&(c - a)).normalize();
                for normal in face.map(|i| mesh.corners[i].1) {
                    assert!((normal.norm() - 1.0).abs() < 1e-9);
                    assert!(
                        normal.dot(&outward) > 0.2,
                        "{normal} on a face towards {outward}"
                    );
                }
            }
        }
    }

    /// A mesh as from a file, with the corners and faces of `mesh`.
    fn file(mesh: &DrawnMesh) -> robot::mesh::Mesh {
        let faces = mesh
            .faces
            .iter()
            .map(|face| face.map(|corner| corner as u32))
            .collect();
        robot::mesh::Mesh::new(mesh.corners.iter().map(|(at, _)| *at).collect(), faces)
    }

    #[test]
    fn edges_of_meshes_are_sharp_and_their_curves_are_smooth() {
        let half = Vector3::new(0.1, 0.2, 0.3);
        let corner = |k: usize| {
            Point3::from(Vector3::from_fn(|axis, _| {
                if k >> axis & 1 == 1 {
                    half[axis]
                } else {
                    -half[axis]
                }
            }))
        };
        let mut cube = DrawnMesh {
            corners: (0..8).map(|k| (corner(k), corner(k).coords)).collect(),
            faces: Vec::new(),
        };
        for side in [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ] {
            cube.face(&side);
        }
        let cube = creased(&file(&cube));
        assert_eq!(
            (cube.corners.len(), cube.faces.len()),
            (24, 12),
            "each corner is one for each of its sides"
        );
        assert!(
            cube.corners
                .iter()
                .all(|(_, normal)| (normal.amax() - 1.0).abs() < 1e-12)
        );
        let ball = creased(&file(&capsule(0.1, 0.0)));
        for (at, normal) in ball.corners.iter().filter(|(at, _)| at.z.abs() < 0.09) {
            assert!(normal.angle(&at.coords) < 0.05, "{normal} at {at}");
        }
        assert!((volume(&cube) - 8.0 * half.product()).abs() < 1e-12);
    }
}
