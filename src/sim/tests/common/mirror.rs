//! The mirrored robot.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Unit, UnitQuaternion, Vector3};
use standfast_core::robot::{Robot, Sole};

/// A vector mirrored in the plane y = 0.
pub fn mirrored(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, v.z)
}

/// A pose mirrored in the plane y = 0.
fn mirrored_pose(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let r = pose.rotation;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(r.w, -r.i, r.j, -r.k));
    Isometry3::from_parts(mirrored(&pose.translation.vector).into(), rotation)
}

/// An axis of rotation mirrored in the plane y = 0, such that the same angle about it is the mirrored rotation.
fn mirrored_axis(axis: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    Unit::new_normalize(-mirrored(axis))
}

/// UT-mu2 made symmetric: its right half is the mirror image of its left one, and its trunk is mirror-symmetric.
pub fn symmetric_robot() -> Robot {
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    let trunk = &mut robot.links[0];
    trunk.com_m.y = 0.0;
    trunk.inertia_kg_m2 = 0.5 * (trunk.inertia_kg_m2 + mirror * trunk.inertia_kg_m2 * mirror);
    for right in 1..robot.links.len() {
        let Some(side) = robot.links[right].name.strip_prefix("right_") else {
            continue;
        };
        let name = format!("left_{side}");
        let left = robot
            .links
            .iter()
            .position(|link| link.name == name)
            .expect("legs and arms come in pairs");
        let model = robot.links[left].clone();
        let link = &mut robot.links[right];
        link.mass_kg = model.mass_kg;
        link.com_m = Point3::from(mirrored(&model.com_m.coords));
        link.inertia_kg_m2 = mirror * model.inertia_kg_m2 * mirror;
        for (solid, model) in link.collisions.iter_mut().zip(&model.collisions) {
            (solid.pose, solid.shape) = (mirrored_pose(&model.pose), model.shape.clone());
        }
        let model = robot.joints[left - 1].clone();
        let joint = &mut robot.joints[right - 1];
        joint.origin = mirrored_pose(&model.origin);
        assert!(
            (*joint.axis - *mirrored_axis(&model.axis)).norm() < 1e-6,
            "{} turns the other way",
            joint.name
        );
        joint.axis = mirrored_axis(&model.axis);
        (joint.lower_rad, joint.upper_rad) = (model.lower_rad, model.upper_rad);
        assert_eq!(robot.home_rad[right - 1], robot.home_rad[left - 1]);
    }
    let left = robot.soles.left;
    robot.soles.right = Sole {
        center: mirrored_pose(&left.center),
        half_m: left.half_m,
        ..robot.soles.right
    };
    robot
}
