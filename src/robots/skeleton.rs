//! Bones for a robot whose URDF has no shapes, or whose meshes are missing: capsules from joint to joint, and from the
//! last joint of a limb to the COM of its link. They are drawn, and do not collide.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use standfast_core::robot::{Link, Robot, Shape, Solid};
use std::f64::consts::PI;

/// Density of a body, about that of water (kg/m^3). The thickness of a bone follows from its share of the link's mass,
/// within these shares of its length.
const DENSITY_KG_M3: f64 = 1000.0;
const THICKNESS: [f64; 2] = [0.05, 0.3];
/// Grey, opaque.
const COLOR: [f64; 4] = [0.62, 0.64, 0.67, 1.0];
/// Least length of a bone that is drawn, as a share of the height of the COM at home.
const SHORT: f64 = 0.02;

/// The robot with bones for the links that have nothing to draw, if these are at least half of all, and with a note of it.
pub fn with_bones(mut robot: Robot) -> Robot {
    let bare = robot
        .links
        .iter()
        .filter(|link| link.drawn().is_empty())
        .count();
    if 2 * bare < robot.links.len() {
        return robot;
    }
    let shortest_m = SHORT * robot.home_com_height();
    for i in (0..robot.links.len())
        .filter(|&i| robot.links[i].drawn().is_empty())
        .collect::<Vec<_>>()
    {
        let joints = robot.joints.iter().filter(|joint| joint.parent == i);
        let mut ends: Vec<Point3<f64>> = joints
            .map(|joint| joint.origin.translation.vector.into())
            .collect();
        let link = &robot.links[i];
        if ends.is_empty() {
            ends.push(link.com_m);
        }
        ends.retain(|end| end.coords.norm() > shortest_m);
        let bones = ends
            .iter()
            .map(|end| bone(link, i, *end, ends.len()))
            .collect();
        robot.links[i].visuals = bones;
    }
    robot.notes.push(format!(
        "{bare} of its {} links have no shape that could be read; they are drawn as bones from joint to joint",
        robot.links.len()
    ));
    robot
}

/// The bone from the origin of a link to `end`, which is one of `count` bones of the link.
fn bone(link: &Link, frame: usize, end: Point3<f64>, count: usize) -> Solid {
    let length = end.coords.norm();
    let area_m2 = link.mass_kg / count as f64 / (DENSITY_KG_M3 * length);
    let radius = (area_m2 / PI)
        .sqrt()
        .clamp(THICKNESS[0] * length, THICKNESS[1] * length);
    let along = UnitQuaternion::rotation_between(&Vector3::z(), &end.coords)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
    let pose = Isometry3::from_parts(Translation3::from(end.coords / 2.0), along);
    Solid {
        frame,
        pose,
        shape: Shape::Capsule { radius, length },
        color: COLOR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_without_shapes_is_drawn_from_joint_to_joint_and_any_other_is_left_alone() {
        let robot = crate::load("ut-mu2").unwrap();
        let whole = with_bones(robot.clone());
        assert!(
            whole.notes == robot.notes
                && whole
                    .links
                    .iter()
                    .zip(&robot.links)
                    .all(|(a, b)| a.visuals.len() == b.visuals.len())
        );
        let mut bare = robot.clone();
        for link in &mut bare.links {
            (link.visuals, link.collisions) = (Vec::new(), Vec::new());
        }
        let drawn = with_bones(bare);
        assert!(
            drawn.notes.last().unwrap().contains("drawn as bones"),
            "{:?}",
            drawn.notes
        );
        for joint in drawn
            .joints
            .iter()
            .filter(|joint| joint.origin.translation.vector.norm() > 0.01)
        {
            let has_bone = drawn.links[joint.parent].visuals.iter().any(|bone| {
                let Shape::Capsule { length, .. } = bone.shape else {
                    panic!("{bone:?}")
                };
                let end = bone.pose * Point3::new(0.0, 0.0, length / 2.0);
                (end.coords - joint.origin.translation.vector).norm() < 1e-12
            });
            assert!(has_bone, "{}", joint.name);
        }
        assert!(
            drawn.links.iter().all(|link| link.collisions.is_empty()),
            "bones do not collide"
        );
    }
}
