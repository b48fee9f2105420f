//! Pictures of the robot, drawn without display, graphics card or driver: stills, strips and moving pictures of an episode.
//!
//! A small renderer of triangles with a depth buffer. The same snapshot gives the same bytes, whatever the number of threads;
//! on another machine they may differ where its sines do, in their last place.

mod camera;
mod files;
mod floor;
mod frames;
mod label;
mod mesh;
mod motion;
mod overlay;
mod raster;
#[cfg(test)]
mod tests;

use crate::episode::Snapshot;
use crate::render::palette::Overlay;
use crate::render::scale::Scale;
use crate::robot::{Kinematics, Posture, Robot, Shape};
use crate::sim::Ground;
pub use camera::Camera;
use camera::View;
pub use files::{png, strip};
use floor::Floor;
pub use frames::{FramesOptions, check_folder, write_frames};
use image::RgbImage;
pub use label::label;
use mesh::Mesh;
use nalgebra::{Isometry3, Point3, Vector3};
use raster::{Corner, Light, Triangle, linear};

/// Draws a moment of an episode with some marks, in a picture of `size` (width, height; px). `robot` is the simulated one. The ground has
/// the snapshot's slope, and no step.
pub fn draw(robot: &Robot, snapshot: &Snapshot, camera: &Camera, size: [u32; 2], marks: &[Overlay]) -> RgbImage {
    draw_on(&Ground::default(), robot, snapshot, camera, size, marks)
}

/// As [`draw`], with the step of a ground; its slope is the snapshot's.
pub fn draw_on(
    ground: &Ground,
    robot: &Robot,
    snapshot: &Snapshot,
    camera: &Camera,
    size: [u32; 2],
    marks: &[Overlay],
) -> RgbImage {
    let ground = &Ground { slope: snapshot.slope, ..*ground };
    let (mut scene, scale) = (Scene::new(camera, size), Scale::of(robot));
    let on_floor = overlay::on_floor(&scene.view, ground, scale, snapshot, marks);
    scene.triangles.extend(&on_floor);
    scene.robot(robot, &snapshot.posture);
    // Once more where the robot hides them, faintly.
    let hidden = |mark: &Triangle| Triangle { cover: 0.0, through: overlay::THROUGH * mark.cover, ..*mark };
    scene.triangles.extend(on_floor.iter().map(hidden));
    overlay::in_space(&mut scene, ground, scale, snapshot, marks);
    scene.paint(size, ground)
}

/// Draws a robot on a level floor and nothing else, in a picture of `size` (width, height; px).
pub fn draw_posture(robot: &Robot, posture: &Posture, camera: &Camera, size: [u32; 2]) -> RgbImage {
    let mut scene = Scene::new(camera, size);
    scene.robot(robot, posture);
    scene.paint(size, &Ground::default())
}

/// Balls (centre in the world and radius, m) that hold the robot's solids: what a camera is to be framed on.
pub fn extent(robot: &Robot, posture: &Posture) -> Vec<(Point3<f64>, f64)> {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, posture);
    let of_link = |i: usize| {
        let pose = kinematics.link_pose(i);
        robot.links[i].drawn().iter().map(move |solid| {
            let radius = match solid.shape {
                Shape::Box { half } => half.norm(),
                Shape::Cylinder { radius, length } => (radius * radius + length * length / 4.0).sqrt(),
                Shape::Sphere { radius } => radius,
            };
            (pose * Point3::from(solid.pose.translation.vector), radius)
        })
    };
    (0..robot.links.len()).flat_map(of_link).collect()
}

/// What is to be painted.
struct Scene {
    view: View,
    /// Towards the lamp, and towards a weaker light that fills its shadows.
    lamp: Vector3<f64>,
    fill: Vector3<f64>,
    triangles: Vec<Triangle>,
    /// World; what throws a shadow.
    opaque: Vec<[Point3<f64>; 3]>,
}

/// How a body is painted.
#[derive(Clone, Copy)]
struct Paint {
    light: Light,
    /// As in [`Triangle`].
    cover: f32,
    through: f32,
    throws_shadow: bool,
}

impl Scene {
    fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let view = View::new(camera, size);
        // Horizontally towards the camera. The lamp is above the camera's left shoulder: what is seen is lit, and shadows fall away to the right.
        let level = view.right.cross(&Vector3::z());
        let lamp = (Vector3::z() * 1.5 + level * 0.75 - view.right * 0.8).normalize();
        let fill = (Vector3::z() * 0.35 + level * 0.6 + view.right * 0.9).normalize();
        Self { view, lamp, fill, triangles: Vec::new(), opaque: Vec::new() }
    }

    fn robot(&mut self, robot: &Robot, posture: &Posture) {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, posture);
        let solids = || robot.links.iter().enumerate().flat_map(|(i, link)| link.drawn().iter().map(move |s| (i, s)));
        // What is translucent is painted over what is not.
        for opaque in [true, false] {
            for (i, solid) in solids().filter(|(_, solid)| (solid.color[3] >= 1.0) == opaque) {
                let [r, g, b, alpha] = solid.color;
                let paint =
                    Paint { light: linear([r, g, b]), cover: alpha as f32, through: 0.0, throws_shadow: opaque };
                self.body(&mesh::of_shape(&solid.shape), &(kinematics.link_pose(i) * solid.pose), &paint);
            }
        }
    }

    /// A mesh at a pose. Of its faces those are painted that look at the camera.
    fn body(&mut self, mesh: &Mesh, pose: &Isometry3<f64>, paint: &Paint) {
        let corners: Vec<_> = mesh
            .corners
            .iter()
            .map(|(point, normal)| {
                let at = pose * point;
                let light = self.shaded(paint.light, &at, &(pose.rotation * normal));
                let corner = self.view.project(at).map(|[x, y, near]| Corner { at: [x, y], near, light });
                (at, corner)
            })
            .collect();
        for face in &mesh.faces {
            let [a, b, c] = face.map(|i| corners[i].0);
            if paint.throws_shadow {
                self.opaque.push([a, b, c]);
            }
            if (b - a).cross(&(c - a)).dot(&(self.view.eye - a)) <= 0.0 {
                continue;
            }
            if let [Some(a), Some(b), Some(c)] = face.map(|i| corners[i].1) {
                let Paint { cover, through, .. } = *paint;
                self.triangles.push(Triangle { corners: [a, b, c], cover, through, hides: cover >= 1.0 });
            }
        }
    }

    /// A colour on a surface: light from sky and floor, from the lamp, from the other side, and a gloss.
    fn shaded(&self, light: Light, at: &Point3<f64>, normal: &Vector3<f64>) -> Light {
        let eye = (self.view.eye - at).normalize();
        let half = (self.lamp + eye).normalize();
        let sky = 0.30 + 0.14 * normal.z;
        let diffuse = sky + 0.72 * normal.dot(&self.lamp).max(0.0) + 0.16 * normal.dot(&self.fill).max(0.0);
        let mut gloss = normal.dot(&half).max(0.0);
        for _ in 0..5 {
            gloss *= gloss;
        }
        light.map(|v| v * diffuse as f32 + 0.06 * gloss as f32 + 0.010)
    }

    fn paint(&self, size: [u32; 2], ground: &Ground) -> RgbImage {
        let floor = Floor::new(self.view, ground, self.lamp, &self.opaque);
        raster::paint(size, &floor, &self.triangles)
    }
}
