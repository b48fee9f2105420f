//! Where the person looks from: the camera, how it goes with the robot, and what is seen where.

use super::pick::Sight;
use super::triangles::vec3;
use crate::render::scene::scale::RobotScale;
use kiss3d::camera::{Camera3d, OrbitCamera3d};
use kiss3d::egui::{Pos2, Vec2, pos2};
use kiss3d::glamx::{Mat4, Vec3, Vec4};
use nalgebra::{Point3, Unit, Vector3};

/// The camera as it is at the start: from the front left of the robot, which stands left of the panel.
pub fn camera(scale: RobotScale) -> OrbitCamera3d {
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
    pub fn of(scale: RobotScale) -> Self {
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

/// From the world to the picture (points of egui), and back.
pub struct Lens {
    to_clip: Mat4,
    from_clip: Mat4,
    eye: Point3<f64>,
    size: Vec2,
}

impl Lens {
    pub fn new(camera: &impl Camera3d, size: Vec2) -> Self {
        let eye = camera.eye();
        let eye = Point3::new(f64::from(eye.x), f64::from(eye.y), f64::from(eye.z));
        Self { to_clip: camera.transformation(), from_clip: camera.inverse_transformation(), eye, size }
    }

    /// None behind the viewer.
    pub fn project(&self, at: &Point3<f64>) -> Option<Pos2> {
        let clip = self.to_clip * vec3(at).extend(1.0);
        (clip.w > 1e-3)
            .then(|| pos2((1.0 + clip.x / clip.w) * self.size.x / 2.0, (1.0 - clip.y / clip.w) * self.size.y / 2.0))
    }

    /// From the eye through a point of the picture.
    pub fn sight(&self, at: Pos2) -> Sight {
        let (x, y) = (2.0 * at.x / self.size.x - 1.0, 1.0 - 2.0 * at.y / self.size.y);
        let far = self.from_clip * Vec4::new(x, y, 0.9, 1.0);
        let far = Point3::new(f64::from(far.x), f64::from(far.y), f64::from(far.z)) / f64::from(far.w);
        Sight { origin: self.eye, direction: Unit::new_normalize(far - self.eye) }
    }

    /// Where the middle of the picture looks.
    pub fn looking(&self) -> Unit<Vector3<f64>> {
        self.sight((self.size / 2.0).to_pos2()).direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scene::scale::tests::THRICE;
    use crate::robot::Robot;
    use kiss3d::egui::vec2;

    #[test]
    fn the_camera_goes_with_a_robot_that_goes_away_and_comes_back() {
        let scale = RobotScale::of(&Robot::load("ut-mu2").unwrap());
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

    #[test]
    fn a_line_of_sight_goes_through_what_is_seen_there() {
        let camera = camera(RobotScale::of(&Robot::load("ut-mu2").unwrap()));
        let lens = Lens::new(&camera, vec2(800.0, 600.0));
        for place in [Point3::new(0.0, 0.0, 0.3), Point3::new(0.2, -0.4, 0.0)] {
            let sight = lens.sight(lens.project(&place).unwrap());
            let beside = (place - sight.origin).cross(&sight.direction).norm();
            assert!(beside < 1e-4, "{place}: beside by {beside} m");
        }
        let behind = lens.eye - lens.looking().into_inner();
        assert_eq!(lens.project(&behind), None);
        // Up is up.
        let [low, high] = [0.0, 0.4].map(|z| lens.project(&Point3::new(0.0, 0.0, z)).unwrap().y);
        assert!(high < low - 50.0, "{high} {low}");
    }

    #[test]
    fn a_robot_of_another_size_is_seen_as_large() {
        let at = |scale: RobotScale, m: f64| {
            let lens = Lens::new(&camera(scale), vec2(800.0, 600.0));
            lens.project(&(Point3::new(0.05, 0.1, 0.31) * m)).unwrap()
        };
        let ut_mu2 = RobotScale::of(&Robot::load("ut-mu2").unwrap());
        let (one, three) = (at(ut_mu2, 1.0), at(THRICE, 3.0));
        assert!(one.distance(three) < 1.0, "{one} {three}");
    }
}
