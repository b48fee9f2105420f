//! The 3D part of the picture: the floor, the robot with its shadow, and filled polygons on the floor. Marks that the
//! robot must not hide are drawn by `marks`.

use super::colors;
use super::colors::OnScreen as _;
use super::triangles::{ColoredTriangles, OnCard, Rgb, vec3};
use kiss3d::glamx::Vec3;
use kiss3d::scene::SceneNode3d;
use kiss3d::window::Window;
use nalgebra::{Point3, Vector3};
use standfast_core::robot::{Kinematics, SizeRatio};
use standfast_scene::{Drawing, GroundPart, SceneMark, Stage, faces};
use standfast_sim::Ground;
use standfast_sim::episode::Snapshot;
use standfast_sim::push::round;

// The lengths below are for a robot of the size of UT-mu2.

/// Distance at which the floor ends, after it has faded into the sky (m).
const HORIZON_M: f64 = 4.0;
/// Size of the tiles of the floor (m).
const TILE_M: f64 = 0.25;
/// Distance between the lines of the grid (m), which is rounded for robots of other sizes.
const SPACING_M: f64 = 0.1;
/// Number of lines to each side of the middle.
const LINES: i32 = 10;
/// Height of each layer on the floor above the layer below (m); the shadow is the first layer.
const LAYER_M: f64 = 0.0004;
/// Least opacity of a filling that is drawn. A fainter filling would only hide the shadow.
const LEAST_FILL: f64 = 0.2;

/// Unit vector towards the sun (world frame).
pub fn to_sun() -> Vector3<f64> {
    Vector3::new(0.35, 0.25, 1.0).normalize()
}

/// Distance between the lines of the grid (m).
pub fn spacing_m(scale: SizeRatio) -> f64 {
    round(SPACING_M * scale.length)
}

/// Distance from the middle to the edge of the grid (m).
pub fn grid_m(scale: SizeRatio) -> f64 {
    f64::from(LINES) * spacing_m(scale)
}

/// The 3D scene of the window.
pub struct Space<'a> {
    pub root: SceneNode3d,
    pub stage: Stage<'a>,
    on_card: OnCard,
    triangles: ColoredTriangles,
}

impl<'a> Space<'a> {
    pub fn new(stage: Stage<'a>) -> Self {
        let mut root = SceneNode3d::empty();
        Self {
            on_card: OnCard::new(&mut root),
            root,
            stage,
            triangles: ColoredTriangles::default(),
        }
    }

    /// Draws a moment as seen from `eye` (m, world frame).
    pub fn draw(
        &mut self,
        now: &Snapshot,
        kinematics: &Kinematics,
        has_body: bool,
        marks: &[SceneMark],
        eye: Vec3,
        window: &mut Window,
    ) {
        let (ground, layer_m) = (self.stage.ground(now), LAYER_M * self.stage.scale.length);
        self.triangles.clear();
        floor(&ground, self.stage.scale, &mut self.triangles);
        grid(&ground, self.stage.scale, window);
        self.robot(
            kinematics,
            now.rope,
            has_body,
            Point3::new(eye.x, eye.y, eye.z).cast(),
            &(ground.slope * Vector3::z()),
            layer_m,
        );
        for (i, SceneMark { overlay, drawing }) in marks.iter().enumerate() {
            if let Drawing::Polygon { corners, sheet } = drawing
                && sheet.fill >= LEAST_FILL
            {
                let color = colors::FLOOR
                    .towards(overlay.color(), sheet.fill as f32)
                    .linear();
                let lift = Vector3::z() * layer_m * (3 + i) as f64;
                let corners: Vec<_> = corners.iter().map(|at| (at + lift, color)).collect();
                self.triangles.polygon(&corners);
            }
        }
        self.on_card.show(&self.triangles);
    }

    /// Draws robot and pendulum if the body is switched on (`has_body`), and their shadow on the plane with the normal `up`. The
    /// shadow is drawn `above_m` above the plane, so that the floor does not hide it.
    fn robot(
        &mut self,
        kinematics: &Kinematics,
        rope: Option<[Point3<f64>; 2]>,
        has_body: bool,
        eye: Point3<f64>,
        up: &Vector3<f64>,
        above_m: f64,
    ) {
        let (sun, shadow) = (to_sun(), colors::SHADOW.linear());
        for (solid, pose) in self.stage.solids(kinematics, rope) {
            let [r, g, b, _] = solid.color;
            let color = colors::light([r, g, b]);
            let corners: Vec<_> = solid
                .mesh
                .corners
                .iter()
                .map(|(at, n)| (pose * at, pose * n))
                .collect();
            let lit = corners.iter().map(|(at, normal)| {
                let bright = brightness(normal, &(eye - at).normalize(), &sun);
                (vec3(at), color * bright as f32)
            });
            let lit: Vec<(Vec3, Rgb)> = lit.collect();
            for face in &solid.mesh.faces {
                // If thinning has collapsed a thin wall, its inner side lies on the outer one. So only triangles that
                // face the eye are drawn, as in replays.
                let [a, b, c] = face.map(|i| corners[i].0);
                if has_body && (b - a).cross(&(c - a)).dot(&(eye - a)) > 0.0 {
                    for &i in face {
                        self.triangles.corner(lit[i].0, lit[i].1);
                    }
                }
                // The lit side of a closed mesh casts its whole shadow.
                if face.iter().any(|&i| corners[i].1.dot(&sun) > 0.0) {
                    for &i in face {
                        let at = corners[i].0;
                        let thrown = at - sun * ((at.coords.dot(up) - above_m) / sun.dot(up));
                        self.triangles.corner(vec3(&thrown), shadow);
                    }
                }
            }
        }
    }
}

/// Brightness of a surface as a multiple of its colour: light from sky and floor, from the sun, and a little from the
/// viewer, so that no side looks flat.
pub fn brightness(normal: &Vector3<f64>, to_eye: &Vector3<f64>, to_sun: &Vector3<f64>) -> f64 {
    0.42 + 0.12 * normal.z + 0.50 * normal.dot(to_sun).max(0.0) + 0.16 * normal.dot(to_eye).max(0.0)
}

/// Draws the floor, which fades into the sky.
fn floor(ground: &Ground, scale: SizeRatio, out: &mut ColoredTriangles) {
    let [horizon_m, tile_m] = [HORIZON_M, TILE_M].map(|m| m * scale.length);
    let (near, far, wall) = (
        colors::FLOOR.linear(),
        colors::SKY.linear(),
        colors::GRID.linear(),
    );
    for face in faces(ground, horizon_m, tile_m) {
        let away_m = |corner: &Point3<f64>| corner.x.hypot(corner.y);
        if face.corners.iter().all(|corner| away_m(corner) > horizon_m) {
            continue;
        }
        out.polygon(&face.corners.map(|corner| {
            let share = ((away_m(&corner) / horizon_m - 0.25) / 0.65).clamp(0.0, 1.0) as f32;
            let color = if face.part == GroundPart::Wall {
                wall
            } else {
                near + share * (far - near)
            };
            (ground.slope * corner, color)
        }));
    }
}

/// Draws the lines of the grid.
fn grid(ground: &Ground, scale: SizeRatio, window: &mut Window) {
    let [low, high] = ground.patch;
    let (grid_m, spacing_m, above_m) = (
        grid_m(scale),
        spacing_m(scale),
        2.0 * LAYER_M * scale.length,
    );
    for i in -LINES..=LINES {
        let offset_m = f64::from(i) * spacing_m;
        for axis in 0..2 {
            let along = 1 - axis;
            // A patch that is higher or lower than the floor around it has no lines.
            let crosses = ground.step_m != 0.0 && (low[axis]..=high[axis]).contains(&offset_m);
            let pieces = match crosses {
                true => vec![(-grid_m, low[along]), (high[along], grid_m)],
                false => vec![(-grid_m, grid_m)],
            };
            for (from, to) in pieces {
                let end = |t: f64| {
                    let (x, y) = if axis == 0 {
                        (offset_m, t)
                    } else {
                        (t, offset_m)
                    };
                    vec3(&(ground.slope * Point3::new(x, y, ground.step_m + above_m)))
                };
                let color = if i == 0 {
                    colors::GRID.towards(colors::INK, 0.3)
                } else {
                    colors::GRID
                };
                window.draw_line(end(from), end(to), color.line(), 1.0, false);
            }
        }
    }
}
