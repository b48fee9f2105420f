//! The picture in three dimensions: floor, robot, and what is filled on the floor. What must not be hidden by the robot
//! is `marks`.

use super::colors;
use super::triangles::{OnCard, Rgb, Triangles, vec3};
use crate::episode::Snapshot;
use crate::render::scene::scale::{RobotScale, round};
use crate::render::scene::{Drawing, GroundPart, Mark, Stage, faces};
use crate::robot::Kinematics;
use crate::sim::Ground;
use kiss3d::glamx::Vec3;
use kiss3d::scene::SceneNode3d;
use kiss3d::window::Window;
use nalgebra::{Point3, Vector3};

// Lengths are those for a robot of UT-mu2's size.
/// The floor is drawn up to here, and fades into the sky (m).
const HORIZON_M: f64 = 4.0;
const TILE_M: f64 = 0.25;
/// Lines of the grid are so far apart (m), rounded for others,
const SPACING_M: f64 = 0.1;
/// and there are so many to each side.
const LINES: i32 = 10;
/// What lies on the floor is drawn so much above what lies under it (m): the shadow first.
const LAYER_M: f64 = 0.0004;
/// What covers less than this of the floor would hide the shadow: it is not filled here.
const LEAST_FILL: f64 = 0.2;

/// Towards the sun, world.
fn to_sun() -> Vector3<f64> {
    Vector3::new(0.35, 0.25, 1.0).normalize()
}

/// Between the lines of the grid (m).
pub fn spacing_m(scale: RobotScale) -> f64 {
    round(SPACING_M * scale.length())
}

/// How far the grid goes (m).
pub fn grid_m(scale: RobotScale) -> f64 {
    f64::from(LINES) * spacing_m(scale)
}

pub struct Space<'a> {
    pub root: SceneNode3d,
    pub stage: Stage<'a>,
    on_card: OnCard,
    triangles: Triangles,
}

impl<'a> Space<'a> {
    pub fn new(stage: Stage<'a>) -> Self {
        let mut root = SceneNode3d::empty();
        Self { on_card: OnCard::new(&mut root), root, stage, triangles: Triangles::default() }
    }

    /// Makes the picture of a moment, seen from `eye`.
    pub fn draw(&mut self, now: &Snapshot, kinematics: &Kinematics, marks: &[Mark], eye: Vec3, window: &mut Window) {
        let (ground, layer_m) = (self.stage.ground(now), LAYER_M * self.stage.scale.length());
        self.triangles.clear();
        floor(&ground, self.stage.scale, &mut self.triangles);
        grid(&ground, self.stage.scale, window);
        self.robot(kinematics, Point3::new(eye.x, eye.y, eye.z).cast(), &(ground.slope * Vector3::z()), layer_m);
        for (i, Mark { overlay, drawing }) in marks.iter().enumerate() {
            if let Drawing::Polygon { corners, sheet } = drawing
                && sheet.fill >= LEAST_FILL
            {
                let color = colors::FLOOR.towards(overlay.color(), sheet.fill as f32).linear();
                let lift = Vector3::z() * layer_m * (3 + i) as f64;
                let corners: Vec<_> = corners.iter().map(|at| (at + lift, color)).collect();
                self.triangles.polygon(&corners);
            }
        }
        self.on_card.show(&self.triangles);
    }

    /// The robot as it stands, and its shadow on the plane with this normal, or rather so much above it (m): it is not
    /// to be hidden by the floor.
    fn robot(&mut self, kinematics: &Kinematics, eye: Point3<f64>, up: &Vector3<f64>, above_m: f64) {
        let (sun, shadow) = (to_sun(), colors::SHADOW.linear());
        for (solid, pose) in self.stage.solids(kinematics) {
            let [r, g, b, _] = solid.color;
            let color = colors::light([r, g, b]);
            let corners: Vec<_> = solid.mesh.corners.iter().map(|(at, n)| (pose * at, pose * n)).collect();
            let lit = |(at, normal): &(Point3<f64>, Vector3<f64>)| {
                (vec3(at), color * brightness(normal, &(eye - at).normalize(), &sun) as f32)
            };
            let lit: Vec<(Vec3, Rgb)> = corners.iter().map(lit).collect();
            let thrown = |at: Point3<f64>| vec3(&(at - sun * ((at.coords.dot(up) - above_m) / sun.dot(up))));
            for face in &solid.mesh.faces {
                face.iter().for_each(|&i| self.triangles.corner(lit[i].0, lit[i].1));
                // One side of what is closed throws the whole shadow.
                if face.iter().any(|&i| corners[i].1.dot(&sun) > 0.0) {
                    face.iter().for_each(|&i| self.triangles.corner(thrown(corners[i].0), shadow));
                }
            }
        }
    }
}

/// How much of its colour a surface sends to the eye: the sky above and the floor below, the sun, and a little light
/// that comes with the viewer, so that no side is without shape.
fn brightness(normal: &Vector3<f64>, to_eye: &Vector3<f64>, to_sun: &Vector3<f64>) -> f64 {
    0.42 + 0.12 * normal.z + 0.50 * normal.dot(to_sun).max(0.0) + 0.16 * normal.dot(to_eye).max(0.0)
}

fn floor(ground: &Ground, scale: RobotScale, out: &mut Triangles) {
    let [horizon_m, tile_m] = [HORIZON_M, TILE_M].map(|m| m * scale.length());
    let (near, far, wall) = (colors::FLOOR.linear(), colors::SKY.linear(), colors::GRID.linear());
    for face in faces(ground, horizon_m, tile_m) {
        let away_m = |corner: &Point3<f64>| corner.x.hypot(corner.y);
        if face.corners.iter().all(|corner| away_m(corner) > horizon_m) {
            continue;
        }
        out.polygon(&face.corners.map(|corner| {
            let share = ((away_m(&corner) / horizon_m - 0.25) / 0.65).clamp(0.0, 1.0) as f32;
            let color = if face.part == GroundPart::Wall { wall } else { near + share * (far - near) };
            (ground.slope * corner, color)
        }));
    }
}

fn grid(ground: &Ground, scale: RobotScale, window: &mut Window) {
    let [low, high] = ground.patch;
    let (grid_m, spacing_m, above_m) = (grid_m(scale), spacing_m(scale), 2.0 * LAYER_M * scale.length());
    for i in -LINES..=LINES {
        let at = f64::from(i) * spacing_m;
        for axis in 0..2 {
            let along = 1 - axis;
            // Other than the floor around it, the patch is seen without lines.
            let crosses = ground.step_m != 0.0 && (low[axis]..=high[axis]).contains(&at);
            let pieces = match crosses {
                true => vec![(-grid_m, low[along]), (high[along], grid_m)],
                false => vec![(-grid_m, grid_m)],
            };
            for (from, to) in pieces {
                let end = |t: f64| {
                    let (x, y) = if axis == 0 { (at, t) } else { (t, at) };
                    vec3(&(ground.slope * Point3::new(x, y, ground.step_m + above_m)))
                };
                let color = if i == 0 { colors::GRID.towards(colors::INK, 0.3) } else { colors::GRID };
                window.draw_line(end(from), end(to), color.line(), 1.0, false);
            }
        }
    }
}
