//! Pictures of the robot, drawn without display, graphics card or driver: stills, strips and moving pictures of an
//! episode.
//!
//! A small renderer of triangles with a depth buffer. The same snapshot gives the same bytes, whatever the number of
//! threads; on another machine they may differ where its sines do, in their last place.

mod camera;
mod files;
mod floor;
mod frames;
mod label;
mod marks;
mod motion;
mod raster;
#[cfg(test)]
mod tests;

use crate::episode::Snapshot;
use crate::render::scene::mesh::Mesh;
use crate::render::scene::palette::Overlay;
use crate::render::scene::{Stage, Surface};
use crate::robot::{Kinematics, Posture, Robot};
use crate::sim::Ground;
pub use camera::Camera;
use camera::View;
pub use files::{png, strip};
use floor::Floor;
pub use frames::{FramesOptions, check_folder, write_frames};
use image::RgbImage;
pub use label::label;
use nalgebra::{Isometry3, Point3, Vector3};
use raster::{Light, Triangle, linear};

/// Draws a moment of an episode with some marks, in a picture of `size` (width, height; px). `robot` is the simulated
/// one. The ground has the snapshot's slope, and no step.
pub fn draw(robot: &Robot, snapshot: &Snapshot, camera: &Camera, size: [u32; 2], marks: &[Overlay]) -> RgbImage {
    draw_on(&Stage::new(robot, Ground::default()), snapshot, camera, size, marks)
}

/// As [`draw`], with the ground of a stage; its slope is the snapshot's.
fn draw_on(stage: &Stage, snapshot: &Snapshot, camera: &Camera, size: [u32; 2], marks: &[Overlay]) -> RgbImage {
    let (mut canvas, ground) = (Canvas::new(camera, size), stage.ground(snapshot));
    let marks = stage.marks(snapshot, marks);
    let on_ground = marks::on_the_ground(&canvas.view, &ground, stage.scale, &marks);
    canvas.triangles.extend(&on_ground);
    canvas.robot(stage, &stage.kinematics(&snapshot.posture));
    // Once more where the robot hides them, faintly.
    canvas.triangles.extend(on_ground.iter().map(marks::hidden));
    marks::in_space(&mut canvas, &ground, stage.scale, &marks);
    canvas.paint(size, &ground)
}

/// Draws a robot on a level floor and nothing else, in a picture of `size` (width, height; px).
pub fn draw_posture(robot: &Robot, posture: &Posture, camera: &Camera, size: [u32; 2]) -> RgbImage {
    let (mut canvas, stage) = (Canvas::new(camera, size), Stage::new(robot, Ground::default()));
    canvas.robot(&stage, &stage.kinematics(posture));
    canvas.paint(size, &Ground::default())
}

/// What is to be painted.
struct Canvas {
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

impl Canvas {
    fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let view = View::new(camera, size);
        // Horizontally towards the camera. The lamp is above the camera's left shoulder: what is seen is lit, and
        // shadows fall away to the right.
        let level = view.right.cross(&Vector3::z());
        let lamp = (Vector3::z() * 1.5 + level * 0.75 - view.right * 0.8).normalize();
        let fill = (Vector3::z() * 0.35 + level * 0.6 + view.right * 0.9).normalize();
        Self { view, lamp, fill, triangles: Vec::new(), opaque: Vec::new() }
    }

    fn robot(&mut self, stage: &Stage, kinematics: &Kinematics) {
        for (solid, pose) in stage.solids(kinematics) {
            let Surface { color: [r, g, b, alpha], mesh, .. } = solid;
            let light = linear([*r, *g, *b]);
            let throws_shadow = !solid.is_translucent();
            self.body(mesh, &pose, &Paint { light, cover: *alpha as f32, through: 0.0, throws_shadow });
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
                (at, self.view.vertex(at, light))
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
        let gloss = normal.dot(&half).max(0.0).powi(32);
        light.map(|v| v * diffuse as f32 + 0.06 * gloss as f32 + 0.010)
    }

    fn paint(&self, size: [u32; 2], ground: &Ground) -> RgbImage {
        let floor = Floor::new(self.view, ground, self.lamp, &self.opaque);
        raster::paint(size, &floor, &self.triangles)
    }
}
