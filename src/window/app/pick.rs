//! Pulls by mouse: finds the link under the mouse or near to it (by Parry's ray cast), and pulls it with a spring.

use super::camera::{Lens, Sight};
use kiss3d::egui::{Pos2, Vec2};
use kiss3d::glamx::Vec3;
use nalgebra::{Point3, Unit, Vector3};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::Triangle;
use standfast_core::robot::{Kinematics, Pose, SizeRatio};
use standfast_scene::mesh::DrawnMesh;
use standfast_scene::{Stage, Surface};
use standfast_sim::Pull;
use standfast_sim::episode::snapshot::Arrow;
use std::f32::consts::TAU;

/// Stiffness of the spring between hand and robot, for a robot of the size of UT-mu2 (N/m).
const STIFFNESS_N_M: f64 = 150.0;
/// Largest force of the spring for a robot of the size of UT-mu2 (N), about half of its weight.
const MOST_N: f64 = 40.0;
/// Length of the ray (m).
const REACH_M: f32 = 100.0;

/// A point of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index into `Robot::links`.
    pub link: usize,
    /// The point (m, world frame).
    pub at: Point3<f64>,
}

/// Radii of the circles about the mouse on which a link is searched if there is none under the mouse (points of egui),
/// since a thin arm is hard to hit; and the number of directions on each circle.
const CIRCLES: [f32; 4] = [5.0, 10.0, 15.0, 20.0];
const DIRECTIONS: usize = 16;

/// The link under the mouse, or else the link nearest to the mouse.
pub fn pick_near(stage: &Stage, kinematics: &Kinematics, lens: &Lens, mouse: Pos2) -> Option<Hit> {
    let hit = |at: Pos2| pick(stage, kinematics, &lens.sight(at));
    hit(mouse).or_else(|| {
        let mut places = CIRCLES.into_iter().flat_map(|radius| {
            let turns = (0..DIRECTIONS).map(|k| TAU * k as f32 / DIRECTIONS as f32);
            turns.map(move |turn| mouse + Vec2::angled(turn) * radius)
        });
        places.find_map(hit)
    })
}

/// The first solid that the ray meets.
fn pick(stage: &Stage, kinematics: &Kinematics, sight: &Sight) -> Option<Hit> {
    let distance_m = |(solid, pose): (&Surface, Pose)| {
        let (center, radius_m) = (pose * solid.ball.0 - sight.origin, solid.ball.1);
        let is_beside = center.cross(&sight.direction).norm() > radius_m;
        let distance_m = (!is_beside).then(|| distance_m(&solid.mesh, &pose, sight))??;
        Some((solid.link?, distance_m))
    };
    let (link, distance_m) = stage
        .solids(kinematics, None)
        .filter_map(distance_m)
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Hit {
        link,
        at: sight.origin + sight.direction.into_inner() * distance_m,
    })
}

/// Distance of a mesh along the ray (m). None if the ray misses it.
fn distance_m(mesh: &DrawnMesh, pose: &Pose, sight: &Sight) -> Option<f64> {
    let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    let origin = pose.inverse_transform_point(&sight.origin);
    let ray = Ray::new(
        single(origin.coords),
        single(pose.inverse_transform_vector(&sight.direction)),
    );
    let hits = mesh.faces.iter().filter_map(|face| {
        let [a, b, c] = face.map(|i| single(mesh.corners[i].0.coords));
        Triangle::new(a, b, c).cast_local_ray(&ray, REACH_M, true)
    });
    hits.min_by(f32::total_cmp).map(f64::from)
}

/// A pull on a point of a link by a hand. The hand moves with the mouse on the plane through the point where the pull
/// began, perpendicular to the direction of view.
#[derive(Debug, Clone, Copy)]
pub struct Grab {
    pub link: usize,
    /// The pulled point, in the frame of the link (m).
    point: Point3<f64>,
    plane_point: Point3<f64>,
    plane_normal: Unit<Vector3<f64>>,
    /// Offset from the mouse to the hand (m), so that a link that was only near to the mouse is not pulled at once.
    beside: Vector3<f64>,
    /// Position of the hand (m, world frame).
    pub hand: Point3<f64>,
    scale: SizeRatio,
}

impl Grab {
    /// Begins a pull on the point that was hit. `looking` is the direction of view, and `scale` the size of the robot.
    pub fn new(
        hit: Hit,
        sight: &Sight,
        kinematics: &Kinematics,
        looking: Unit<Vector3<f64>>,
        scale: SizeRatio,
    ) -> Self {
        let Hit { link, at } = hit;
        let point = kinematics.link_pose(link).inverse_transform_point(&at);
        let (plane_point, plane_normal) = (at, looking);
        let mut grab = Self {
            link,
            point,
            plane_point,
            plane_normal,
            beside: Vector3::zeros(),
            hand: at,
            scale,
        };
        grab.follow(sight);
        grab.beside = at - grab.hand;
        grab.hand = at;
        grab
    }

    /// Moves the hand to the ray of the mouse.
    pub fn follow(&mut self, sight: &Sight) {
        let towards = sight.direction.dot(&self.plane_normal);
        if towards > 1e-6 {
            let distance = (self.plane_point - sight.origin).dot(&self.plane_normal) / towards;
            self.hand = sight.origin + sight.direction.into_inner() * distance + self.beside;
        }
    }

    /// The force on the robot in its present posture.
    pub fn pull(&self, kinematics: &Kinematics) -> Pull {
        let spring =
            STIFFNESS_N_M * self.scale.force_per_length() * (self.hand - self.held(kinematics));
        let force = spring.cap_magnitude(MOST_N * self.scale.force());
        Pull {
            link: self.link,
            point: self.point,
            force,
        }
    }

    /// The force of the pull as an arrow.
    pub fn arrow(&self, kinematics: &Kinematics) -> Arrow {
        Arrow {
            point: self.held(kinematics),
            force: self.pull(kinematics).force,
        }
    }

    /// The pulled point (m, world frame).
    fn held(&self, kinematics: &Kinematics) -> Point3<f64> {
        kinematics.link_pose(self.link) * self.point
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::camera;
    use super::*;
    use crate::app::THRICE;
    use kiss3d::egui::{pos2, vec2};
    use standfast_core::robot::Robot;
    use standfast_sim::Ground;

    fn standing() -> (Robot, Kinematics) {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let kinematics = Kinematics::at_home(&robot);
        (robot, kinematics)
    }

    fn sight(origin: [f64; 3], direction: Vector3<f64>) -> Sight {
        Sight {
            origin: Point3::from(origin),
            direction: Unit::new_normalize(direction),
        }
    }

    #[test]
    fn the_nearest_link_is_picked() {
        let (robot, kinematics) = standing();
        let (com, stage) = (kinematics.com(), Stage::new(&robot, Ground::default()));
        let hit = pick(
            &stage,
            &kinematics,
            &sight([1.0, 0.0, com.z + 0.05], -Vector3::x()),
        )
        .unwrap();
        assert_eq!(hit.link, robot.trunk);
        assert!((-0.1..0.2).contains(&hit.at.x), "{hit:?}");
        // Seen from the left, the arm hides the trunk.
        let shoulder = sight(
            [0.0, 1.0, kinematics.link_pose(robot.trunk).translation.z],
            -Vector3::y(),
        );
        assert_ne!(
            pick(&stage, &kinematics, &shoulder).unwrap().link,
            robot.trunk
        );
        assert_eq!(
            pick(&stage, &kinematics, &sight([1.0, 0.0, 2.0], -Vector3::x())),
            None
        );
    }

    /// Beside the robot's edge, a link is picked from as far away as the circles reach, and pulled only when the mouse
    /// moves.
    #[test]
    fn a_link_near_the_mouse_is_pulled_without_a_jerk() {
        let (robot, kinematics) = standing();
        let (stage, scale) = (
            Stage::new(&robot, Ground::default()),
            standfast_scene::scale(&robot),
        );
        let lens = Lens::new(&camera(scale), vec2(860.0, 720.0));
        let row = lens
            .project(&(kinematics.com() + Vector3::z() * 0.05))
            .unwrap();
        let picked = |x: f32| pick_near(&stage, &kinematics, &lens, pos2(x, row.y));
        let exact = |x: f32| pick(&stage, &kinematics, &lens.sight(pos2(x, row.y)));
        let edge = (0..860)
            .map(|x| x as f32)
            .find(|x| exact(*x).is_some())
            .unwrap();
        assert_eq!(picked(edge), exact(edge));
        for px in [1.0, 8.0, 18.0] {
            assert_eq!(exact(edge - px), None);
            let hit = picked(edge - px).unwrap_or_else(|| panic!("nothing {px} px from the robot"));
            let sight = lens.sight(pos2(edge - px, row.y));
            let mut grab = Grab::new(hit, &sight, &kinematics, lens.looking(), scale);
            assert!(grab.pull(&kinematics).force.norm() < 1e-9);
            grab.follow(&sight);
            assert!(
                grab.pull(&kinematics).force.norm() < 1e-6,
                "{}",
                grab.pull(&kinematics).force
            );
            grab.follow(&lens.sight(pos2(edge - px - 50.0, row.y)));
            assert!(
                grab.pull(&kinematics).force.norm() > 3.0,
                "{}",
                grab.pull(&kinematics).force
            );
        }
        assert_eq!(picked(edge - 150.0), None);
    }

    #[test]
    fn the_hand_pulls_like_a_spring_up_to_its_limit() {
        let (robot, kinematics) = standing();
        let at = |y: f64| sight([1.0, y, kinematics.com().z + 0.05], -Vector3::x());
        let hit = pick(
            &Stage::new(&robot, Ground::default()),
            &kinematics,
            &at(0.0),
        )
        .unwrap();
        let forces = |scale: SizeRatio| {
            let mut grab = Grab::new(hit, &at(0.0), &kinematics, -Vector3::x_axis(), scale);
            [0.0, 0.1, 90.0].map(|y| {
                grab.follow(&at(y));
                grab.pull(&kinematics).force
            })
        };
        let scale = standfast_scene::scale(&robot);
        let is_near = |force: Vector3<f64>, y_n: f64| {
            (force - Vector3::new(0.0, y_n, 0.0)).norm() < 0.01 * y_n + 1e-9
        };
        let [none, some, most] = forces(scale);
        assert!(
            is_near(none, 0.0) && is_near(some, 15.0) && is_near(most, MOST_N),
            "{some} {most}"
        );
        // On a larger robot, the same share of its length gives the same share of its weight.
        let [_, some, most] = forces(THRICE);
        assert!(
            is_near(some, 9.0 * 15.0) && is_near(most, 27.0 * MOST_N),
            "{some} {most}"
        );
    }
}
