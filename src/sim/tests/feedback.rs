//! The loop is closed through the sensors, after the robot's delay.

use crate::common::{Bench, push};
use rayon::prelude::*;
use standfast_core::socket::Command;
use standfast_sim::episode::Outcome;
use standfast_sim::{Engine, Plant, Push, plant::Clock};

const CLOCK: Clock = Clock {
    engine: Engine::Rapier,
    physics_step_s: 0.002,
    control_period_s: 0.002,
};

/// Whether the robot is upright and slow after 5 s if the readings of its sensors freeze at `freeze_s`.
fn stays_up(bench: &Bench, push: Push, freeze_s: f64) -> bool {
    let mut plant = Plant::new(bench.robot.clone(), CLOCK, None, bench.robot.home_command());
    let mut controller = bench.factory.start(0);
    let mut command = bench.robot.home_command();
    let mut sensed = plant.sense();
    for _ in 0..2500 {
        let now = plant.sense();
        if plant.truth().time_s < freeze_s {
            sensed = now;
        }
        controller.tick(&sensed, &mut command).unwrap();
        plant.advance(command.clone(), &[push]);
        if plant.truth().touching.is_some() {
            return false;
        }
    }
    plant.truth().tilt_rad() < 0.2 && plant.truth().com_vel.norm() < 0.02
}

/// Feedback is needed if stiffness is not enough. With ankles whose total stiffness is below m g h, a held posture is
/// an unstable pendulum. The robot recovers from a push with live sensors, and falls if the sensors freeze in the
/// middle of the push.
#[test]
fn frozen_sensors_lose_a_push_that_live_ones_recover_from() {
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    let needed = robot.weight_n() * robot.home_com_height();
    for (servo, joint) in robot.servos.iter_mut().zip(&robot.joints) {
        if joint.name.contains("ankle") {
            servo.kp = 0.2 * needed;
        }
    }
    let (live, held) = (
        Bench::with(robot.clone(), "switching"),
        Bench::with(robot, "hold"),
    );
    [0.5, 1.0, 2.0].par_iter().for_each(|&impulse| {
        let push = push(impulse, 0.0);
        assert_eq!(live.push(push).outcome, Outcome::Recovered, "{impulse} N s");
        assert!(stays_up(&live, push, f64::INFINITY), "{impulse} N s");
        assert_eq!(
            held.push(push).outcome,
            Outcome::Fell,
            "{impulse} N s without feedback"
        );
        for freeze_s in [0.53, 0.56] {
            assert!(
                !stays_up(&live, push, freeze_s),
                "{impulse} N s, frozen at {freeze_s} s"
            );
        }
    });
}

/// A command acts after the delay and not before. The first torque that differs is in the tick that contains
/// `round(delay / physics step)`.
#[test]
fn a_command_reaches_the_servos_after_the_delay() {
    let mut bench = Bench::new("hold");
    let home = bench.robot.home_command();
    let mut kicked = home.clone();
    kicked.tau_ff[0] += 0.5;
    // With two physics steps in a tick, and with one: (delay, tick with the first torque, share of that tick).
    let fine = [
        (0.0, 0, 1.0),
        (0.001, 0, 0.5),
        (0.004, 2, 1.0),
        (0.0052, 2, 0.5),
        (0.009, 4, 0.5),
    ];
    let coarse = [
        (0.0, 0, 1.0),
        (0.0009, 0, 1.0),
        (0.004, 2, 1.0),
        (0.0052, 3, 1.0),
    ];
    let halves = Clock {
        physics_step_s: 0.001,
        ..CLOCK
    };
    let all = fine
        .map(|case| (halves, case))
        .into_iter()
        .chain(coarse.map(|case| (CLOCK, case)));
    for (clock, (delay_s, tick, share)) in all {
        bench.robot.delay_s = delay_s;
        let torque = |command: &Command| -> Vec<f64> {
            let mut plant = Plant::new(bench.robot.clone(), clock, None, home.clone());
            (0..8)
                .map(|_| {
                    plant.advance(command.clone(), &[]);
                    plant.truth().tau[0]
                })
                .collect()
        };
        let (still, moved) = (torque(&home), torque(&kicked));
        let difference: Vec<f64> = moved.iter().zip(&still).map(|(a, b)| a - b).collect();
        let first = difference.iter().position(|d| d.abs() > 1e-9);
        assert_eq!(first, Some(tick), "delay {delay_s} s: {difference:?}");
        // The joint has hardly moved yet, so the torque is the commanded one, over its share of the tick.
        assert!(
            (difference[tick] - 0.5 * share).abs() < 0.2 * share,
            "delay {delay_s} s: {difference:?}"
        );
    }
    assert_eq!(crate::common::config(1.0).clock(), CLOCK);
}
