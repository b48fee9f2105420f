//! The camera of the window: its start, how it follows the robot, and the places of points in the picture.

use super::triangles::vec3;
use kiss3d::camera::{Camera3d, OrbitCamera3d};
use kiss3d::egui::{Pos2, Vec2, pos2};
use kiss3d::glamx::{Mat4, Vec3, Vec4};
use nalgebra::{Point3, Unit, Vector3};
use standfast_core::robot::SizeRatio;

/// The camera at the start, at the front left of the robot, which appears to the left of the panel.
pub fn camera(scale: SizeRatio) -> OrbitCamera3d {
    let length = scale.length as f32;
    let (eye, at) = (
        length * Vec3::new(0.80, 0.56, 0.68),
        length * Vec3::new(-0.07, 0.09, 0.19),
    );
    let field_rad = std::f32::consts::FRAC_PI_4;
    let mut camera =
        OrbitCamera3d::new_with_frustum(field_rad, 0.05 * length, 50.0 * length, eye, at);
    camera.set_up_axis(Vec3::Z);
    camera.look_at(eye, at);
    camera.set_min_dist(0.1 * length);
    camera.set_max_dist(8.0 * length);
    // The picture moves towards the viewer when the wheel turns towards the viewer.
    camera.set_dist_step(1.0 / 1.01);
    camera.rebind_reset_key(None);
    camera
}

/// Keeps the robot in the picture: the camera follows the robot, and the user's rotation, offset and zoom remain.
#[derive(Debug)]
pub struct Leash {
    /// Displacement by which the camera has followed the robot (m).
    gone: Vec3,
    /// Velocity of the camera (m/s).
    speed: Vec3,
    /// Distance of the COM from which on the camera follows (m).
    length_m: f32,
}

/// Distance by which the COM of a robot of the size of UT-mu2 can move before the camera follows (m), so that swaying
/// does not move the camera.
const LEASH_M: f32 = 0.05;
/// Largest value of this distance as a share of the camera's distance, for a user who looks at a foot from near.
const LEASH_SHARE: f32 = 0.1;
/// Time in which the camera catches up (s). It moves like a critically damped spring, so it starts and stops gently.
const CATCH_UP_S: f32 = 0.25;

impl Leash {
    /// A leash for a robot of this size.
    pub fn of(scale: SizeRatio) -> Self {
        Self {
            gone: Vec3::ZERO,
            speed: Vec3::ZERO,
            length_m: LEASH_M * scale.length as f32,
        }
    }

    /// Desired place of the camera for a COM, as an offset from its start (m).
    fn wanted(&self, camera: &OrbitCamera3d, com: &Point3<f64>) -> Vec3 {
        let away = Vec3::new(com.x as f32, com.y as f32, 0.0) - self.gone;
        let slack = self.length_m.min(LEASH_SHARE * camera.dist());
        self.gone + away * (1.0 - slack / away.length().max(slack))
    }

    /// Moves the camera after the COM, for the time that has passed (s).
    pub fn pull(&mut self, camera: &mut OrbitCamera3d, com: &Point3<f64>, passed_s: f64) {
        let (rate, passed_s) = (2.0 / CATCH_UP_S, passed_s as f32);
        let behind = self.gone - self.wanted(camera, com);
        let decay = (-rate * passed_s).exp();
        let drift = (self.speed + rate * behind) * passed_s;
        let step = (behind + drift) * decay - behind;
        if step.is_finite() {
            self.speed = (self.speed - rate * drift) * decay;
            self.go(camera, step);
        }
    }

    /// Moves the camera at once, for a robot that is suddenly at another place.
    pub fn jump(&mut self, camera: &mut OrbitCamera3d, com: &Point3<f64>) {
        self.speed = Vec3::ZERO;
        let step = self.wanted(camera, com) - self.gone;
        if step.is_finite() {
            self.go(camera, step);
        }
    }

    fn go(&mut self, camera: &mut OrbitCamera3d, step: Vec3) {
        if step.length() > 1e-6 {
            self.gone += step;
            camera.set_at(camera.at() + step);
        }
    }
}

/// The ray from the eye through a point of the picture (world frame).
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    pub origin: Point3<f64>,
    pub direction: Unit<Vector3<f64>>,
}

/// The projection from the world to the picture (points of egui), and back.
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
        Self {
            to_clip: camera.transformation(),
            from_clip: camera.inverse_transformation(),
            eye,
            size,
        }
    }

    /// Place of a point in the picture. None if it is behind the viewer.
    pub fn project(&self, at: &Point3<f64>) -> Option<Pos2> {
        let clip = self.to_clip * vec3(at).extend(1.0);
        (clip.w > 1e-3).then(|| {
            pos2(
                (1.0 + clip.x / clip.w) * self.size.x / 2.0,
                (1.0 - clip.y / clip.w) * self.size.y / 2.0,
            )
        })
    }

    /// The ray through a place in the picture.
    pub fn sight(&self, at: Pos2) -> Sight {
        let (x, y) = (
            2.0 * at.x / self.size.x - 1.0,
            1.0 - 2.0 * at.y / self.size.y,
        );
        let far = self.from_clip * Vec4::new(x, y, 0.9, 1.0);
        let far =
            Point3::new(f64::from(far.x), f64::from(far.y), f64::from(far.z)) / f64::from(far.w);
        Sight {
            origin: self.eye,
            direction: Unit::new_normalize(far - self.eye),
        }
    }

    /// Direction of the ray through the middle of the picture.
    pub fn looking(&self) -> Unit<Vector3<f64>> {
        self.sight((self.size / 2.0).to_pos2()).direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::THRICE;

    use kiss3d::egui::vec2;

    /// Camera and leash for UT-mu2.
    fn leashed() -> (OrbitCamera3d, Leash) {
        let scale = standfast_scene::scale(&standfast_robots::load("ut-mu2").unwrap());
        (camera(scale), Leash::of(scale))
    }

    #[test]
    fn the_camera_follows_a_robot_that_moves_away_and_back() {
        let (mut camera, mut leash) = leashed();
        let start = camera.at();
        let mut look = |com: Point3<f64>| {
            for _ in 0..100 {
                leash.pull(&mut camera, &com, 0.1);
            }
            camera.at() - start
        };
        assert_eq!(look(Point3::new(0.02, -0.04, 0.3)), Vec3::ZERO);
        let gone = look(Point3::new(-1.0, 0.0, 0.1));
        assert!(
            (gone - Vec3::new(-0.95, 0.0, 0.0)).length() < 2e-3,
            "{gone}"
        );
        assert!(look(Point3::new(f64::NAN, 0.0, 0.0)) == gone);
        assert!(look(Point3::new(0.0, 0.0, 0.3)).length() < 0.051);
    }

    /// The robot suddenly moves at 1 m/s, and stops. It must stay in the picture, and the speed of the camera must not
    /// jump.
    #[test]
    fn the_camera_neither_loses_the_robot_nor_jumps() {
        const FRAME_S: f64 = 1.0 / 60.0;
        let (mut camera, mut leash) = leashed();
        let (mut last, mut fastest) = (Vec3::ZERO, 0.0_f32);
        for k in 0..120 {
            let com = Point3::new(FRAME_S * f64::from(k.min(60)), 0.0, 0.3);
            let before = camera.at();
            leash.pull(&mut camera, &com, FRAME_S);
            let speed = (camera.at() - before) / FRAME_S as f32;
            assert!(
                (speed - last).length() < 0.3,
                "frame {k}: from {last} to {speed} m/s"
            );
            (last, fastest) = (speed, fastest.max(speed.length()));
            let seen = Lens::new(&camera, vec2(860.0, 720.0))
                .project(&com)
                .unwrap();
            assert!(
                (100.0..760.0).contains(&seen.x) && (100.0..620.0).contains(&seen.y),
                "frame {k}: {seen}"
            );
        }
        assert!(fastest > 0.7, "it went at {fastest} m/s at most");
    }

    #[test]
    fn rotation_and_zoom_by_the_user_remain() {
        let (mut camera, mut leash) = leashed();
        camera.set_yaw(camera.yaw() + 0.7);
        camera.set_dist(0.4);
        let com = Point3::new(0.5, 0.2, 0.3);
        let seen = |camera: &OrbitCamera3d, com: Point3<f64>| {
            Lens::new(camera, vec2(860.0, 720.0)).project(&com).unwrap()
        };
        let before = seen(&camera, Point3::new(0.0, 0.0, 0.3));
        leash.jump(&mut camera, &com);
        let after = seen(&camera, com);
        // The place of the robot in the picture may differ by the length of the leash.
        assert!(before.distance(after) < 120.0, "{before} {after}");
        assert!((camera.dist() - 0.4).abs() < 1e-6);
    }

    #[test]
    fn the_ray_of_a_place_goes_through_the_point_that_is_seen_there() {
        let camera = camera(standfast_scene::scale(
            &standfast_robots::load("ut-mu2").unwrap(),
        ));
        let lens = Lens::new(&camera, vec2(800.0, 600.0));
        for place in [Point3::new(0.0, 0.0, 0.3), Point3::new(0.2, -0.4, 0.0)] {
            let sight = lens.sight(lens.project(&place).unwrap());
            let beside = (place - sight.origin).cross(&sight.direction).norm();
            assert!(beside < 1e-4, "{place}: beside by {beside} m");
        }
        let behind = lens.eye - lens.looking().into_inner();
        assert_eq!(lens.project(&behind), None);
        // Points higher in the world are higher in the picture.
        let [low, high] = [0.0, 0.4].map(|z| lens.project(&Point3::new(0.0, 0.0, z)).unwrap().y);
        assert!(high < low - 50.0, "{high} {low}");
    }

    #[test]
    fn robots_of_any_size_appear_equally_large() {
        let at = |scale: SizeRatio, m: f64| {
            let lens = Lens::new(&camera(scale), vec2(800.0, 600.0));
            lens.project(&(Point3::new(0.05, 0.1, 0.31) * m)).unwrap()
        };
        let ut_mu2 = standfast_scene::scale(&standfast_robots::load("ut-mu2").unwrap());
        let (one, three) = (at(ut_mu2, 1.0), at(THRICE, 3.0));
        assert!(one.distance(three) < 1.0, "{one} {three}");
    }
}
