//! Laws of a push by a pendulum.

use crate::common::{Bench, config};
use nalgebra::Vector3;
use rayon::prelude::*;
use standfast_sim::episode::{self, Disturbance, EpisodeConfig, Outcome, Record, Tick, Until};
use standfast_sim::pendulum::check_at_home;
use standfast_sim::{Bob, Profile, Push};

const BOB: Bob = Bob {
    mass_kg: 1.0,
    rope_m: 1.75,
    radius_m: 0.08,
    stiffness_n_m: 9e4,
    restitution: 0.5,
};

/// A push by `bob`, drawn back by `draw_m`.
fn swung(bob: Bob, draw_m: f64, heading_deg: f64, height_m: f64) -> Push {
    Push {
        impulse_n_s: bob.momentum_n_s(draw_m),
        heading_deg,
        height_m,
        duration_s: 0.02,
        bob: Some(bob),
        ..Push::default()
    }
}

fn run(
    bench: &Bench,
    push: Push,
    config: &EpisodeConfig,
    observe: &mut dyn FnMut(&Tick),
) -> Record {
    let disturbance = Disturbance {
        pushes: vec![push],
        ..Disturbance::default()
    };
    let (robot, factory) = (&bench.robot, &bench.factory);
    episode::run(robot, factory, config, disturbance, Until::Decided, observe).unwrap()
}

/// Whatever the physics step, the robot gets what the bob loses while it touches; the rope hangs almost straight then.
#[test]
fn momentum_goes_from_the_bob_to_the_robot() {
    let bench = Bench::new("hold");
    for (mass_kg, draw_m, heading_deg, physics_step_s) in [
        (1.0, 0.2, 0.0, 0.002),
        (1.0, 0.5, 90.0, 0.001),
        (3.0, 0.3, 180.0, 0.002),
        (3.0, 1.0, 0.0, 0.0005),
    ] {
        let config = EpisodeConfig {
            physics_step_s,
            ..config(0.6)
        };
        let push = swung(Bob { mass_kg, ..BOB }, draw_m, heading_deg, 0.0);
        let (mut on_robot, mut left_n_s, mut touched, mut parted) =
            (Vector3::zeros(), push.impulse_n_s, false, false);
        let record = run(&bench, push, &config, &mut |tick| {
            let force = tick.truth.push_force;
            parted |= touched && force == Vector3::zeros();
            touched |= force != Vector3::zeros();
            if touched && !parted {
                on_robot += force * config.control_period_s;
                let strike = tick.truth.strike.as_ref().unwrap();
                left_n_s = strike.momentum_n_s().unwrap();
            }
        });
        let [gained, lost] = [on_robot.dot(&push.direction()), push.impulse_n_s - left_n_s];
        println!(
            "{mass_kg} kg, {draw_m} m: {gained} of {lost} N s: {:?}",
            record.totals
        );
        assert!(parted && lost > 0.3 * push.impulse_n_s, "{gained} {lost}");
        assert!(
            (gained / lost - 1.0).abs() < 5e-3,
            "{gained} N s of {lost} N s"
        );
    }
}

/// A force with the impulse and the width of a strike topples the robot at the same impulse.
#[test]
fn a_pendulum_is_as_hard_as_the_force_that_it_makes() {
    let bench = Bench::new("hold");
    let config = config(3.0);
    let record = |push| run(&bench, push, &config, &mut |_| {});
    // The hardest push of a kind from which the robot recovers, to 1 % of the range.
    let hardest = |[least, most]: [f64; 2], push: &dyn Fn(f64) -> Push| {
        let [mut held, mut lost] = [least, most];
        for _ in 0..7 {
            let middle = 0.5 * (held + lost);
            match record(push(middle)).outcome {
                Outcome::Recovered => held = middle,
                _ => lost = middle,
            }
        }
        assert!(held > least && lost < most, "{held} {lost}");
        held
    };
    // Where it strikes a flat face of the trunk, on which forces act.
    [(0.0, 0.06), (180.0, 0.1)].par_iter().for_each(|&(heading_deg, height_m)| {
        let by_bob = |draw_m| swung(BOB, draw_m, heading_deg, height_m);
        let draw_m = hardest([0.4, 1.0], &by_bob);
        let totals = record(by_bob(draw_m)).totals;
        let [by_bob_n_s, width_s] =
            ["bob_impulse_n_s", "bob_width_s"].map(|name| totals.get(name).unwrap());
        // Half a sine has half of its height or more for two thirds of its time.
        let by_force_n_s = hardest([1.0, 2.5], &|impulse_n_s| Push {
            impulse_n_s,
            heading_deg,
            height_m,
            duration_s: 1.5 * width_s,
            profile: Profile::HalfSine,
            ..Push::default()
        });
        println!("{heading_deg}, {height_m}: {draw_m} m, {by_bob_n_s} {by_force_n_s} N s, {width_s} s");
        assert!(
            (by_bob_n_s / by_force_n_s - 1.0).abs() < 0.05,
            "{heading_deg} degrees: {by_bob_n_s} N s by a bob, {by_force_n_s} N s by a force"
        );
    });
}

#[test]
fn a_bob_that_does_not_come_freely_is_refused_with_the_heights_that_will_do() {
    let robot = Bench::new("hold").robot;
    let refused = |bob: Bob, draw_m: f64, height_m: f64| {
        let push = swung(bob, draw_m, 0.0, height_m);
        check_at_home(&robot, &push, &bob).map_err(|[problem, accepted]| problem + "; " + &accepted)
    };
    assert_eq!(refused(BOB, 0.5, 0.0), Ok(()));
    let large = Bob {
        radius_m: 0.5,
        ..BOB
    };
    for (bob, draw_m, height_m, words) in [
        (BOB, 0.5, 1.0, "the bob passes ut-mu2 by; a height from"),
        (BOB, 0.5, -0.29, "the bob touches the ground; a height from"),
        (large, 0.5, 0.0, "the bob touches the ground; a height from"),
    ] {
        let told = refused(bob, draw_m, height_m).unwrap_err();
        assert!(told.starts_with(words), "{told}");
    }
}
