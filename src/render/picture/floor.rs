//! Floor and background of a picture: a floor with a grid that fades into a plain background, and the robot's shadow.

use super::camera::{NEAREST_M, View};
use super::triangle::{Coverage, Light, Vertex, linear};
use crate::render::scene::{self, Face, GroundPart};
use crate::sim::Ground;
use image::imageops::{blur, interpolate_bilinear};
use image::{GrayImage, ImageBuffer, Luma};
use nalgebra::{Matrix3, Point3, Vector3};

// Colours of the floor, its lines, and the background.
const FLOOR: Light = linear([0.905, 0.915, 0.930]);
const LINE: Light = linear([0.800, 0.820, 0.850]);
const STRONG_LINE: Light = linear([0.700, 0.728, 0.770]);
const HORIZON: Light = linear([0.955, 0.962, 0.972]);
const ZENITH: Light = linear([0.800, 0.845, 0.900]);
/// Distance between the lines of the grid, and between its strong lines, and their width (m).
const PERIOD_M: f64 = 0.1;
const STRONG_PERIOD_M: f64 = 0.5;
const LINE_WIDTH_M: f64 = 0.0022;
/// Distance from the target at which the floor has faded, as a multiple of that of the camera.
const FADED: f64 = 1.9;
/// Brightness of the patch, and of its walls, as a share of that of the floor around it.
const PATCH: f32 = 0.87;
const WALL: f32 = 0.62;
/// Share of the light that is missing in full shadow.
const SHADOW: f32 = 0.62;
/// Number of points along a side of the square lamp, and its apparent size from the ground (about, in radians).
const LAMPS: usize = 5;
const LAMP_SIZE: f64 = 0.2;

pub(super) struct Floor {
    view: View,
    /// Axes of the plane in the world, as columns: two directions on the floor, and its normal.
    axes: Matrix3<f64>,
    /// The parts of the ground that are in front of the camera.
    pub faces: Vec<(GroundPart, Vec<Vertex>)>,
    shadow: Shadow,
}

impl Floor {
    /// The ground with the shadow of `triangles` (m, world frame) in the light of the lamp. `lamp` is the unit vector
    /// towards it.
    pub fn new(view: View, ground: &Ground, lamp: Vector3<f64>, triangles: &[[Point3<f64>; 3]]) -> Self {
        let axes = *ground.slope.to_rotation_matrix().matrix();
        let normal = Vector3::from(axes.column(2));
        let height_m = |at: &Point3<f64>| normal.dot(&(view.eye - at));
        // The floor must reach as far as it is seen, wherever the target is.
        let reach_m = 1.01 * FADED * view.distance_m + view.target.coords.norm();
        let mut faces = Vec::new();
        for Face { part, corners } in scene::faces(ground, reach_m, 2.0 * reach_m) {
            let corners = corners.map(|corner| ground.slope * corner);
            // A level face is not seen from below.
            if part == GroundPart::Wall || height_m(&corners[0]) > 0.0 {
                // No ray of the picture meets the floor nearer than this.
                let nearest_m = NEAREST_M.max(0.2 * height_m(&corners[0]));
                let before = view.clipped(&corners, nearest_m);
                faces.push((part, before.into_iter().filter_map(|at| view.vertex(at, [0.0; 3])).collect()));
            }
        }
        Self { faces, view, axes, shadow: Shadow::new(&axes, lamp, triangles) }
    }

    /// The light at a point of the picture (px). `part` is the part of the ground that is seen there, or None for the
    /// background, and `near` is one over its depth (1/m).
    pub fn light(&self, [x, y]: [f64; 2], part: Option<GroundPart>, near: f64) -> Light {
        let upwards = (1.0 - y / (2.0 * self.view.middle[1])).clamp(0.0, 1.0) as f32;
        let background = mix(HORIZON, ZENITH, upwards * upwards);
        let Some(part) = part else { return background };
        // From here on, vectors are in the frame of the plane.
        let View { right, up, target, eye, focal_px, .. } = self.view;
        let local = |world: &Vector3<f64>| self.axes.tr_mul(world);
        let ray = local(&self.view.ray(x, y));
        let at = local(&eye.coords) + ray / near;
        let distance = (at - local(&target.coords)).xy().norm() / (FADED * self.view.distance_m);
        if distance >= 1.0 {
            return background;
        }
        let fade = (1.0 - distance * distance) as f32;
        let fade = fade * fade;
        // How far the floor moves from one pixel to the next, right and down.
        let turns = [right, -up].map(|direction| local(&direction) / focal_px);
        let steps = turns.map(|turn| (turn - ray * (turn.z / ray.z)) / near);
        let width = [0, 1].map(|i| steps.iter().map(|step| step[i].abs()).sum::<f64>());
        let lines = |period: f64, breadth: f64| {
            let bare = [0, 1].map(|i| 1.0 - line_share(at[i], width[i], period, breadth));
            (1.0 - bare[0] * bare[1]) as f32
        };
        let mut light = FLOOR;
        if part != GroundPart::Wall {
            light = mix(light, LINE, fade * lines(PERIOD_M, LINE_WIDTH_M));
            light = mix(light, STRONG_LINE, fade * lines(STRONG_PERIOD_M, 1.5 * LINE_WIDTH_M));
        }
        let given_back = match part {
            GroundPart::Around => 1.0,
            GroundPart::Patch => PATCH,
            GroundPart::Wall => WALL,
        };
        let lit = given_back * (1.0 - SHADOW * self.shadow.at(&at) * fade);
        mix(background, light.map(|v| v * lit), fade)
    }
}

/// The light at a share of the way from `a` to `b`.
fn mix(a: Light, b: Light, share: f32) -> Light {
    [0, 1, 2].map(|i| a[i] + share * (b[i] - a[i]))
}

/// Share of a stretch of `width` about `at` that is covered by lines of a grid. Lines that are too fine to be seen
/// become a tint.
fn line_share(at: f64, width: f64, period: f64, breadth: f64) -> f64 {
    let width = width.max(1e-9);
    // Length that lines cover from the origin to x, each centred on a multiple of the period.
    let total = |x: f64| {
        let x = x + breadth / 2.0;
        let whole = (x / period).floor();
        whole * breadth + (x - whole * period).min(breadth)
    };
    (total(at + width / 2.0) - total(at - width / 2.0)) / width
}

/// Number of cells along a side of the shadow, and their size for a standing robot (m). A longer shadow has cells of a
/// multiple of this size. The grid of cells is fixed to the floor, so that the shadow of a still robot does not move.
const CELLS: u32 = 320;
const CELL_M: f64 = 0.0025;
/// Standard deviation of the blur that hides the cells and the points of the lamp.
const BLUR_CELLS: f32 = 1.4;

/// A soft shadow on the floor, the mean of the shadows in the light of each point of the lamp.
struct Shadow {
    /// Lower left corner on the floor (m), and cells per metre.
    corner: [f64; 2],
    cells_per_m: f64,
    /// Vector towards the middle of the lamp with z = 1, in the frame of the plane.
    lamp: Vector3<f64>,
    /// Darkness of each cell, from 0 (lit) to 1.
    dark: ImageBuffer<Luma<f32>, Vec<f32>>,
}

/// Place on the floor of the shadow of a point (m). `lamp` is the vector towards the lamp with z = 1. All are in the
/// frame of the plane.
fn thrown(point: &Vector3<f64>, lamp: &Vector3<f64>) -> [f64; 2] {
    [point.x - lamp.x * point.z, point.y - lamp.y * point.z]
}

impl Shadow {
    fn new(axes: &Matrix3<f64>, lamp: Vector3<f64>, triangles: &[[Point3<f64>; 3]]) -> Self {
        let faces: Vec<[Vector3<f64>; 3]> =
            triangles.iter().map(|corners| corners.map(|corner| axes.tr_mul(&corner.coords))).collect();
        let lamp = axes.tr_mul(&lamp);
        // Two unit vectors perpendicular to it.
        let side = Vector3::z().cross(&lamp).normalize();
        let over = lamp.cross(&side);
        // Scaled to z = 1, so that x and y are the offset of the shadow for each metre of height.
        let lamps: Vec<Vector3<f64>> = (0..LAMPS * LAMPS)
            .map(|k| {
                let offset = |i: usize| ((i as f64 + 0.5) / LAMPS as f64 - 0.5) * LAMP_SIZE;
                let lamp = lamp + side * offset(k % LAMPS) + over * offset(k / LAMPS);
                lamp / lamp.z
            })
            .collect();
        let everywhere = faces.iter().flatten().flat_map(|point| lamps.iter().map(|lamp| thrown(point, lamp)));
        let bounds = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let (least, most) = everywhere.fold(bounds, |(least, most), at| {
            ([0, 1].map(|i| f64::min(least[i], at[i])), [0, 1].map(|i| f64::max(most[i], at[i])))
        });
        let extent = (most[0] - least[0]).max(most[1] - least[1]);
        let mut dark = ImageBuffer::new(CELLS, CELLS);
        if !(extent.is_finite() && extent > 0.0) {
            return Self { corner: [0.0; 2], cells_per_m: 0.0, lamp: lamp / lamp.z, dark };
        }
        // The cells are large enough to leave room for the blur at the edges.
        let cell_m = CELL_M * (extent / (CELL_M * f64::from(CELLS - 10))).ceil();
        let cells_per_m = 1.0 / cell_m;
        let corner = least.map(|v| ((v * cells_per_m).floor() - 4.0) * cell_m);
        for lamp in &lamps {
            // Each point of the lamp darkens a cell at most once.
            let mut reached = GrayImage::new(CELLS, CELLS);
            for face in &faces {
                let corners = face.map(|point| thrown(&point, lamp));
                let corners = corners.map(|at| [0, 1].map(|i| (at[i] - corner[i]) * cells_per_m));
                let Some(covered) = Coverage::new(&corners, 1.0) else { continue };
                covered
                    .for_each([0, 0, CELLS.into(), CELLS.into()], |x, y, _| reached[(x as u32, y as u32)] = Luma([1]));
            }
            let share = ((LAMPS * LAMPS) as f32).recip();
            dark.iter_mut().zip(reached.iter()).for_each(|(dark, &reached)| *dark += share * f32::from(reached));
        }
        Self { corner, cells_per_m, lamp: lamp / lamp.z, dark: blur(&dark, BLUR_CELLS) }
    }

    /// Darkness at a point of the ground (m, frame of the plane), from 0 to 1.
    fn at(&self, point: &Vector3<f64>) -> f32 {
        let thrown = thrown(point, &self.lamp);
        let [x, y] = [0, 1].map(|i| ((thrown[i] - self.corner[i]) * self.cells_per_m - 0.5) as f32);
        interpolate_bilinear(&self.dark, x, y).map_or(0.0, |Luma([dark])| dark)
    }
}
