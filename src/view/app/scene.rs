//! The picture in three dimensions: floor, robot, and what is filled on the floor. Lines and points are `marks`.

use super::colors;
use super::mesh::{Mesh, Triangles, vec3};
use super::overlays::Shown;
use super::solids::Surfaces;
use crate::episode::Snapshot;
use crate::render::palette::Overlay;
use crate::render::scale::{Scale, round};
use crate::robot::{Kinematics, Robot};
use crate::sim::Ground;
use kiss3d::camera::OrbitCamera3d;
use kiss3d::glamx::Vec3;
use kiss3d::scene::SceneNode3d;
use kiss3d::window::Window;
use nalgebra::{Point2, Point3, Vector3};

// Lengths are those for a robot of UT-mu2's size.
/// The floor is drawn up to here, and fades into the sky (m).
const HORIZON_M: f64 = 4.0;
const TILE_M: f64 = 0.25;
/// Lines of the grid are so far apart (m), rounded for others,
const SPACING_M: f64 = 0.1;
/// and there are so many to each side.
const LINES: i32 = 10;
/// What lies on the floor is drawn so much above what lies under it (m).
const LAYER_M: f64 = 0.0006;
/// And so much the shadow.
const SHADOW_M: f64 = 0.0004;

/// Between the lines of the grid (m).
pub fn spacing_m(scale: Scale) -> f64 {
    round(SPACING_M * scale.length())
}

/// How far the grid goes (m).
pub fn grid_m(scale: Scale) -> f64 {
    f64::from(LINES) * spacing_m(scale)
}

pub struct Scene {
    pub root: SceneNode3d,
    mesh: Mesh,
    triangles: Triangles,
    surfaces: Surfaces,
    ground: Ground,
    scale: Scale,
}

impl Scene {
    /// A robot of this size on its ground, as that lies in the end.
    pub fn new(robot: &Robot, ground: Ground, scale: Scale) -> Self {
        let mut root = SceneNode3d::empty();
        let mesh = Mesh::new(&mut root);
        Self { mesh, root, triangles: Triangles::default(), surfaces: Surfaces::new(robot), ground, scale }
    }

    /// The ground as it lies in a moment.
    pub fn ground(&self, now: &Snapshot) -> Ground {
        Ground { slope: now.slope, ..self.ground }
    }

    /// Makes the picture of a moment, seen from `eye`.
    pub fn draw(&mut self, now: &Snapshot, kinematics: &Kinematics, shown: &Shown, eye: Vec3, window: &mut Window) {
        let ground = self.ground(now);
        self.triangles.clear();
        let layer_m = LAYER_M * self.scale.length();
        floor(&ground, self.scale, &mut self.triangles);
        grid(&ground, self.scale, window);
        self.surfaces.draw(kinematics, eye, (&now.slope, SHADOW_M * self.scale.length()), &mut self.triangles);
        let lit = now.gain.and_then(|gain| now.slices.get(gain)).filter(|_| shown.has(Overlay::Slices));
        let lift = |corner: &Point2<f64>| Point3::new(corner.x, corner.y, ground.height_m(*corner) + 3.0 * layer_m);
        let lit: Vec<_> = lit.iter().flat_map(|slice| slice.iter().map(lift)).collect();
        self.triangles.polygon(&lit, colors::SLICE.towards(colors::FLOOR, 0.5).linear());
        if let Some(corners) = now.footstep.filter(|_| shown.has(Overlay::Footstep)) {
            let raised = corners.map(|corner| corner + Vector3::z() * 4.0 * layer_m);
            self.triangles.polygon(&raised, colors::FOOTSTEP.towards(colors::FLOOR, 0.55).linear());
        }
        self.mesh.show(&self.triangles);
    }
}

/// The camera as it is at the start: from the front left of the robot, which stands left of the panel.
pub fn camera(scale: Scale) -> OrbitCamera3d {
    let length = scale.length() as f32;
    let (eye, at) = (length * Vec3::new(0.80, 0.56, 0.68), length * Vec3::new(-0.07, 0.09, 0.19));
    let field_rad = std::f32::consts::FRAC_PI_4;
    let mut camera = OrbitCamera3d::new_with_frustum(field_rad, 0.05 * length, 50.0 * length, eye, at);
    camera.set_up_axis(Vec3::Z);
    camera.look_at(eye, at);
    camera.set_min_dist(0.1 * length);
    camera.set_max_dist(8.0 * length);
    // Towards the viewer when the wheel turns towards him.
    camera.set_dist_step(1.0 / 1.01);
    camera.rebind_reset_key(None);
    camera
}

/// Keeps the robot in the picture: how far (m) the camera has gone with it.
#[derive(Debug)]
pub struct Leash {
    gone: Vec3,
    length_m: f32,
}

/// The COM of a robot of UT-mu2's size may go so far (m) before the camera goes too,
const LEASH_M: f32 = 0.15;
/// which takes about so long (s).
const GENTLY_S: f64 = 0.4;

impl Leash {
    pub fn of(scale: Scale) -> Self {
        Self { gone: Vec3::ZERO, length_m: LEASH_M * scale.length() as f32 }
    }

    /// Lets the camera go with the COM, when so much time has passed (s).
    pub fn pull(&mut self, camera: &mut OrbitCamera3d, com: &Point3<f64>, passed_s: f64) {
        let away = Vec3::new(com.x as f32, com.y as f32, 0.0);
        let wanted = away * (1.0 - self.length_m / away.length().max(self.length_m));
        let step = (wanted - self.gone) * (1.0 - (-passed_s / GENTLY_S).exp()) as f32;
        if step.is_finite() && step.length() > 1e-5 {
            self.gone += step;
            camera.set_at(camera.at() + step);
        }
    }
}

/// A point of the plane, as it lies in the world.
fn on(ground: &Ground, x: f64, y: f64, z: f64) -> Point3<f64> {
    ground.slope * Point3::new(x, y, z)
}

fn floor(ground: &Ground, scale: Scale, out: &mut Triangles) {
    let [low, high] = ground.patch;
    let [horizon_m, tile_m] = [HORIZON_M, TILE_M].map(|m| m * scale.length());
    let is_flat = ground.step_m == 0.0;
    // Lines between tiles, those around a patch that lies higher or lower too.
    let lines = |edges: [f64; 2]| {
        let count = (2.0 * HORIZON_M / TILE_M) as i32;
        let mut lines: Vec<f64> = (0..=count).map(|i| f64::from(i) * tile_m - horizon_m).collect();
        lines.extend(edges.iter().filter(|_| !is_flat));
        lines.sort_by(f64::total_cmp);
        lines
    };
    let (xs, ys) = (lines([low.x, high.x]), lines([low.y, high.y]));
    let (near, far) = (colors::FLOOR.linear(), colors::SKY.linear());
    let fading = |x: f64, y: f64| {
        let share = ((x.hypot(y) / horizon_m - 0.25) / 0.65).clamp(0.0, 1.0) as f32;
        near + share * (far - near)
    };
    for x in xs.windows(2) {
        for y in ys.windows(2) {
            if x[0].hypot(y[0]).min(x[1].hypot(y[1])) > horizon_m {
                continue;
            }
            let middle = nalgebra::center(&Point2::new(x[0], y[0]), &Point2::new(x[1], y[1]));
            let inside = (0..2).all(|i| (low[i]..=high[i]).contains(&middle[i]));
            let z = if inside { 0.0 } else { ground.step_m };
            for (i, j) in [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)] {
                out.corner(vec3(&on(ground, x[i], y[j], z)), fading(x[i], y[j]));
            }
        }
    }
    if !is_flat {
        let corners = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
        for i in 0..4 {
            let ((ax, ay), (bx, by)) = (corners[i], corners[(i + 1) % 4]);
            let wall = [(ax, ay, 0.0), (bx, by, 0.0), (bx, by, ground.step_m), (ax, ay, ground.step_m)];
            out.polygon(&wall.map(|(x, y, z)| on(ground, x, y, z)), colors::GRID.linear());
        }
    }
}

fn grid(ground: &Ground, scale: Scale, window: &mut Window) {
    let [low, high] = ground.patch;
    let (grid_m, spacing_m, above_m) = (grid_m(scale), spacing_m(scale), 1.5 * LAYER_M * scale.length());
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
                    vec3(&on(ground, x, y, ground.step_m + above_m))
                };
                let color = if i == 0 { colors::GRID.towards(colors::INK, 0.3) } else { colors::GRID };
                window.draw_line(end(from), end(to), color.line(), 1.0, false);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_goes_with_a_robot_that_goes_away_and_comes_back() {
        let scale = Scale::of(&Robot::load("ut-mu2").unwrap());
        let (mut camera, mut leash) = (camera(scale), Leash::of(scale));
        let start = camera.at();
        let mut look = |com: Point3<f64>| {
            (0..100).for_each(|_| leash.pull(&mut camera, &com, 0.1));
            camera.at() - start
        };
        assert_eq!(look(Point3::new(0.05, -0.1, 0.3)), Vec3::ZERO);
        let gone = look(Point3::new(-1.0, 0.0, 0.1));
        assert!((gone - Vec3::new(-0.85, 0.0, 0.0)).length() < 1e-3, "{gone}");
        assert!(look(Point3::new(f64::NAN, 0.0, 0.0)) == gone);
        assert!(look(Point3::new(0.0, 0.0, 0.3)).length() < 1e-3);
    }
}
