//! What the legs can reach, and what becomes of the rest.

use nalgebra::{UnitQuaternion, Vector3};
use standfast_core::control::body::{BodyTargets, InverseKinematics};
use standfast_core::robot::swing_shape::least_jerk;
use standfast_core::robot::{Foot, Kinematics, PerFoot, Robot};

/// How a task was followed.
struct FollowedTask {
    /// Largest distance of COM (horizontal, and in height) and soles from their targets (m).
    com: f64,
    height: f64,
    soles: f64,
    /// Largest rotation of a sole from its target (rad).
    turned: f64,
    /// Largest change of a joint reference in one tick, over all ticks and in the last one (rad).
    leap: f64,
    last: f64,
}

/// The targets with the feet moved from home by `[left, right]` (m), and the COM at home height above their middle.
fn stride(robot: &Robot, by: [Vector3<f64>; 2]) -> BodyTargets {
    let kinematics = Kinematics::at_home(robot);
    let mut soles = kinematics.sole_poses(robot);
    for (foot, by) in Foot::BOTH.into_iter().zip(by) {
        soles[foot].translation.vector += by;
    }
    BodyTargets {
        com: kinematics.com() + 0.5 * (by[0] + by[1]),
        rise: f64::INFINITY,
        com_vel: Vector3::zeros(),
        soles,
        sole_vel: PerFoot::default(),
        trunk: UnitQuaternion::identity(),
    }
}

/// A minimum-jerk stride like that of a swing foot, in 0.2 s, and then 500 ticks at its end.
fn follow(robot: &Robot, left: [f64; 2], right: [f64; 2]) -> FollowedTask {
    let by = [left, right].map(|[x, y]| Vector3::new(x, y, 0.0));
    let mut body = InverseKinematics::new(robot);
    let (mut leap, mut last) = (0.0_f64, 0.0);
    let mut task = stride(robot, by);
    for k in 1..=600 {
        let before = body.posture.q.clone();
        let share = least_jerk(f64::from(k) / 100.0);
        task = stride(robot, by.map(|by| by * share));
        body.follow(robot, &task);
        last = body
            .posture
            .q
            .iter()
            .zip(&before)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        leap = leap.max(last);
    }
    let kinematics = Kinematics::at(robot, &body.posture);
    let [left, right] =
        Foot::BOTH.map(|foot| task.soles[foot].inverse() * kinematics.sole_pose(robot, foot));
    let com = kinematics.com() - task.com;
    let soles = left
        .translation
        .vector
        .norm()
        .max(right.translation.vector.norm());
    let turned = left.rotation.angle().max(right.rotation.angle());
    FollowedTask {
        com: com.xy().norm(),
        height: com.z.abs(),
        soles,
        turned,
        leap,
        last,
    }
}

const HERE: [f64; 2] = [0.0, 0.0];

/// Where the legs reach, the height deviates by micrometres, in favour of the arms. Elsewhere the feet are so far apart
/// that a leg is straight at home height. Joints once leapt by radians there. The height of the COM gives way, its
/// horizontal place hardly does, and the places of the feet do not; if both legs are straight and turned, the place
/// gives way by 8.5 mm, and the soles turn by 0.084 rad.
#[test]
fn what_the_legs_can_reach_is_reached_and_the_rest_is_approached_without_a_leap() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    for (left, right, most) in [
        (HERE, HERE, None),
        (HERE, [0.06, 0.0], None),
        (HERE, [-0.1, -0.05], None),
        ([0.1, 0.0], HERE, None),
        ([0.0, 0.08], [0.02, 0.0], None),
        (HERE, [0.18, 0.0], Some(5e-3)),
        (HERE, [-0.18, 0.0], Some(5e-3)),
        ([0.25, 0.0], HERE, Some(5e-3)),
        ([0.2, 0.05], [-0.2, -0.05], Some(1e-2)),
        (HERE, [0.0, -0.4], Some(5e-3)),
    ] {
        let FollowedTask {
            com,
            height,
            soles,
            turned,
            leap,
            last,
        } = follow(&robot, left, right);
        let is_good = match most {
            None => com < 1e-6 && soles.max(turned) < 1e-6 && height < 5e-5,
            Some(most) => {
                com < most
                    && soles < 1e-3
                    && turned < 0.1
                    && height > 1e-3
                    && leap < 0.2
                    && last < 1e-9
            }
        };
        assert!(
            is_good,
            "{left:?} {right:?}: {com} m, {height} m, {soles} m, soles turned by {turned} rad, leaps by {leap} rad, at last {last}"
        );
    }
}

/// With the feet side by side and the COM far to the left of them, the left ankle is at its limit. The sole turns onto
/// its edge, so that the COM is 11 mm short of its place. With soles that stay flat, it was 19 mm short.
#[test]
fn with_an_ankle_at_its_limit_the_sole_turns_and_the_com_follows() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let mut targets = stride(&robot, [Vector3::new(0.0, -0.05, 0.0), Vector3::zeros()]);
    let mut body = InverseKinematics::new(&robot);
    let middle = targets.com;
    for k in 1..=100 {
        targets.com = middle + Vector3::new(0.0, 0.1, -0.05) * least_jerk(f64::from(k) / 100.0);
        body.follow(&robot, &targets);
    }
    let kinematics = Kinematics::at(&robot, &body.posture);
    let short = (kinematics.com() - targets.com).xy().norm();
    let sole = targets.soles.left.inverse() * kinematics.sole_pose(&robot, Foot::Left);
    let (turned, moved) = (sole.rotation.angle(), sole.translation.vector.norm());
    assert!(
        short < 0.015 && turned > 0.1 && moved < 1e-3,
        "{short} m short, turned by {turned} rad, moved by {moved} m"
    );
}

/// The robot stands on its left foot, and its right leg is straight behind it. The right sole is lifted by 20 mm within 40
/// ms. A straight leg cannot shorten at once, and the COM would be raised by 7 mm, so fast that the robot would leave the
/// ground. It rises by less than 1 mm, and the sole lags until the knee is bent.
#[test]
fn a_straight_leg_that_is_lifted_does_not_raise_the_body() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let far = Vector3::new(0.15, 0.1, 0.0);
    let mut targets = stride(&robot, [far, Vector3::zeros()]);
    targets.com += Vector3::new(0.04, 0.03, 0.0);
    let mut body = InverseKinematics::new(&robot);
    for _ in 0..200 {
        body.follow(&robot, &targets);
    }
    targets.com.z = body.com_height(&robot);
    let (ground, mut highest) = (targets.soles.right.translation.z, f64::MIN);
    for k in 1..=40 {
        targets.soles.right.translation.z = ground + 0.02 * least_jerk(f64::from(k) / 20.0);
        body.follow(&robot, &targets);
        highest = highest.max(body.com_height(&robot) - targets.com.z);
    }
    let kinematics = Kinematics::at(&robot, &body.posture);
    let sole = kinematics.sole_pose(&robot, Foot::Right).translation.z;
    let lags = (targets.soles.right.translation.z - sole).abs();
    assert!(
        highest < 1e-3 && lags < 1e-3,
        "the COM rises by {highest} m, and the sole is {lags} m off at last"
    );
}
