//! Newton's second law for the whole robot.

use crate::common::{Bench, angular_momentum, config, push};
use nalgebra::{Point2, Vector3};
use rayon::prelude::*;
use standfast_core::robot::GRAVITY;
use standfast_sim::episode::{self, Disturbance, EpisodeConfig, Until};
use standfast_sim::{Plant, Profile, Pull, Push};

/// The quantities of the law at every tick.
struct Course {
    time_s: Vec<f64>,
    /// Momentum, m com_vel.
    momentum: Vec<Vector3<f64>>,
    /// Impulse of contacts, push and gravity since the start.
    received: Vec<Vector3<f64>>,
    /// Impulse of the push alone.
    pushed: Vector3<f64>,
    fell: bool,
}

impl Course {
    fn of(bench: &Bench, pushes: Vec<Push>, config: EpisodeConfig) -> Self {
        let mass = bench.robot.mass();
        let dt = config.control_period_s;
        let mut course = Course {
            time_s: vec![],
            momentum: vec![],
            received: vec![],
            pushed: Vector3::zeros(),
            fell: false,
        };
        let mut sum = Vector3::zeros();
        let disturbance = Disturbance {
            pushes,
            ..Disturbance::default()
        };
        let record = episode::run(
            &bench.robot,
            &bench.factory,
            &config,
            disturbance,
            Until::Horizon,
            &mut |tick| {
                let truth = tick.truth;
                // Forces are averages over the past tick, so there are none at time 0.
                if truth.time_s > 0.0 {
                    sum += (truth.contact_force + truth.push_force - Vector3::z() * mass * GRAVITY)
                        * dt;
                    course.pushed += truth.push_force * dt;
                }
                course.time_s.push(truth.time_s);
                course.momentum.push(truth.com_vel * mass);
                course.received.push(sum);
            },
        )
        .unwrap();
        course.fell = record.fell_at_s.is_some();
        course
    }

    /// Residual of the law between rows `a` and `b`.
    fn residual(&self, a: usize, b: usize) -> f64 {
        let gained = self.momentum[b] - self.momentum[a];
        (gained - (self.received[b] - self.received[a])).amax()
    }

    /// The largest residual over all windows of 0.1 s, with the start time of its window.
    fn worst_window(&self) -> (f64, f64) {
        let width = 50;
        (0..self.time_s.len() - width)
            .map(|i| (self.residual(i, i + width), self.time_s[i]))
            .fold(
                (0.0, 0.0),
                |worst, next| if next.0 > worst.0 { next } else { worst },
            )
    }

    /// The largest residual between the start and any row.
    fn worst_from_start(&self) -> f64 {
        (1..self.time_s.len())
            .map(|i| self.residual(0, i))
            .fold(0.0, f64::max)
    }
}

/// The momentum changes by the impulse of all external forces, on every axis: m dv = integral of (push + contact + m
/// g).
#[test]
fn momentum_changes_by_the_impulse_of_outer_forces() {
    let (switching, hold) = (Bench::new("switching"), Bench::new("hold"));
    let at = |impulse, heading| push(impulse, heading);
    let cases = [
        ("switching, 2 N s forward", &switching, at(2.0, 0.0)),
        ("switching, 2.5 N s at 45", &switching, at(2.5, 45.0)),
        ("switching, 2 N s at -135", &switching, at(2.0, -135.0)),
        (
            "switching, half sine",
            &switching,
            Push {
                profile: Profile::HalfSine,
                duration_s: 0.1,
                ..at(2.0, 90.0)
            },
        ),
        (
            "switching, 0.05 m high",
            &switching,
            Push {
                height_m: 0.05,
                ..at(1.5, 180.0)
            },
        ),
        ("hold, 2 N s forward", &hold, at(2.0, 0.0)),
    ];
    cases.par_iter().for_each(|(name, bench, push)| {
        let course = Course::of(bench, vec![*push], config(3.0));
        let (window, at_s) = course.worst_window();
        let whole = course.worst_from_start();
        println!(
            "{name}: {window:.5} N s in 0.1 s from {at_s:.2} s, {whole:.5} N s from the start"
        );
        assert!(!course.fell, "{name}");
        assert!(
            window < 0.05 && whole < 0.05,
            "{name}: {window} N s in 0.1 s, {whole} N s in all"
        );
        let asked = push.direction() * push.impulse_n_s;
        assert!(
            (course.pushed - asked).norm() < 1e-6 * push.impulse_n_s,
            "{name}: {} delivered",
            course.pushed
        );
    });
}

/// A body that hits the ground obeys the law too, with the contacts of all links. The integrator is of first order, so
/// the residual decreases with its step.
#[test]
fn what_a_fall_leaves_over_goes_down_with_the_step() {
    let hold = Bench::new("hold");
    let steps = [0.001, 0.0005, 0.00025];
    let sums = steps.par_iter().map(|&physics_step_s| {
        let course = Course::of(
            &hold,
            vec![push(4.0, 0.0)],
            EpisodeConfig {
                physics_step_s,
                ..config(1.5)
            },
        );
        assert!(course.fell);
        (1..course.time_s.len())
            .map(|i| course.residual(i - 1, i))
            .sum()
    });
    let sums: Vec<f64> = sums.collect();
    println!("sum of what ticks leave over: {sums:.4?} N s at {steps:?} s");
    assert!(
        sums[0] < 0.2 && sums[1] < 0.7 * sums[0] && sums[2] < 0.7 * sums[1],
        "{sums:?} N s"
    );
}

/// Forces add: two pushes at once deliver the sum of their impulses.
#[test]
fn pushes_at_the_same_time_add_up() {
    let course = Course::of(
        &Bench::new("switching"),
        vec![push(1.0, 0.0), push(1.0, 90.0)],
        config(1.0),
    );
    assert!(
        (course.pushed - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-6,
        "{}",
        course.pushed
    );
    assert!(course.worst_from_start() < 0.05);
}

/// The ground can only press, so the ZMP stays inside the soles. It moves to the side to which the robot is pushed.
#[test]
fn the_ground_presses_inside_the_soles_on_the_side_pushed_to() {
    let (switching, hold) = (Bench::new("switching"), Bench::new("hold"));
    let cases = [
        (&switching, 2.0, 0.0),
        (&switching, 2.0, 180.0),
        (&switching, 3.0, 90.0),
        (&hold, 2.0, -135.0),
    ];
    cases.par_iter().for_each(|&(bench, impulse, heading)| {
        let push = push(impulse, heading);
        let (mut furthest, mut outside) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        bench.run(vec![push], None, 0.8, Until::Horizon, |tick| {
            let truth = tick.truth;
            let zmp = Point2::from(truth.zmp.expect("the robot stands"));
            if truth.time_s > 0.0 {
                let support = tick.support.expect("the robot stands");
                outside = outside.max(support.signed_distance(zmp));
            }
            if truth.time_s > push.end_s() {
                furthest = furthest.max(zmp.coords.dot(&push.direction().xy()));
            }
        });
        println!("{impulse} N s at {heading}: ZMP at most {furthest:.4} m along the push, {outside:.5} m outside");
        assert!(furthest > 0.03, "{impulse} N s at {heading}: {furthest} m");
        assert!(outside < 0.002, "{impulse} N s at {heading}: {outside} m");
    });
}

/// Links that are driven into each other in flight stop each other. Neither momentum nor angular momentum changes, and
/// the soles' force sensors feel nothing, since these contacts are inner forces.
#[test]
fn limbs_that_are_driven_into_each_other_meet_and_stay_apart() {
    let bench = Bench::new("hold");
    let config = EpisodeConfig {
        physics_step_s: 0.0005,
        ..config(1.0)
    };
    let robot = &bench.robot;
    let throw = Pull {
        link: robot.trunk,
        point: robot.links[robot.trunk].com_m,
        force: Vector3::z() * 4.0 * robot.weight_n(),
    };
    let legs = ["left_hip_abduction", "right_hip_abduction"];
    let arm = ["left_shoulder_abduction", "left_shoulder_abduction"];
    for (driven, of_legs) in [(legs, true), (arm, false)] {
        let joints = driven.map(|name| {
            robot
                .joints
                .iter()
                .position(|joint| joint.name == name)
                .unwrap()
        });
        let home = bench.robot.home_command();
        let mut inward = home.clone();
        for joint in joints {
            inward.q_ref[joint] = robot.joints[joint].lower_rad;
        }
        let mut plant = Plant::new(robot.clone(), config.clock(), None, home.clone());
        let mut pairs = Vec::new();
        let (mut start, mut apart_m, mut innermost_rad, mut gained) =
            (None, f64::INFINITY, f64::INFINITY, [0.0_f64; 2]);
        while plant.truth().time_s < 0.5 {
            let time_s = plant.truth().time_s;
            plant.pull = (time_s < 0.1).then_some(throw);
            let is_flying = time_s > 0.15;
            plant.advance(
                if is_flying {
                    inward.clone()
                } else {
                    home.clone()
                },
                &[],
            );
            if !is_flying {
                continue;
            }
            let truth = plant.truth();
            let now = (
                truth.com_vel + Vector3::z() * GRAVITY * truth.time_s,
                angular_momentum(robot, truth),
            );
            let (velocity, spin) = *start.get_or_insert(now);
            gained[0] = gained[0].max(robot.mass() * (now.0 - velocity).norm());
            gained[1] = gained[1].max((now.1 - spin).norm());
            let [left, right] =
                [&truth.soles.left, &truth.soles.right].map(|sole| sole.translation.vector);
            apart_m = apart_m.min((truth.trunk.rotation.inverse() * (left - right)).y);
            innermost_rad = innermost_rad.min(truth.posture.q[joints[0]]);
            if let Some(meeting) = truth.meeting {
                assert_eq!(meeting.of_legs, of_legs);
                pairs.push(meeting.links.map(|link| robot.links[link].name.as_str()));
            }
            assert_eq!(truth.contact_force, Vector3::zeros());
            assert_eq!(
                truth.sole_wrenches.left.force.norm() + truth.sole_wrenches.right.force.norm(),
                0.0
            );
        }
        pairs.dedup();
        println!(
            "{driven:?}: {apart_m:.4} m, {innermost_rad:.3} rad, gained {gained:.5?}, {pairs:?}"
        );
        assert!(!pairs.is_empty(), "{driven:?} met nothing");
        assert!(
            gained[0] < 1e-2 && gained[1] < 2e-3,
            "{gained:?} N s and N m s out of nothing"
        );
        if of_legs {
            assert!(
                apart_m > 0.05,
                "the soles passed through each other: {apart_m} m"
            );
        } else {
            assert!(
                innermost_rad > -0.3,
                "the arm is in the trunk: {innermost_rad} rad"
            );
        }
    }
}
