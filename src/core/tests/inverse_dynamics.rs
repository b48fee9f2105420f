//! Inverse dynamics of UT-mu2: its predictions obey the equations of motion and the limits of the ground, for any task.

use nalgebra::{DVector, Matrix6xX, Point2, Point3, UnitQuaternion, Vector3, vector};
use proptest::prelude::*;
use standfast_core::control::body::{
    ContactModel, DesiredAcceleration, InverseDynamics, PredictedContact,
};
use standfast_core::robot::dynamics::{Dynamics, load_torques};
use standfast_core::robot::{Foot, GRAVITY, Kinematics, PerFoot, Posture, Robot};
use std::sync::LazyLock;

static ROBOT: LazyLock<Robot> = LazyLock::new(|| standfast_robots::load("ut-mu2").unwrap());

const CONTACT: ContactModel = ContactModel {
    friction: 0.6,
    sole_share: 0.95,
};
const BOTH: PerFoot<bool> = PerFoot {
    left: true,
    right: true,
};
const LEFT: PerFoot<bool> = PerFoot {
    left: true,
    right: false,
};

struct Solved {
    kinematics: Kinematics,
    body: InverseDynamics,
    predicted: PredictedContact,
    /// Residual of the equations of motion (N, N m).
    left_over: f64,
}

fn solve(posture: &Posture, velocity: &DVector<f64>, wanted: &DesiredAcceleration) -> Solved {
    let mut body = InverseDynamics::new(&ROBOT, CONTACT);
    let predicted = body.solve(&ROBOT, posture, velocity, wanted).unwrap();
    let kinematics = Kinematics::at(&ROBOT, posture);
    let mut dynamics = Dynamics::new(&ROBOT);
    dynamics.update(&ROBOT, &kinematics, velocity);
    let mut sum = dynamics.mass_matrix() * &body.acceleration + dynamics.bias();
    for foot in Foot::BOTH {
        let sole = sole(&kinematics, foot);
        let mut jacobian = Matrix6xX::zeros(sum.len());
        kinematics.point_jacobian(&ROBOT, ROBOT.soles[foot].link, &sole, &mut jacobian);
        sum -= jacobian.rows(0, 3).transpose() * predicted.wrenches[foot].force;
        sum -= jacobian.rows(3, 3).transpose() * predicted.wrenches[foot].moment;
    }
    for (j, tau) in body.tau.iter().enumerate() {
        sum[6 + j] -= tau;
    }
    // The COM acceleration agrees with the COM Jacobian.
    let mut jacobian = nalgebra::Matrix3xX::zeros(sum.len());
    kinematics.com_jacobian(&ROBOT, &mut jacobian);
    let com_acc = jacobian * &body.acceleration + dynamics.com_bias_acc();
    let left_over = sum
        .amax()
        .max((com_acc - predicted.com_acc).amax() * ROBOT.mass());
    Solved {
        kinematics,
        body,
        predicted,
        left_over,
    }
}

fn sole(kinematics: &Kinematics, foot: Foot) -> Point3<f64> {
    kinematics.sole_pose(&ROBOT, foot).translation.vector.into()
}

fn at_home(wanted: &DesiredAcceleration) -> Solved {
    solve(
        &ROBOT.home_posture(),
        &DVector::zeros(6 + ROBOT.joints.len()),
        wanted,
    )
}

/// Angular acceleration of a link.
fn angular_acc(solved: &Solved, link: usize) -> Vector3<f64> {
    let mut jacobian = Matrix6xX::zeros(solved.body.acceleration.len());
    let origin = solved.kinematics.link_pose(link).translation.vector.into();
    solved
        .kinematics
        .point_jacobian(&ROBOT, link, &origin, &mut jacobian);
    (jacobian * &solved.body.acceleration)
        .fixed_rows::<3>(3)
        .into()
}

/// Each wrench can be supplied by the ground: the pressure is inside the sole, and the forces are within friction.
fn check_ground(solved: &Solved, standing: &PerFoot<bool>) {
    for foot in Foot::BOTH {
        let wrench = solved.predicted.wrenches[foot];
        let to_sole = solved.kinematics.sole_pose(&ROBOT, foot).rotation.inverse();
        let (force, moment) = (to_sole * wrench.force, to_sole * wrench.moment);
        if !standing[foot] {
            assert_eq!((force, moment), (Vector3::zeros(), Vector3::zeros()));
            continue;
        }
        assert!(force.z >= 0.0);
        assert!(
            force.xy().norm() <= CONTACT.friction * force.z + 1e-9,
            "{force}"
        );
        let [x, y] = ROBOT.soles[foot]
            .half_m
            .map(|half| half * CONTACT.sole_share * force.z + 1e-9);
        assert!(
            moment.y.abs() <= x && moment.x.abs() <= y,
            "{foot:?}: {moment} at {} N",
            force.z
        );
    }
}

#[test]
fn standing_at_home_takes_the_torques_of_gravity_with_the_zmp_under_the_com() {
    let solved = at_home(&DesiredAcceleration::rest(&ROBOT, BOTH));
    let (predicted, com) = (solved.predicted, solved.kinematics.com());
    assert!(solved.left_over < 1e-9 && predicted.is_optimal);
    assert!(
        solved.body.acceleration.amax() < 0.01,
        "{}",
        solved.body.acceleration.amax()
    );
    assert!(
        (predicted.zmp.unwrap() - com.xy()).norm() < 1e-4,
        "{:?} {com}",
        predicted.zmp
    );
    let wrenches = PerFoot::from_fn(|foot| {
        [
            predicted.wrenches[foot].force,
            predicted.wrenches[foot].moment,
        ]
    });
    let mut tau = vec![0.0; ROBOT.joints.len()];
    load_torques(
        &solved.kinematics,
        &ROBOT,
        vector![0.0, 0.0, -GRAVITY],
        &wrenches,
        &mut tau,
    );
    for (j, (got, wanted)) in solved.body.tau.iter().zip(&tau).enumerate() {
        assert!(
            (got - wanted).abs() < 1e-3,
            "{}: {got} {wanted}",
            ROBOT.joints[j].name
        );
    }
    // Each foot bears half of the weight, except for the small offset of the body's COM from the middle.
    let half = 0.5 * ROBOT.weight_n();
    assert!(
        Foot::BOTH
            .iter()
            .all(|&foot| (predicted.wrenches[foot].force.z - half).abs() < 1.0)
    );
    assert!(predicted.torque_ratio > 0.05 && predicted.torque_ratio < 0.5);
}

/// As long as the angular momentum is constant, the ground presses at the pendulum's ZMP.
#[test]
fn a_com_acceleration_within_the_support_is_met_by_its_zmp() {
    let omega2 = ROBOT.omega().powi(2);
    for zmp in [[0.03, 0.0], [-0.03, 0.02], [0.0, 0.05], [0.02, -0.04]] {
        let mut wanted = DesiredAcceleration::rest(&ROBOT, BOTH);
        let com = at_home(&wanted).kinematics.com();
        wanted.com_acc = vector![omega2 * (com.x - zmp[0]), omega2 * (com.y - zmp[1]), 0.0];
        let solved = at_home(&wanted);
        check_ground(&solved, &BOTH);
        assert!(
            (solved.predicted.com_acc - wanted.com_acc).norm() < 0.05,
            "{zmp:?}: {}",
            solved.predicted.com_acc
        );
        let got = solved.predicted.zmp.unwrap();
        // Trunk and arms do not turn, but the legs do: their angular momentum takes up to a fifth more.
        let more = got.coords.norm() / Point2::from(zmp).coords.norm();
        println!("{zmp:?}: ZMP {got}, {more:.2} of the pendulum's");
        assert!(
            (got - Point2::from(zmp)).norm() < 0.01 && more < 1.25,
            "{zmp:?}: {got}"
        );
        assert!(solved.predicted.torque_ratio < 1.0);
    }
}

/// If the demand exceeds the edge, the ground presses at the edge, and the predicted COM acceleration is the one that
/// follows from this.
#[test]
fn beyond_the_support_the_zmp_stops_at_the_edge_and_the_outlook_says_what_that_gives() {
    let omega2 = ROBOT.omega().powi(2);
    let edge = ROBOT.soles.left.half_m[0] * CONTACT.sole_share;
    let mut before = 0.0;
    for beyond in [0.06, 0.08, 0.12, 0.2] {
        let mut wanted = DesiredAcceleration::rest(&ROBOT, BOTH);
        wanted.com_acc.x = -omega2 * beyond;
        let solved = at_home(&wanted);
        check_ground(&solved, &BOTH);
        assert!(solved.left_over < 1e-9 && solved.predicted.is_optimal);
        let (zmp, got) = (solved.predicted.zmp.unwrap().x, solved.predicted.com_acc.x);
        println!(
            "ZMP {beyond} asked: {zmp:.4}, {:.2} of {:.2} m/s^2",
            got, wanted.com_acc.x
        );
        assert!(zmp > edge - 2e-3 && zmp < edge + 1e-9, "{beyond}: {zmp}");
        // The part beyond the edge's own share comes from the angular momentum of trunk and arms.
        assert!(
            got < -0.8 * omega2 * edge && got > 0.9 * wanted.com_acc.x,
            "{beyond}: {got} of {}",
            wanted.com_acc.x
        );
        let turn = angular_acc(&solved, ROBOT.trunk).norm();
        assert!(turn > before, "{beyond}: {turn}");
        before = turn;
    }
}

#[test]
fn friction_bounds_what_the_feet_hold() {
    let mut wanted = DesiredAcceleration::rest(&ROBOT, BOTH);
    wanted.com_acc = vector![30.0, 20.0, 0.0];
    let solved = at_home(&wanted);
    check_ground(&solved, &BOTH);
    assert!(solved.left_over < 1e-9);
    // The force is less than a friction cone allows, and no less than a pyramid inside of the cone.
    let force = Foot::BOTH.iter().fold(Vector3::zeros(), |sum, &f| {
        sum + solved.predicted.wrenches[f].force
    });
    assert!(
        force.xy().norm() > 0.3 * CONTACT.friction * force.z,
        "{force}"
    );
}

/// One foot is accelerated forward by 30 m/s^2 while the other stands.
#[test]
fn a_foot_swings_while_the_other_stands() {
    let mut posture = ROBOT.home_posture();
    posture.base.translation.x -= 0.01;
    let velocity = DVector::zeros(6 + ROBOT.joints.len());
    let mut wanted = DesiredAcceleration::rest(&ROBOT, LEFT);
    wanted.sole_acc.right[0] = vector![30.0, 0.0, 5.0];
    // With the COM above the stance sole no moment would be needed. The COM moves as the pendulum does with the ZMP
    // there.
    let com = solve(&posture, &velocity, &wanted).kinematics.com();
    wanted.com_acc.y = ROBOT.omega().powi(2) * (com.y - 0.0485);
    let solved = solve(&posture, &velocity, &wanted);
    check_ground(&solved, &LEFT);
    assert!(
        solved.left_over < 1e-9 && solved.predicted.is_optimal,
        "{}",
        solved.left_over
    );
    let mut jacobian = Matrix6xX::zeros(velocity.len());
    for (foot, acc, most) in [
        (Foot::Left, [0.0; 3], 0.01),
        (Foot::Right, [30.0, 0.0, 5.0], 3.0),
    ] {
        let (link, point) = (ROBOT.soles[foot].link, sole(&solved.kinematics, foot));
        solved
            .kinematics
            .point_jacobian(&ROBOT, link, &point, &mut jacobian);
        let got = &jacobian * &solved.body.acceleration;
        assert!(
            (got.fixed_rows::<3>(0) - Vector3::from(acc)).norm() < most,
            "{foot:?}: {got}"
        );
    }
    println!(
        "COM: {} of {}",
        solved.predicted.com_acc.transpose(),
        wanted.com_acc.transpose()
    );
}

/// A step of 10 mm and 0.03 rad is nearly linear. A straight leg could not make it.
#[test]
fn a_step_of_a_leg_brings_its_sole_to_a_pose_and_moves_no_other_joint() {
    let solved = at_home(&DesiredAcceleration::rest(&ROBOT, LEFT));
    for foot in Foot::BOTH {
        let mut pose = solved.kinematics.sole_pose(&ROBOT, foot);
        pose.translation.vector += vector![0.006, -0.004, 0.007];
        pose.rotation =
            UnitQuaternion::from_scaled_axis(vector![0.02, -0.02, 0.01]) * pose.rotation;
        let mut posture = ROBOT.home_posture();
        let length_m = ROBOT.home_com_height();
        for (j, step_rad) in solved.body.leg_step(&ROBOT, foot, &pose, length_m) {
            posture.q[j] += step_rad;
        }
        let kinematics = Kinematics::at(&ROBOT, &posture);
        let sole = kinematics.sole_pose(&ROBOT, foot);
        let off = pose.translation.vector - sole.translation.vector;
        assert!(off.norm() < 1e-3, "{foot:?}: {off}");
        assert!(
            sole.rotation.angle_to(&pose.rotation) < 3e-3,
            "{sole} {pose}"
        );
        let other = solved.kinematics.sole_pose(&ROBOT, foot.other());
        assert_eq!(kinematics.sole_pose(&ROBOT, foot.other()), other);
    }
}

/// With no foot on the ground the COM falls.
#[test]
fn in_flight_the_com_falls() {
    let mut wanted = DesiredAcceleration::rest(&ROBOT, PerFoot::default());
    wanted.com_acc.x = 1.0;
    let solved = at_home(&wanted);
    assert!((solved.predicted.com_acc - vector![0.0, 0.0, -GRAVITY]).norm() < 1e-12);
    assert!(solved.predicted.zmp.is_none() && solved.left_over < 1e-9);
}

#[test]
fn torques_beyond_the_servos_are_told() {
    let mut wanted = DesiredAcceleration::rest(&ROBOT, LEFT);
    wanted.sole_acc.right[0] = vector![300.0, 0.0, 0.0];
    let solved = at_home(&wanted);
    let most = solved
        .body
        .tau
        .iter()
        .zip(&ROBOT.servos)
        .map(|(t, s)| t.abs() / s.torque_n_m)
        .fold(0.0, f64::max);
    assert!(solved.predicted.torque_ratio > 1.0);
    assert_eq!(solved.predicted.torque_ratio, most);
}

/// A joint beyond its margin is driven back.
#[test]
fn a_joint_near_its_limit_is_driven_back() {
    let mut posture = ROBOT.home_posture();
    let elbow = ROBOT
        .joints
        .iter()
        .position(|joint| joint.name == "left_elbow_flexion")
        .unwrap();
    posture.q[elbow] = ROBOT.joints[elbow].upper_rad - 0.02;
    let solved = solve(
        &posture,
        &DVector::zeros(6 + ROBOT.joints.len()),
        &DesiredAcceleration::rest(&ROBOT, BOTH),
    );
    assert!(
        solved.body.acceleration[6 + elbow] < -10.0,
        "{}",
        solved.body.acceleration[6 + elbow]
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    /// For any task and any motion, the prediction obeys the equations of motion and the limits of the ground.
    #[test]
    fn the_outlook_is_never_a_lie(
        q in prop::collection::vec(-0.3..0.3f64, 20),
        v in prop::collection::vec(-2.0..2.0f64, 26),
        acc in prop::collection::vec(-20.0..20.0f64, 18),
        standing in 0..3usize,
    ) {
        let mut posture = ROBOT.home_posture();
        for (q, by) in posture.q.iter_mut().zip(&q) {
            *q += by;
        }
        let standing = [BOTH, LEFT, PerFoot { left: false, right: true }][standing];
        let mut wanted = DesiredAcceleration::rest(&ROBOT, standing);
        let at = |i: usize| vector![acc[i], acc[i + 1], acc[i + 2]];
        (wanted.com_acc, wanted.trunk_acc) = (at(0), at(3));
        for (foot, i) in [(Foot::Left, 6), (Foot::Right, 12)] {
            if !standing[foot] {
                wanted.sole_acc[foot] = [at(i), at(i + 3)];
            }
        }
        let solved = solve(&posture, &DVector::from_vec(v), &wanted);
        prop_assert!(solved.left_over < 1e-7, "{}", solved.left_over);
        prop_assert!(solved.predicted.is_optimal);
        check_ground(&solved, &standing);
    }
}
