//! Kinematics and static loads of UT-mu2 against finite differences and symmetry.

use nalgebra::{
    Isometry3, Matrix3xX, Matrix6xX, Point3, Translation3, UnitQuaternion, Vector3, point, vector,
};
use proptest::prelude::*;
use standfast_core::robot::dynamics::load_torques;
use standfast_core::robot::{Foot, GRAVITY, Kinematics, PerFoot, Posture, Robot};
use std::sync::LazyLock;

static ROBOT: LazyLock<Robot> = LazyLock::new(|| standfast_robots::load("ut-mu2").unwrap());

const STEP: f64 = 1e-5;

/// Any posture, with the base within 1 m, any rotation vector within 2 rad, and joints within 1.5 rad.
fn posture() -> impl Strategy<Value = Posture> {
    let n = ROBOT.joints.len();
    (
        prop::collection::vec(-1.0..1.0f64, 6),
        prop::collection::vec(-1.5..1.5f64, n),
    )
        .prop_map(|(b, q)| Posture {
            base: Isometry3::from_parts(
                Translation3::new(b[0], b[1], b[2]),
                UnitQuaternion::from_scaled_axis(vector![b[3], b[4], b[5]] * 2.0 / 3f64.sqrt()),
            ),
            q,
        })
}

/// The posture moved by `amount` along generalised coordinate `k`.
fn moved(posture: &Posture, k: usize, amount: f64) -> Posture {
    let mut p = posture.clone();
    let along = |k: usize| Vector3::ith(k, amount);
    match k {
        0..3 => p.base.translation.vector += along(k),
        3..6 => p.base.rotation = UnitQuaternion::from_scaled_axis(along(k - 3)) * p.base.rotation,
        _ => p.q[k - 6] += amount,
    }
    p
}

fn at(posture: &Posture) -> Kinematics {
    Kinematics::at(&ROBOT, posture)
}

/// Central difference of a point along coordinate `k`.
fn slope(posture: &Posture, k: usize, point: impl Fn(&Kinematics) -> Point3<f64>) -> Vector3<f64> {
    (point(&at(&moved(posture, k, STEP))) - point(&at(&moved(posture, k, -STEP)))) / (2.0 * STEP)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    #[test]
    fn com_jacobian_is_the_slope_of_the_com(posture in posture()) {
        let mut jacobian = Matrix3xX::zeros(6 + ROBOT.joints.len());
        at(&posture).com_jacobian(&ROBOT, &mut jacobian);
        for k in 0..jacobian.ncols() {
            let error = slope(&posture, k, Kinematics::com) - jacobian.column(k);
            prop_assert!(error.norm() < 1e-9, "column {k}: {error}");
        }
    }

    #[test]
    fn point_jacobian_is_the_slope_of_the_point(posture in posture(), link in 0..21usize) {
        let local = point![0.03, -0.02, 0.05];
        let now = at(&posture);
        let mut jacobian = Matrix6xX::zeros(6 + ROBOT.joints.len());
        now.point_jacobian(&ROBOT, link, &(now.link_pose(link) * local), &mut jacobian);
        for k in 0..jacobian.ncols() {
            let linear = slope(&posture, k, |kin| kin.link_pose(link) * local);
            let turn = |amount: f64| at(&moved(&posture, k, amount)).link_pose(link).rotation;
            let angular = (turn(STEP) * turn(-STEP).inverse()).scaled_axis() / (2.0 * STEP);
            prop_assert!((linear - jacobian.fixed_view::<3, 1>(0, k)).norm() < 1e-8, "linear, column {k}");
            prop_assert!((angular - jacobian.fixed_view::<3, 1>(3, k)).norm() < 1e-8, "angular, column {k}");
        }
    }

    /// Torques and residual wrench are the slopes of the potential of gravity and of constant forces on the soles.
    #[test]
    fn loads_do_the_virtual_work(posture in posture(), f in prop::collection::vec(-20.0..20.0f64, 12)) {
        let gravity = vector![0.7, -0.4, -GRAVITY];
        let v = |i: usize| vector![f[i], f[i + 1], f[i + 2]];
        let wrenches = PerFoot { left: [v(0), v(3) * 0.1], right: [v(6), v(9) * 0.1] };
        let mut tau = vec![0.0; ROBOT.joints.len()];
        let left_over = load_torques(&at(&posture), &ROBOT, gravity, &wrenches, &mut tau);
        for k in 0..6 + tau.len() {
            let mut work = slope(&posture, k, Kinematics::com).dot(&gravity) * ROBOT.mass();
            for foot in Foot::BOTH {
                let sole = |kin: &Kinematics| kin.sole_pose(&ROBOT, foot);
                let [force, moment] = wrenches[foot];
                work += slope(&posture, k, |kin| sole(kin).translation.vector.into()).dot(&force);
                let turn = |amount: f64| sole(&at(&moved(&posture, k, amount))).rotation;
                let spin = (turn(STEP) * turn(-STEP).inverse()).scaled_axis() / (2.0 * STEP);
                work += spin.dot(&moment);
            }
            let got = match k {
                0..3 => left_over[0][k],
                3..6 => left_over[1][k - 3],
                _ => -tau[k - 6],
            };
            prop_assert!((got - work).abs() < 1e-6, "coordinate {k}: {got} against {work}");
        }
    }

    /// Left and right differ only in the body's COM, which is published as 0.4 mm off the middle, and in rounded
    /// inertias.
    #[test]
    fn mirrored_postures_mirror_the_com(q in prop::collection::vec(-1.5..1.5f64, 20)) {
        let mut mirrored = q.clone();
        for (i, joint) in ROBOT.joints.iter().enumerate() {
            let twin = match joint.name.strip_prefix("left_") {
                Some(name) => format!("right_{name}"),
                None => joint.name.replacen("right_", "left_", 1),
            };
            mirrored[ROBOT.joints.iter().position(|j| j.name == twin).unwrap()] = q[i];
        }
        let base = Isometry3::identity();
        let (a, b) = (at(&Posture { base, q }).com(), at(&Posture { base, q: mirrored }).com());
        let body = &ROBOT.links[0];
        let off_middle = body.com_m.y * body.mass_kg / ROBOT.mass();
        prop_assert!((a.x - b.x).abs() < 1e-12 && (a.z - b.z).abs() < 1e-12);
        prop_assert!((a.y + b.y - 2.0 * off_middle).abs() < 1e-12);
    }
}

#[test]
fn home_stands_flat_with_the_com_over_the_middle() {
    let home = at(&ROBOT.home_posture());
    for (foot, side) in [(Foot::Left, 1.0), (Foot::Right, -1.0)] {
        let sole = home.sole_pose(&ROBOT, foot);
        assert!(sole.rotation.angle() < 1e-9);
        assert!((sole.translation.vector - vector![0.0, side * 0.0485, 0.0]).norm() < 1e-9);
    }
    assert!(home.com().x.abs() < 1e-4);
    assert!(home.com().y.abs() < 3e-4);
    assert!((home.com().z - 0.310).abs() < 5e-4);
    assert!((ROBOT.omega() - 5.63).abs() < 0.005);
}

/// The ground carries m g under the COM: the residual wrench is zero, and no joint is near its torque limit.
#[test]
fn at_home_the_ground_carries_the_robot() {
    let home = at(&ROBOT.home_posture());
    let com = home.com();
    let force = vector![0.0, 0.0, ROBOT.weight_n() / 2.0];
    let wrenches = PerFoot::from_fn(|foot| {
        let sole: Point3<f64> = home.sole_pose(&ROBOT, foot).translation.vector.into();
        // Both centres of pressure are off the soles' centres by the same offset.
        let middle = point![0.0, 0.0, 0.0];
        let zmp = sole + (point![com.x, com.y, 0.0] - middle);
        [force, (zmp - sole).cross(&force)]
    });
    let mut tau = vec![0.0; ROBOT.joints.len()];
    let left_over = load_torques(
        &home,
        &ROBOT,
        vector![0.0, 0.0, -GRAVITY],
        &wrenches,
        &mut tau,
    );
    assert!(
        left_over[0].norm() < 1e-9 && left_over[1].norm() < 1e-9,
        "{left_over:?}"
    );
    for ((joint, servo), tau) in ROBOT.joints.iter().zip(&ROBOT.servos).zip(&tau) {
        assert!(
            tau.abs() < 0.5 * servo.torque_n_m,
            "{}: {tau} N m",
            joint.name
        );
    }
    assert!(tau.iter().any(|t| t.abs() > 0.5), "{tau:?}");
}
