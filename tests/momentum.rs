//! Newton's second law for the whole robot.

mod common;

use common::{Bench, config, push};
use nalgebra::{Point2, Vector3};
use rayon::prelude::*;
use standfast::episode::{self, Disturbance, EpisodeConfig, Until, support_on_ground};
use standfast::robot::GRAVITY;
use standfast::sim::{PhysicsStep, Profile, Push};

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
        let mut course =
            Course { time_s: vec![], momentum: vec![], received: vec![], pushed: Vector3::zeros(), fell: false };
        let mut sum = Vector3::zeros();
        let disturbance = Disturbance { pushes, ..Disturbance::default() };
        let record = episode::run(&bench.robot, &bench.design, &config, disturbance, Until::Horizon, &mut |tick| {
            let truth = tick.truth;
            // Forces are averages over the past tick, so there are none at time 0.
            if truth.time_s > 0.0 {
                sum += (truth.contact_force + truth.push_force - Vector3::z() * mass * GRAVITY) * dt;
                course.pushed += truth.push_force * dt;
            }
            course.time_s.push(truth.time_s);
            course.momentum.push(truth.com_vel * mass);
            course.received.push(sum);
        });
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
            .fold((0.0, 0.0), |worst, next| if next.0 > worst.0 { next } else { worst })
    }

    /// The largest residual between the start and any row.
    fn worst_from_start(&self) -> f64 {
        (1..self.time_s.len()).map(|i| self.residual(0, i)).fold(0.0, f64::max)
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
        ("switching, half sine", &switching, Push { profile: Profile::HalfSine, duration_s: 0.1, ..at(2.0, 90.0) }),
        ("switching, 0.05 m high", &switching, Push { height_m: 0.05, ..at(1.5, 180.0) }),
        ("hold, 2 N s forward", &hold, at(2.0, 0.0)),
    ];
    cases.par_iter().for_each(|(name, bench, push)| {
        let course = Course::of(bench, vec![*push], config(3.0));
        let (window, at_s) = course.worst_window();
        let whole = course.worst_from_start();
        println!("{name}: {window:.5} N s in 0.1 s from {at_s:.2} s, {whole:.5} N s from the start");
        assert!(!course.fell, "{name}");
        assert!(window < 0.05 && whole < 0.05, "{name}: {window} N s in 0.1 s, {whole} N s in all");
        let asked = push.direction() * push.impulse_n_s;
        assert!((course.pushed - asked).norm() < 1e-6 * push.impulse_n_s, "{name}: {} delivered", course.pushed);
    });
}

/// A body that hits the ground obeys the law too, with the contacts of all links. The integrator is of first order, so
/// the residual decreases with its step.
#[test]
fn what_a_fall_leaves_over_goes_down_with_the_step() {
    let hold = Bench::new("hold");
    let left_over = |physics_step_s| {
        let course = Course::of(
            &hold,
            vec![push(4.0, 0.0)],
            EpisodeConfig { physics_step_s: PhysicsStep::all(physics_step_s), ..config(1.5) },
        );
        assert!(course.fell);
        (1..course.time_s.len()).map(|i| course.residual(i - 1, i)).sum::<f64>()
    };
    let steps = [0.001, 0.0005, 0.00025];
    let sums: Vec<f64> = steps.par_iter().map(|&step| left_over(step)).collect();
    println!("sum of what ticks leave over: {sums:.4?} N s at {steps:?} s");
    assert!(sums[0] < 0.2 && sums[1] < 0.7 * sums[0] && sums[2] < 0.7 * sums[1], "{sums:?} N s");
}

/// Forces add: two pushes at once deliver the sum of their impulses.
#[test]
fn pushes_at_the_same_time_add_up() {
    let course = Course::of(&Bench::new("switching"), vec![push(1.0, 0.0), push(1.0, 90.0)], config(1.0));
    assert!((course.pushed - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-6, "{}", course.pushed);
    assert!(course.worst_from_start() < 0.05);
}

/// The ground can only press, so the ZMP stays inside the soles. It moves to the side to which the robot is pushed.
#[test]
fn the_ground_presses_inside_the_soles_on_the_side_pushed_to() {
    let (switching, hold) = (Bench::new("switching"), Bench::new("hold"));
    let cases = [(&switching, 2.0, 0.0), (&switching, 2.0, 180.0), (&switching, 3.0, 90.0), (&hold, 2.0, -135.0)];
    cases.par_iter().for_each(|&(bench, impulse, heading)| {
        let push = push(impulse, heading);
        let (mut furthest, mut outside) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        bench.run(vec![push], None, 0.8, Until::Horizon, |tick| {
            let truth = tick.truth;
            let zmp = Point2::from(truth.zmp.expect("the robot stands"));
            if truth.time_s > 0.0 {
                let support = support_on_ground(&bench.robot, truth).expect("the robot stands");
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
