//! Floor and background of a picture: a floor with a grid that fades into a plain background, and the robot's shadow.

use super::camera::{CameraView, NEAREST_M};
use super::triangle::{Light, for_each_inside, linear};
use crate::scene::GroundPart;
use image::imageops::{blur, interpolate_bilinear};
use image::{ImageBuffer, Luma};
use nalgebra::{Point3, Vector3};
use standfast_sim::Ground;

// Colours of the floor, its lines, and its strong lines.
const FLOOR: Light = linear([0.905, 0.915, 0.930]);
const LINE: Light = linear([0.800, 0.820, 0.850]);
const STRONG_LINE: Light = linear([0.700, 0.728, 0.770]);
const HORIZON: Light = linear([0.955, 0.962, 0.972]);
const ZENITH: Light = linear([0.800, 0.845, 0.900]);
/// Distance between the lines of the grid, and between its strong lines, and their width (m).
const PERIOD_M: f64 = 0.1;
const STRONG_PERIOD_M: f64 = 0.5;
const LINE_WIDTH_M: f64 = 0.0022;
/// Distance from the target at which the floor has faded, as a multiple of the distance of the camera.
const FADED: f64 = 1.9;
/// Brightness of the patch, and of its walls, as a share of the brightness of the floor around them.
const PATCH: f32 = 0.87;
const WALL: f32 = 0.62;
/// Share of the light that is missing in full shadow.
const SHADOW: f32 = 0.62;

pub(super) struct Floor {
    view: CameraView,
    ground: Ground,
    /// The eye, the directions right, up and back, and the target in the frame of the plane. All fields below are in
    /// this frame.
    eye: Vector3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    back: Vector3<f64>,
    target: Vector3<f64>,
    shadow: Shadow,
}

impl Floor {
    /// The ground with the shadow of `triangles` (m, world frame). `lamp` is the unit vector towards the lamp.
    pub fn new(
        view: CameraView,
        ground: &Ground,
        lamp: Vector3<f64>,
        triangles: &[[Point3<f64>; 3]],
    ) -> Self {
        let local = |world: Vector3<f64>| ground.slope.inverse() * world;
        let faces: Vec<_> = triangles
            .iter()
            .map(|corners| corners.map(|at| local(at.coords)))
            .collect();
        Self {
            view,
            ground: *ground,
            eye: local(view.eye.coords),
            right: local(view.right),
            up: local(view.up),
            back: local(view.back),
            target: local(view.target.coords),
            shadow: Shadow::new(local(lamp), &faces),
        }
    }

    /// The ray through a point of the picture (px), with a depth of 1.
    fn ray(&self, at: [f64; 2]) -> Vector3<f64> {
        let CameraView {
            middle, focal_px, ..
        } = self.view;
        let [x, y] = [0, 1].map(|i| (at[i] - middle[i]) / focal_px);
        self.right * x - self.up * y - self.back
    }

    /// The part of the ground that a ray meets first, and its depth (m). A wall is met at the depth of the level below.
    fn met(&self, ray: &Vector3<f64>) -> Option<(GroundPart, f64)> {
        use GroundPart::{Around, Patch, Wall};
        let (
            eye,
            Ground {
                step_m,
                patch: [least, most],
                ..
            },
        ) = (self.eye, self.ground);
        // Whether the ray meets the level of a part within the part, and the depth there. A level is not seen from
        // below.
        let level = |part: GroundPart| {
            let depth = (if part == Patch { 0.0 } else { step_m } - eye.z) / ray.z;
            let is_in_patch = step_m != 0.0
                && (0..2).all(|i| (least[i]..=most[i]).contains(&(eye[i] + depth * ray[i])));
            (ray.z < 0.0 && depth > NEAREST_M).then_some((is_in_patch == (part == Patch), depth))
        };
        let [high, low] = if step_m > 0.0 {
            [Around, Patch]
        } else {
            [Patch, Around]
        };
        match level(high) {
            Some((true, depth)) => Some((high, depth)),
            _ => level(low).map(|(is_there, depth)| (if is_there { low } else { Wall }, depth)),
        }
    }

    /// One over the depth of the ground at a point of the picture (1/m); 0 for the background.
    pub fn near(&self, at: [f64; 2]) -> f32 {
        self.met(&self.ray(at))
            .map_or(0.0, |(_, depth)| depth.recip() as f32)
    }

    /// The light at a point of the picture (px).
    pub fn light(&self, place: [f64; 2]) -> Light {
        let CameraView {
            middle,
            distance_m,
            focal_px,
            ..
        } = self.view;
        let upwards = (1.0 - place[1] / (2.0 * middle[1])).clamp(0.0, 1.0) as f32;
        let background = mix(HORIZON, ZENITH, upwards * upwards);
        let ray = self.ray(place);
        let Some((part, depth)) = self.met(&ray) else {
            return background;
        };
        let point = self.eye + ray * depth;
        let distance = (point - self.target).xy().norm() / (FADED * distance_m);
        if distance >= 1.0 {
            return background;
        }
        let fade = (1.0 - distance * distance) as f32;
        let fade = fade * fade;
        // Movement of the floor from one pixel to the next, right and down.
        let turns = [self.right, -self.up].map(|direction| direction / focal_px);
        let steps = turns.map(|turn| (turn - ray * (turn.z / ray.z)) * depth);
        let width = [0, 1].map(|i| steps.iter().map(|step| step[i].abs()).sum::<f64>());
        let lines = |period: f64, breadth: f64| {
            let bare = [0, 1].map(|i| 1.0 - line_share(point[i], width[i], period, breadth));
            (1.0 - bare[0] * bare[1]) as f32
        };
        let mut light = FLOOR;
        if part != GroundPart::Wall {
            light = mix(light, LINE, fade * lines(PERIOD_M, LINE_WIDTH_M));
            light = mix(
                light,
                STRONG_LINE,
                fade * lines(STRONG_PERIOD_M, 1.5 * LINE_WIDTH_M),
            );
        }
        let given_back = match part {
            GroundPart::Around => 1.0,
            GroundPart::Patch => PATCH,
            GroundPart::Wall => WALL,
        };
        let lit = given_back * (1.0 - SHADOW * self.shadow.at(&point) * fade);
        mix(background, light.map(|v| v * lit), fade)
    }
}

/// The light at a share of the way from `a` to `b`.
fn mix(a: Light, b: Light, share: f32) -> Light {
    [0, 1, 2].map(|i| a[i] + share * (b[i] - a[i]))
}

/// Share of an interval of `width` about `at` that is covered by lines of a grid. Lines that are too fine to be visible
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
/// Standard deviation of the blur that makes the shadow soft.
const BLUR_CELLS: f32 = 5.0;
/// Room for the blur at the edges.
const ROOM: u32 = 15;

/// The soft shadow on the floor, in the frame of the plane.
struct Shadow {
    /// Lower left corner on the floor (m), and cells per metre.
    corner: [f64; 2],
    cells_per_m: f64,
    /// Vector towards the lamp with z = 1.
    lamp: Vector3<f64>,
    /// Darkness of each cell, from 0 (lit) to 1.
    dark: ImageBuffer<Luma<f32>, Vec<f32>>,
}

impl Shadow {
    fn new(lamp: Vector3<f64>, faces: &[[Vector3<f64>; 3]]) -> Self {
        let mut shadow = Self {
            corner: [0.0; 2],
            cells_per_m: 0.0,
            lamp: lamp / lamp.z,
            dark: ImageBuffer::new(CELLS, CELLS),
        };
        let points: Vec<[f64; 2]> = faces
            .iter()
            .flatten()
            .map(|point| shadow.thrown(point))
            .collect();
        let ends = |i: usize| {
            points
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, m], at| {
                    [l.min(at[i]), m.max(at[i])]
                })
        };
        let (x, y) = (ends(0), ends(1));
        let extent = (x[1] - x[0]).max(y[1] - y[0]);
        if extent.is_finite() && extent > 0.0 {
            let cell_m = CELL_M * (extent / (CELL_M * f64::from(CELLS - 2 * ROOM - 1))).ceil();
            shadow.cells_per_m = 1.0 / cell_m;
            shadow.corner =
                [x[0], y[0]].map(|least| ((least / cell_m).floor() - f64::from(ROOM)) * cell_m);
            for face in faces {
                let corners = face.map(|point| shadow.cell(&point));
                let dark = &mut shadow.dark;
                for_each_inside(
                    corners,
                    [0, 0, CELLS as usize, CELLS as usize],
                    |x, y, _| {
                        dark[(x as u32, y as u32)] = Luma([1.0]);
                    },
                );
            }
            shadow.dark = blur(&shadow.dark, BLUR_CELLS);
        }
        shadow
    }

    /// Place on the floor of the shadow of a point (m).
    fn thrown(&self, point: &Vector3<f64>) -> [f64; 2] {
        [0, 1].map(|i| point[i] - self.lamp[i] * point.z)
    }

    /// Place on the floor of the shadow of a point, in cells.
    fn cell(&self, point: &Vector3<f64>) -> [f64; 2] {
        let at = self.thrown(point);
        [0, 1].map(|i| (at[i] - self.corner[i]) * self.cells_per_m)
    }

    /// Darkness at a point of the ground (m), from 0 to 1.
    fn at(&self, point: &Vector3<f64>) -> f32 {
        let [x, y] = self.cell(point).map(|cells| (cells - 0.5) as f32);
        interpolate_bilinear(&self.dark, x, y).map_or(0.0, |Luma([dark])| dark)
    }
}
