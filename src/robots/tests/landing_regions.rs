//! The landing regions of UT-mu2: its legs reach all of them without touching, in the time that its settings state.

use nalgebra::Vector3;
use rapier3d::parry::math::{Pose as ParryPose, Vector};
use rapier3d::parry::query::distance;
use rapier3d::parry::shape::Cuboid;
use standfast_core::robot::swing_time::{SwingMotion, least_swing_time_s};
use standfast_core::robot::{Around, Foot, Kinematics, LandingRegion, Robot, Shape};

/// Least distance that the collision boxes of the legs keep from each other (m).
const GAP_M: f64 = 0.005;
/// Least distance between the legs for a foot that lands in front of the stance leg (m). This region begins as close to
/// the leg as it can, because only near places help against a push from the side.
const GAP_IN_FRONT_M: f64 = 0.002;

fn region<'a>(robot: &'a Robot, name: &str) -> &'a LandingRegion {
    robot
        .reach
        .iter()
        .find(|region| region.name == name)
        .unwrap()
}

fn vector(v: Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

/// The collision boxes of a leg.
fn boxes(robot: &Robot, kinematics: &Kinematics, foot: Foot) -> Vec<(ParryPose, Cuboid)> {
    let links = robot.chain(robot.soles[foot].link).map(|joint| joint + 1);
    let solids = links.flat_map(|link| {
        robot.links[link]
            .collisions
            .iter()
            .map(move |solid| (link, solid))
    });
    let shapes = solids.map(|(link, solid)| {
        let Shape::Box { half } = solid.shape else {
            panic!("UT-mu2 is made of boxes")
        };
        let pose = kinematics.link_pose(link) * solid.pose;
        let place = ParryPose::new(
            vector(pose.translation.vector),
            vector(pose.rotation.scaled_axis()),
        );
        (place, Cuboid::new(vector(half)))
    });
    shapes.collect()
}

/// Distance between the legs (m).
fn gap_m(robot: &Robot, kinematics: &Kinematics) -> f64 {
    let [left, right] = Foot::BOTH.map(|foot| boxes(robot, kinematics, foot));
    let mut least = f64::INFINITY;
    for (at_a, a) in &left {
        for (at_b, b) in &right {
            least = least.min(distance(at_a, a, at_b, b).unwrap().distance as f64);
        }
    }
    least
}

/// Least distance between the legs on the way to a place (m). It is None if the place is out of reach.
fn least_gap_m(robot: &Robot, foot: Foot, to: [f64; 2], around: Around) -> Option<f64> {
    let mut swing = SwingMotion::new(robot, foot, to, around)?;
    let mut kinematics = Kinematics::new(robot);
    let mut least = f64::INFINITY;
    for i in 0..=40 {
        kinematics.update(robot, swing.posture(f64::from(i) / 40.0)?);
        least = least.min(gap_m(robot, &kinematics));
    }
    Some(least)
}

#[test]
fn the_legs_reach_all_of_each_region_without_touching() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    for region in &robot.reach {
        let least_m = if region.name == "in front" {
            GAP_IN_FRONT_M
        } else {
            GAP_M
        };
        let at = |[from, to]: [f64; 2], i: u32| from + (to - from) * f64::from(i) / 4.0;
        for (i, k) in (0..=4).flat_map(|i| (0..=4).map(move |k| (i, k))) {
            let to = [at(region.x_m, i), at(region.y_m, k)];
            for foot in Foot::BOTH {
                let gap_m = least_gap_m(&robot, foot, to, region.around());
                assert!(
                    gap_m.is_some_and(|gap_m| gap_m > least_m),
                    "{}, {foot:?} to {to:?}: {gap_m:?}",
                    region.name
                );
            }
        }
    }
}

/// If crossing feet went straight or landed beside the stance sole, they would touch. So they go around, and there are
/// regions.
#[test]
fn a_foot_that_crosses_on_the_straight_way_or_beside_the_stance_sole_touches() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let around = region(&robot, "in front").around();
    for (to, around) in [
        ([0.15, -0.075], Around::default()),
        ([0.06, 0.0], around),
        ([0.1, -0.06], around),
    ] {
        assert_eq!(
            least_gap_m(&robot, Foot::Left, to, around),
            Some(0.0),
            "{to:?} by {around:?}"
        );
    }
}

#[test]
fn the_times_that_the_settings_state_are_those_of_the_motors_rounded_up() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    for region in &robot.reach {
        let least_s = least_swing_time_s(&robot, region).unwrap();
        let stated_s = region.swing_time_s;
        assert!(
            least_s <= stated_s && stated_s < least_s + 0.01,
            "{}: {least_s} s, not {stated_s} s",
            region.name
        );
    }
}

/// Motors with 1/k^2 of the torque, without gravity, would need k times as long while the speed is no limit.
#[test]
fn weaker_and_slower_motors_need_longer_and_a_farther_place_takes_longer() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let beside = region(&robot, "beside");
    let as_designed = least_swing_time_s(&robot, beside).unwrap();
    let with = |torque: f64, speed: f64| {
        let mut other = robot.clone();
        for servo in &mut other.servos {
            servo.torque_n_m *= torque;
            servo.full_torque_speed_rad_s *= speed;
            servo.no_torque_speed_rad_s *= speed;
        }
        least_swing_time_s(&other, beside).unwrap()
    };
    let (weaker, slower) = (with(0.75, 1.0), with(1.0, 0.5));
    assert!(
        weaker > 1.1 * as_designed && slower > 1.005 * as_designed,
        "{as_designed} {weaker} {slower}"
    );
    // If the motors are strong, hardly any torque is needed for gravity, so the torque for the motion alone decides.
    let (strong, stronger) = (with(16.0, 100.0), with(64.0, 100.0));
    assert!(
        (strong / stronger - 2.0).abs() < 0.01,
        "{strong} {stronger}"
    );
    let near = LandingRegion {
        x_m: [-0.1, 0.1],
        ..beside.clone()
    };
    assert!(least_swing_time_s(&robot, &near).unwrap() < 0.9 * as_designed);
    let far = LandingRegion {
        x_m: [0.0, 0.5],
        ..beside.clone()
    };
    assert_eq!(least_swing_time_s(&robot, &far), None, "it is out of reach");
}
