//! What the robot stands on and before: a floor with a grid that fades out into a plain background, and the robot's
//! shadow.

use super::camera::{NEAREST_M, View};
use super::triangle::{Coverage, Light, Vertex, linear};
use crate::render::scene::{self, Face, GroundPart};
use crate::sim::Ground;
use nalgebra::{Matrix3, Point3, Vector3};

/// Colours as stored, 0 to 1.
const FLOOR: [f64; 3] = [0.905, 0.915, 0.930];
const LINE: [f64; 3] = [0.800, 0.820, 0.850];
const STRONG_LINE: [f64; 3] = [0.700, 0.728, 0.770];
const HORIZON: [f64; 3] = [0.955, 0.962, 0.972];
const ZENITH: [f64; 3] = [0.800, 0.845, 0.900];
/// Of the grid (m).
const PERIOD_M: f64 = 0.1;
const STRONG_PERIOD_M: f64 = 0.5;
const LINE_WIDTH_M: f64 = 0.0022;
/// The floor has faded where it is so many times as far from the target as the camera is.
const FADED: f64 = 1.9;
/// Share of the light that the patch gives back, and its walls, of that of the floor around.
const PATCH: f32 = 0.87;
const WALL: f32 = 0.62;
/// Share of the light that a full shadow takes away.
const SHADOW: f32 = 0.62;
/// The lamp is a square of so many points to a side, and of this size seen from the ground (radians, about).
const LAMPS: usize = 5;
const LAMP_SIZE: f64 = 0.2;

/// Floor and background of a picture.
pub(super) struct Floor {
    view: View,
    /// Columns: directions on the floor, and its normal.
    axes: Matrix3<f64>,
    /// What of the ground is before the camera.
    pub faces: Vec<(GroundPart, Vec<Vertex>)>,
    shadow: Shadow,
    floor: Light,
    line: Light,
    strong_line: Light,
    horizon: Light,
    zenith: Light,
}

impl Floor {
    /// The ground, with the shadow of `triangles` (world) in the light from `lamp` (unit vector towards it).
    pub fn new(view: View, ground: &Ground, lamp: Vector3<f64>, triangles: &[[Point3<f64>; 3]]) -> Self {
        let axes = *ground.slope.to_rotation_matrix().matrix();
        let normal = Vector3::from(axes.column(2));
        let height_m = |at: &Point3<f64>| normal.dot(&(view.eye - at));
        // As far as the floor is to be seen, wherever the target is.
        let reach_m = 1.01 * FADED * view.distance_m + view.target.coords.norm();
        let mut faces = Vec::new();
        for Face { part, corners } in scene::faces(ground, reach_m, 2.0 * reach_m) {
            let corners = corners.map(|corner| ground.slope * corner);
            // Of what is level nothing is seen from below.
            if part == GroundPart::Wall || height_m(&corners[0]) > 0.0 {
                // No ray of a picture meets the floor nearer than that.
                let nearest_m = NEAREST_M.max(0.2 * height_m(&corners[0]));
                let before = view.clipped(&corners, nearest_m);
                faces.push((part, before.into_iter().filter_map(|at| view.vertex(at, [0.0; 3])).collect()));
            }
        }
        Self {
            faces,
            view,
            axes,
            shadow: Shadow::new(&axes, lamp, triangles),
            floor: linear(FLOOR),
            line: linear(LINE),
            strong_line: linear(STRONG_LINE),
            horizon: linear(HORIZON),
            zenith: linear(ZENITH),
        }
    }

    fn normal(&self) -> Vector3<f64> {
        self.axes.column(2).into()
    }

    /// In the frame of the plane.
    fn local(&self, world: &Vector3<f64>) -> Vector3<f64> {
        self.axes.tr_mul(world)
    }

    /// What is seen at a point of the picture (px): a part of the ground, one over whose depth is `near` (1/m), or none
    /// of it.
    pub fn light(&self, [x, y]: [f64; 2], part: Option<GroundPart>, near: f64) -> Light {
        let upwards = (1.0 - y / (2.0 * self.view.middle[1])).clamp(0.0, 1.0) as f32;
        let background = mix(self.horizon, self.zenith, upwards * upwards);
        let Some(part) = part else { return background };
        let (eye, ray) = (self.view.eye, self.view.ray(x, y));
        let point = eye + ray / near;
        let across = point - self.view.target;
        let distance = (across - self.normal() * self.normal().dot(&across)).norm() / (FADED * self.view.distance_m);
        if distance >= 1.0 {
            return background;
        }
        let fade = (1.0 - distance * distance) as f32;
        let fade = fade * fade;
        // How far the floor moves from one pixel to the next, right and down.
        let steps = [self.view.right, -self.view.up].map(|direction| {
            let turn = direction / self.view.focal_px;
            (turn - ray * (self.normal().dot(&turn) / self.normal().dot(&ray))) / near
        });
        let axis = |i: usize| Vector3::from(self.axes.column(i));
        let local = self.local(&point.coords);
        let at = [local.x, local.y];
        let width = [0, 1].map(|i| steps.iter().map(|step| axis(i).dot(step).abs()).sum::<f64>());
        let lines = |period: f64, breadth: f64| {
            let bare = [0, 1].map(|i| 1.0 - line_share(at[i], width[i], period, breadth));
            (1.0 - bare[0] * bare[1]) as f32
        };
        let mut light = self.floor;
        if part != GroundPart::Wall {
            light = mix(light, self.line, fade * lines(PERIOD_M, LINE_WIDTH_M));
            light = mix(light, self.strong_line, fade * lines(STRONG_PERIOD_M, 1.5 * LINE_WIDTH_M));
        }
        let given_back = match part {
            GroundPart::Around => 1.0,
            GroundPart::Patch => PATCH,
            GroundPart::Wall => WALL,
        };
        let lit = given_back * (1.0 - SHADOW * self.shadow.at(&local) * fade);
        mix(background, light.map(|v| v * lit), fade)
    }
}

fn mix(a: Light, b: Light, share: f32) -> Light {
    [0, 1, 2].map(|i| a[i] + share * (b[i] - a[i]))
}

/// Share of a stretch of `width` about `at` that lines of a grid take up: lines too fine to be seen become a tint.
fn line_share(at: f64, width: f64, period: f64, breadth: f64) -> f64 {
    let width = width.max(1e-9);
    // Length of lines from the origin on, each about a multiple of the period.
    let total = |x: f64| {
        let x = x + breadth / 2.0;
        let whole = (x / period).floor();
        whole * breadth + (x - whole * period).min(breadth)
    };
    (total(at + width / 2.0) - total(at - width / 2.0)) / width
}

/// Cells along a side of the shadow, and their size where the robot stands (m). Those of a shadow that is longer are so
/// many times as large; their grid lies still, so that a still robot's shadow does.
const CELLS: usize = 320;
const CELL_M: f64 = 0.0025;

/// A soft shadow on the floor: mean of those that the points of a lamp throw.
struct Shadow {
    /// Lower left corner on the floor (m), and cells per metre.
    corner: [f64; 2],
    cells_per_m: f64,
    /// Towards the middle of the lamp, z 1, in the frame of the plane.
    lamp: Vector3<f64>,
    /// 0 lit, 1 dark; row by row.
    dark: Vec<f32>,
}

impl Shadow {
    fn new(axes: &Matrix3<f64>, lamp: Vector3<f64>, triangles: &[[Point3<f64>; 3]]) -> Self {
        let in_floor: Vec<[Vector3<f64>; 3]> =
            triangles.iter().map(|corners| corners.map(|corner| axes.tr_mul(&corner.coords))).collect();
        let outward = in_floor.iter().map(|[a, b, c]| (b - a).cross(&(c - a)));
        let faces: Vec<_> = in_floor.iter().zip(outward).collect();
        let lamp = axes.tr_mul(&lamp);
        let middle = lamp / lamp.z;
        let (side, over) = across(&lamp);
        // Scaled so that a metre of height throws a shadow as long as their x and y.
        let lamps: Vec<Vector3<f64>> = (0..LAMPS * LAMPS)
            .map(|k| {
                let offset = |i: usize| ((i as f64 + 0.5) / LAMPS as f64 - 0.5) * LAMP_SIZE;
                let lamp = lamp + side * offset(k % LAMPS) + over * offset(k / LAMPS);
                lamp / lamp.z
            })
            .collect();
        let thrown = |lamp: &Vector3<f64>, p: &Vector3<f64>| [p.x - lamp.x * p.z, p.y - lamp.y * p.z];

        // The corners of the lamp throw the farthest.
        let corners = [0, LAMPS - 1, LAMPS * (LAMPS - 1), LAMPS * LAMPS - 1].map(|k| lamps[k]);
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in in_floor.iter().flatten() {
            for lamp in &corners {
                for (i, at) in thrown(lamp, p).into_iter().enumerate() {
                    (least[i], most[i]) = (least[i].min(at), most[i].max(at));
                }
            }
        }
        let extent = (most[0] - least[0]).max(most[1] - least[1]);
        if !(extent.is_finite() && extent > 0.0) {
            return Self { corner: [0.0; 2], cells_per_m: 0.0, lamp: middle, dark: Vec::new() };
        }
        // With room for the blur at the edges.
        let cell_m = CELL_M * (extent / (CELL_M * (CELLS - 10) as f64)).ceil();
        let cells_per_m = 1.0 / cell_m;
        let corner = least.map(|v| ((v * cells_per_m).floor() - 4.0) * cell_m);
        let mut counts = vec![0_u8; CELLS * CELLS];
        let mut reached = vec![0_u8; CELLS * CELLS];
        for (k, lamp) in lamps.iter().enumerate() {
            // Faces that the lamp sees are enough.
            for (corners, _) in faces.iter().filter(|(_, outward)| outward.dot(lamp) > 0.0) {
                let on_floor = corners.map(|p| thrown(lamp, &p));
                let corners = on_floor.map(|at| [0, 1].map(|i| (at[i] - corner[i]) * cells_per_m));
                let Some(covered) = Coverage::new(&corners, 1.0) else { continue };
                covered.for_each([0, 0, CELLS as i64, CELLS as i64], |x, y, _| {
                    let cell = y as usize * CELLS + x as usize;
                    // Once for each point of the lamp.
                    if reached[cell] != k as u8 + 1 {
                        reached[cell] = k as u8 + 1;
                        counts[cell] += 1;
                    }
                });
            }
        }
        let mut dark: Vec<f32> = counts.iter().map(|&count| f32::from(count) / (LAMPS * LAMPS) as f32).collect();
        for stride in [1, CELLS].repeat(4) {
            blur(&mut dark, stride);
        }
        Self { corner, cells_per_m, lamp: middle, dark }
    }

    /// At a point of the floor (m, frame of the plane).
    fn at(&self, point: &Vector3<f64>) -> f32 {
        let thrown = point - self.lamp * point.z;
        let [x, y] = [0, 1].map(|i| (thrown[i] - self.corner[i]) * self.cells_per_m - 0.5);
        let inside = |v: f64| v >= 0.0 && v < (CELLS - 1) as f64;
        if self.dark.is_empty() || !inside(x) || !inside(y) {
            return 0.0;
        }
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let row = |j: usize| {
            let start = j * CELLS + i;
            self.dark[start] + fx * (self.dark[start + 1] - self.dark[start])
        };
        row(j) + fy * (row(j + 1) - row(j))
    }
}

/// Two unit vectors across a direction (not zero), which is their cross product.
fn across(direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let direction = direction.normalize();
    let side = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }.cross(&direction).normalize();
    (side, direction.cross(&side))
}

/// Each cell with its two neighbours along one direction, 1 : 2 : 1.
fn blur(cells: &mut [f32], stride: usize) {
    for line in 0..CELLS {
        let start = if stride == 1 { line * CELLS } else { line };
        let mut before = cells[start];
        for k in 1..CELLS - 1 {
            let at = start + k * stride;
            let this = cells[at];
            cells[at] = 0.25 * before + 0.5 * this + 0.25 * cells[at + stride];
            before = this;
        }
    }
}
