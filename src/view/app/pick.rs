//! A hand on the robot: which link is under the mouse (Parry's ray cast), and the spring by which it is dragged.

use crate::episode::snapshot::Arrow;
use crate::render::scene::mesh::Mesh;
use crate::render::scene::scale::RobotScale;
use crate::render::scene::{Stage, Surface};
use crate::robot::{Kinematics, Pose};
use crate::sim::Pull;
use kiss3d::glamx::Vec3;
use nalgebra::{Point3, Unit, Vector3};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::Triangle;

/// Of the spring between hand and robot (N/m), for a robot of UT-mu2's size.
const STIFFNESS_N_M: f64 = 150.0;
/// And no more than this (N): about half of its weight.
const MOST_N: f64 = 40.0;
/// Nothing is farther (m).
const REACH_M: f32 = 100.0;

/// From the eye through a point of the picture, world.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    pub origin: Point3<f64>,
    pub direction: Unit<Vector3<f64>>,
}

/// A point of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index into `Robot::links`.
    pub link: usize,
    /// Along the line of sight (m).
    pub distance_m: f64,
}

/// The first of the drawn solids that the line of sight meets.
pub fn pick(stage: &Stage, kinematics: &Kinematics, sight: &Sight) -> Option<Hit> {
    let hit = |(solid, pose): (&Surface, Pose)| {
        distance_m(&solid.mesh, &pose, sight).map(|distance_m| Hit { link: solid.link, distance_m })
    };
    stage.solids(kinematics).filter_map(hit).min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
}

/// Distance of a mesh along the line of sight (m); None beside it.
fn distance_m(mesh: &Mesh, pose: &Pose, sight: &Sight) -> Option<f64> {
    let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    let origin = pose.inverse_transform_point(&sight.origin);
    let ray = Ray::new(single(origin.coords), single(pose.inverse_transform_vector(&sight.direction)));
    let on_face = |face: &[usize; 3]| {
        let [a, b, c] = face.map(|i| single(mesh.corners[i].0.coords));
        Triangle::new(a, b, c).cast_local_ray(&ray, REACH_M, true)
    };
    mesh.faces.iter().filter_map(on_face).min_by(f32::total_cmp).map(f64::from)
}

/// A point of a link that is held, and where the hand is. The hand moves on the plane through the place where it took
/// hold, facing the viewer.
#[derive(Debug, Clone, Copy)]
pub struct Grab {
    pub link: usize,
    /// Where it holds, in the link's frame (m).
    point: Point3<f64>,
    plane_point: Point3<f64>,
    plane_normal: Unit<Vector3<f64>>,
    /// The hand, world.
    pub hand: Point3<f64>,
    /// Of the robot.
    scale: RobotScale,
}

impl Grab {
    /// Takes hold of what was hit on a robot of this size, `looking` along this direction.
    pub fn new(
        hit: Hit,
        sight: &Sight,
        kinematics: &Kinematics,
        looking: Unit<Vector3<f64>>,
        scale: RobotScale,
    ) -> Self {
        let at = sight.origin + sight.direction.into_inner() * hit.distance_m;
        let point = kinematics.link_pose(hit.link).inverse_transform_point(&at);
        Self { link: hit.link, point, plane_point: at, plane_normal: looking, hand: at, scale }
    }

    /// Follows the mouse.
    pub fn follow(&mut self, sight: &Sight) {
        let towards = sight.direction.dot(&self.plane_normal);
        if towards > 1e-6 {
            let distance = (self.plane_point - sight.origin).dot(&self.plane_normal) / towards;
            self.hand = sight.origin + sight.direction.into_inner() * distance;
        }
    }

    /// The force on the robot as it stands.
    pub fn pull(&self, kinematics: &Kinematics) -> Pull {
        let spring = STIFFNESS_N_M * self.scale.stiffness() * (self.hand - self.held(kinematics));
        let force = spring.cap_magnitude(MOST_N * self.scale.force());
        Pull { link: self.link, point: self.point, force }
    }

    /// The same, to draw.
    pub fn arrow(&self, kinematics: &Kinematics) -> Arrow {
        Arrow { point: self.held(kinematics), force: self.pull(kinematics).force }
    }

    /// Where it holds, world.
    fn held(&self, kinematics: &Kinematics) -> Point3<f64> {
        kinematics.link_pose(self.link) * self.point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scene::scale::tests::THRICE;
    use crate::robot::{Robot, Shape};
    use crate::sim::Ground;

    fn standing() -> (Robot, Kinematics) {
        let robot = Robot::load("ut-mu2").unwrap();
        let mut kinematics = Kinematics::new(&robot);
        kinematics.update(&robot, &robot.home_posture());
        (robot, kinematics)
    }

    fn sight(origin: [f64; 3], direction: Vector3<f64>) -> Sight {
        Sight { origin: Point3::from(origin), direction: Unit::new_normalize(direction) }
    }

    #[test]
    fn the_nearest_link_is_picked() {
        let (robot, kinematics) = standing();
        let (com, stage) = (kinematics.com(), Stage::new(&robot, Ground::default()));
        let hit = pick(&stage, &kinematics, &sight([1.0, 0.0, com.z + 0.05], -Vector3::x())).unwrap();
        assert_eq!(hit.link, robot.trunk);
        assert!((0.8..1.1).contains(&hit.distance_m), "{hit:?}");
        // From the left the arm hides the trunk.
        let shoulder = sight([0.0, 1.0, kinematics.link_pose(robot.trunk).translation.z], -Vector3::y());
        assert_ne!(pick(&stage, &kinematics, &shoulder).unwrap().link, robot.trunk);
        assert_eq!(pick(&stage, &kinematics, &sight([1.0, 0.0, 2.0], -Vector3::x())), None);
    }

    #[test]
    fn every_shape_is_met_at_its_surface() {
        let from_above = sight([0.0, 0.0, 1.0], -Vector3::z());
        let from_aside = sight([1.0, 0.0, 0.0], -Vector3::x());
        let pose = Pose::identity();
        let cylinder = Shape::Cylinder { radius: 0.1, length: 0.6 };
        for (shape, sight, expected) in [
            (cylinder, from_above, 0.7),
            (cylinder, from_aside, 0.9),
            (Shape::Sphere { radius: 0.2 }, from_above, 0.8),
            (Shape::Box { half: Vector3::new(0.1, 0.2, 0.3) }, from_aside, 0.9),
        ] {
            let distance_m = distance_m(&Mesh::of(&shape), &pose, &sight).unwrap();
            assert!((distance_m - expected).abs() < 1e-6, "{shape:?}: {distance_m}");
        }
    }

    #[test]
    fn the_hand_pulls_like_a_spring_up_to_its_limit() {
        let (robot, kinematics) = standing();
        let at = |y: f64| sight([1.0, y, kinematics.com().z + 0.05], -Vector3::x());
        let hit = pick(&Stage::new(&robot, Ground::default()), &kinematics, &at(0.0)).unwrap();
        let forces = |scale: RobotScale| {
            let mut grab = Grab::new(hit, &at(0.0), &kinematics, -Vector3::x_axis(), scale);
            [0.0, 0.1, 90.0].map(|y| {
                grab.follow(&at(y));
                grab.pull(&kinematics).force
            })
        };
        let scale = RobotScale::of(&robot);
        let is_near = |force: Vector3<f64>, y_n: f64| (force - Vector3::new(0.0, y_n, 0.0)).norm() < 0.01 * y_n + 1e-9;
        let [none, some, most] = forces(scale);
        assert!(is_near(none, 0.0) && is_near(some, 15.0) && is_near(most, MOST_N), "{some} {most}");
        // A larger robot gives way by the same share of its length to the same share of its weight.
        let [_, some, most] = forces(THRICE);
        assert!(is_near(some, 9.0 * 15.0) && is_near(most, 27.0 * MOST_N), "{some} {most}");
    }
}
