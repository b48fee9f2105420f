//! When a sole counts as in contact, and how fast it moves.

use nalgebra::{UnitQuaternion, Vector3};
use standfast_core::control::estimate::{Estimate, Estimator};
use standfast_core::robot::{Foot, GRAVITY, PerFoot};
use standfast_core::socket::Wrench;
use standfast_core::socket::{Imu, Sensed};

/// A foot in the air comes into contact from 3 % of the weight and five standard deviations of the force sensor on
/// (4.85 N for UT-mu2), and stays so down to 2 % and three (3.07 N). Less is a touch, or noise.
#[test]
fn a_touch_is_no_contact() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let [from_n, to_n] = Estimate::at_home(&robot).contact_load_n;
    assert!(
        (from_n - 4.85).abs() < 0.01 && (to_n - 3.07).abs() < 0.01,
        "{from_n} N, {to_n} N"
    );
    let mut estimator = Estimator::new(&robot, 0.002);
    let mut touches = |right_n: f64, in_air: Option<Foot>| {
        let load = |force_n: f64| Wrench {
            force: Vector3::new(0.0, 0.0, force_n),
            ..Wrench::default()
        };
        let mut q = robot.home_rad.clone();
        // The right sole stays level, some centimetres above the ground.
        for (joint, more) in [
            ("right_hip_flexion", 0.3),
            ("right_knee_flexion", 0.6),
            ("right_ankle_flexion", 0.3),
        ] {
            q[robot.joints.iter().position(|j| j.name == joint).unwrap()] += more;
        }
        let imu = Imu::over(
            0.002,
            UnitQuaternion::identity(),
            [Vector3::zeros(); 2],
            Vector3::zeros(),
        );
        let soles = PerFoot {
            left: load(robot.weight_n() - right_n),
            right: load(right_n),
        };
        let dq = vec![0.0; q.len()];
        estimator.update(
            &robot,
            &Sensed {
                time_s: 0.0,
                q,
                dq,
                imu,
                soles,
            },
            in_air,
        );
        estimator.now().in_contact.right
    };
    assert!(
        !touches(30.0, Some(Foot::Right)),
        "the foot that the controller moves"
    );
    assert!(!touches(4.0, None) && !touches(4.8, None), "a touch");
    assert!(
        touches(4.9, None) && touches(4.0, None) && touches(3.1, None),
        "a load, and what is left of it"
    );
    assert!(!touches(3.0, None) && !touches(4.0, None), "it has left");
}

/// A robot in flight turns while all its joints move. Its IMU is on a forearm, so that joints move it, too.
#[test]
fn the_velocity_of_a_sole_is_the_slope_of_its_place() {
    const DT: f64 = 0.002;
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    robot.trunk = robot
        .links
        .iter()
        .position(|link| link.name == "left_elbow_flexion")
        .unwrap();
    let mut estimator = Estimator::new(&robot, DT);
    let turning = Vector3::new(0.3, -0.5, 0.8);
    let dq: Vec<f64> = (0..robot.joints.len())
        .map(|j| 0.2 + 0.1 * j as f64)
        .collect();
    let states: Vec<_> = (0..3)
        .map(|tick| {
            let time_s = DT * f64::from(tick);
            let orientation = UnitQuaternion::from_scaled_axis(turning * time_s);
            let imu = Imu {
                orientation,
                gyro: turning,
                accelerometer: orientation.inverse() * Vector3::new(0.0, 0.0, GRAVITY),
            };
            let moved = robot
                .home_rad
                .iter()
                .zip(&dq)
                .map(|(q, dq)| q + dq * time_s);
            let sensed = Sensed {
                time_s,
                q: moved.collect(),
                dq: dq.clone(),
                imu,
                soles: PerFoot::default(),
            };
            estimator.update(&robot, &sensed, None);
            let now = estimator.now();
            (now.soles, now.sole_vel)
        })
        .collect();
    for foot in Foot::BOTH {
        let [before, after] = [0, 2].map(|tick| states[tick].0[foot].translation.vector);
        let (slope, velocity) = ((after - before) / (2.0 * DT), states[1].1[foot]);
        assert!(
            (velocity - slope).norm() < 1e-4 && slope.norm() > 0.1,
            "{velocity} {slope}"
        );
    }
}
