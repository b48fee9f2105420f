//! The canvas of a picture: collects lit triangles, and paints them over the ground with their shadow.

use super::camera::{Camera, CameraView};
use super::floor::Floor;
use super::raster;
use super::triangle::{Light, Triangle, Vertex, linear};
use crate::scene::palette::GHOST;
use crate::scene::{Stage, Surface};
use image::RgbImage;
use nalgebra::{Point3, Vector3};
use standfast_core::robot::Kinematics;
use standfast_sim::Ground;

/// The triangles of a picture, with its camera and its light.
pub(super) struct Canvas {
    pub view: CameraView,
    /// Unit vectors towards the lamp, and towards a weaker light that brightens the shadows.
    lamp: Vector3<f64>,
    fill: Vector3<f64>,
    pub triangles: Vec<Triangle>,
    /// Opaque triangles, which cast a shadow (m, world frame).
    opaque: Vec<[Point3<f64>; 3]>,
}

impl Canvas {
    pub fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let view = CameraView::new(camera, size);
        // `level` points horizontally towards the camera. The lamp is above and to the left of the camera, so that the
        // visible sides are lit, and shadows fall to the right.
        let level = view.right.cross(&Vector3::z());
        let lamp = (Vector3::z() * 1.5 + level * 0.75 - view.right * 0.8).normalize();
        let fill = (Vector3::z() * 0.35 + level * 0.6 + view.right * 0.9).normalize();
        Self {
            view,
            lamp,
            fill,
            triangles: Vec::new(),
            opaque: Vec::new(),
        }
    }

    /// Adds a ghost, which casts no shadow and shows only its nearest surface. It is drawn slightly farther away than
    /// it is, so that a robot at the same place hides it.
    pub fn ghost(&mut self, stage: &Stage, kinematics: &Kinematics) {
        const BEHIND: f64 = 0.998;
        let (first, opaque) = (self.triangles.len(), self.opaque.len());
        self.solids(stage, kinematics, Some(linear(GHOST.color.parts())));
        self.opaque.truncate(opaque);
        let ghost = &mut self.triangles[first..];
        for triangle in &mut *ghost {
            for corner in &mut triangle.corners {
                corner.near *= BEHIND;
            }
            (triangle.cover, triangle.hides) = (GHOST.opacity as f32, true);
        }
        // The nearest triangles come first, and hide the others.
        let near = |triangle: &Triangle| {
            triangle
                .corners
                .iter()
                .map(|corner| corner.near)
                .sum::<f64>()
        };
        ghost.sort_by(|a, b| near(b).total_cmp(&near(a)));
    }

    pub fn robot(&mut self, stage: &Stage, kinematics: &Kinematics) {
        self.solids(stage, kinematics, None);
    }

    /// Adds the solids of a robot in their own colours, or in `color`. Only faces that look at the camera are painted.
    fn solids(&mut self, stage: &Stage, kinematics: &Kinematics, color: Option<Light>) {
        for (solid, pose) in stage.solids(kinematics) {
            let Surface {
                color: [r, g, b, alpha],
                mesh,
                ..
            } = solid;
            let (color, cover) = (color.unwrap_or(linear([*r, *g, *b])), *alpha as f32);
            let (mut places, mut vertices) = (Vec::new(), Vec::new());
            for (point, normal) in &mesh.corners {
                let place = pose * point;
                let light = self.shaded(color, &place, &(pose.rotation * normal));
                places.push(place);
                vertices.push(self.view.project(place).map(|[x, y, near]| Vertex {
                    at: [x, y],
                    near,
                    light,
                }));
            }
            for face in &mesh.faces {
                let [a, b, c] = face.map(|i| places[i]);
                if !solid.is_translucent() {
                    self.opaque.push([a, b, c]);
                }
                if (b - a).cross(&(c - a)).dot(&(self.view.eye - a)) <= 0.0 {
                    continue;
                }
                if let [Some(a), Some(b), Some(c)] = face.map(|i| vertices[i]) {
                    self.triangles.push(Triangle {
                        corners: [a, b, c],
                        cover,
                        hides: cover >= 1.0,
                    });
                }
            }
        }
    }

    /// The light that a surface sends to the eye: from sky and floor, from both lamps, and as a gloss.
    fn shaded(&self, light: Light, at: &Point3<f64>, normal: &Vector3<f64>) -> Light {
        let eye = (self.view.eye - at).normalize();
        let half = (self.lamp + eye).normalize();
        let sky = 0.30 + 0.14 * normal.z;
        let diffuse =
            sky + 0.72 * normal.dot(&self.lamp).max(0.0) + 0.16 * normal.dot(&self.fill).max(0.0);
        let gloss = normal.dot(&half).max(0.0).powi(32);
        light.map(|v| v * diffuse as f32 + 0.06 * gloss as f32 + 0.010)
    }

    pub fn paint(&self, size: [u32; 2], ground: &Ground) -> RgbImage {
        let floor = Floor::new(self.view, ground, self.lamp, &self.opaque);
        raster::paint(size, &floor, &self.triangles)
    }
}
