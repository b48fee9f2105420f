//! The same episode gives the same bits.

use crate::common::parts::rows;
use crate::common::program::{SEVERAL_PARTS, files, folder, standfast};
use crate::common::{Bench, engine, push, sensor_errors};
use nalgebra::Vector3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use standfast::core::robot::{Foot, PerFoot};
use standfast::report::trace::Trace;
use standfast::sim::episode::Until;

/// Hash of every number of every tick (truth, estimate, command) and of the record.
fn fingerprint(bench: &Bench, seed: u64) -> Vec<u8> {
    let mut hash = Sha256::new();
    let mut trace = Trace::new(&bench.robot);
    let record = bench.run(
        vec![push(2.0, 30.0)],
        Some(sensor_errors(seed)),
        1.5,
        Until::Horizon,
        |tick| {
            trace.push(tick);
            let truth = tick.truth;
            let numbers = truth
                .velocity
                .iter()
                .chain(&tick.command.dq_ref)
                .chain(&tick.command.tau_ff);
            numbers.for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        },
    );
    hash.update(format!("{record:?}{:?}", trace.columns()));
    hash.finalize().to_vec()
}

/// A simulation is a function of its arguments, to the bit, whether it runs alone or in parallel.
#[test]
fn an_episode_repeats_to_the_bit_in_every_thread() {
    let bench = Bench::new("switching");
    let first = fingerprint(&bench, 1);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(4)
        .build()
        .unwrap();
    let others: Vec<Vec<u8>> = pool.install(|| {
        (0..6)
            .into_par_iter()
            .map(|_| fingerprint(&bench, 1))
            .collect()
    });
    assert!(
        others.iter().all(|other| *other == first),
        "{first:?} and {others:?}"
    );
    assert_ne!(fingerprint(&bench, 2), first);
}

/// Controllers that run together, and trials that continue from a shared beginning, have the same records as episodes
/// that run alone: with noise, on a slope, with pushes that need no footstep, with pushes that need some, and with
/// pushes that topple the robot.
#[test]
fn episodes_that_share_a_robot_are_the_same_bits() {
    use standfast::sim::episode::{self, ClosedLoop, Disturbance};
    use standfast::sim::{Push, Variation};
    let names = ["hold", "switching", "paper", "catch", "fixed"];
    let benches = names.map(Bench::new);
    let (robot, config) = (&benches[0].robot, crate::common::config(3.0));
    let variation = Variation {
        slope_deg: Some(1.0),
        delay_s: Some(0.005),
        ..Variation::default()
    };
    let pushed = |impulse_n_s, heading_deg| {
        vec![Push {
            start_s: 0.7,
            ..push(impulse_n_s, heading_deg)
        }]
    };
    let disturbance = |pushes: &[Push]| Disturbance {
        pushes: pushes.to_vec(),
        sensor_errors: Some(sensor_errors(3)),
        variation,
        seed: 0,
    };
    let start = |pushes: &[Push]| {
        let factories = benches.iter().map(|bench| &bench.factory);
        ClosedLoop::new(robot, factories, &config, disturbance(pushes))
    };
    let shared = start(&pushed(1.0, 0.0)).before(0.7);
    let mut outcomes = Vec::new();
    for (impulse_n_s, heading_deg) in [(1.0, 0.0), (4.0, 170.0), (2.8, 80.0), (5.0, 10.0)] {
        let pushes = pushed(impulse_n_s, heading_deg);
        let alone = |bench: &Bench| {
            let until = config.until();
            episode::run(
                robot,
                &bench.factory,
                &config,
                disturbance(&pushes),
                until,
                &mut |_| {},
            )
            .unwrap()
        };
        let alone: Vec<String> = benches
            .iter()
            .map(|bench| format!("{:?}", alone(bench)))
            .collect();
        let told = |closed_loop: ClosedLoop| {
            closed_loop
                .finish()
                .unwrap()
                .iter()
                .map(|record| format!("{record:?}"))
                .collect::<Vec<_>>()
        };
        assert_eq!(told(start(&pushes)), alone, "{impulse_n_s} N s");
        assert_eq!(
            told(shared.with(&[0, 1, 2, 3, 4], pushes.clone()).unwrap()),
            alone,
            "{impulse_n_s} N s"
        );
        assert_eq!(
            told(shared.with(&[1, 3], pushes).unwrap()),
            [alone[1].clone(), alone[3].clone()],
            "{impulse_n_s} N s"
        );
        outcomes.extend(alone);
    }
    for word in ["outcome: Fell", "outcome: Recovered", "taken: [Footstep"] {
        assert!(
            outcomes.iter().any(|record| record.contains(word)),
            "{word}"
        );
    }
}

/// Errors of all sensors at every tick: the readings less the true values.
fn errors_seen(gains: &str) -> Vec<Vec<f64>> {
    use standfast::sim::{Plant, plant::Clock};
    let bench = Bench::new(gains);
    let clock = Clock {
        engine: engine(),
        physics_step_s: 0.001,
        control_period_s: 0.002,
    };
    let plant = |errors| {
        Plant::new(
            bench.robot.clone(),
            clock,
            errors,
            bench.robot.home_command(),
        )
    };
    // The twin without errors gets the same commands, so it shows the true values.
    let (mut noisy, mut ideal) = (plant(Some(sensor_errors(5))), plant(None));
    let mut controller = bench.factory.start(0);
    let mut command = bench.robot.home_command();
    let mut seen = Vec::new();
    for _ in 0..400 {
        let (read, truth) = (noisy.sense(), ideal.sense());
        let joints = read
            .q
            .iter()
            .zip(&truth.q)
            .chain(read.dq.iter().zip(&truth.dq));
        let mut errors: Vec<f64> = joints.map(|(a, b)| a - b).collect();
        let turned = (truth.imu.orientation.inverse() * read.imu.orientation).scaled_axis();
        let soles = PerFoot::from_fn(|foot| {
            let (a, b) = (&read.soles[foot], &truth.soles[foot]);
            [a.force - b.force, a.moment - b.moment]
        });
        let imu = [
            turned,
            read.imu.gyro - truth.imu.gyro,
            read.imu.accelerometer - truth.imu.accelerometer,
        ];
        let all = imu
            .iter()
            .chain(Foot::BOTH.iter().flat_map(|&foot| &soles[foot]));
        errors.extend(all.flat_map(Vector3::iter));
        seen.push(errors);
        controller.tick(&read, &mut command).unwrap();
        let pushes = [push(2.5, 30.0)];
        noisy.advance(command.clone(), &pushes);
        ideal.advance(command.clone(), &pushes);
    }
    seen
}

/// Controllers are compared on the same trials, so the error of a sensor at a tick must not depend on the controller.
#[test]
fn sensor_errors_do_not_depend_on_the_controller() {
    let (switching, hold) = (errors_seen("switching"), errors_seen("hold"));
    assert_eq!(switching[0].len(), 2 * 20 + 3 * 3 + 2 * 6);
    for (tick, (a, b)) in switching.iter().zip(&hold).enumerate() {
        for (sensor, (a, b)) in a.iter().zip(b).enumerate() {
            assert!(
                (a - b).abs() < 1e-9,
                "tick {tick}, number {sensor}: {a} and {b}"
            );
        }
    }
    // The errors are noise: no two ticks have the same errors.
    assert!((1..switching.len()).all(|k| switching[k] != switching[k - 1]));
}

/// If all that a campaign can draw is varied, and the campaign has several parts, the result is the same for any number
/// of threads.
#[test]
fn a_campaign_that_varies_everything_is_the_same_bytes_for_any_number_of_threads() {
    let result = |threads: &str| {
        let dir = folder();
        let short = [
            "--set=episode.horizon_s=2.4",
            "--set=second_push.after_s={uniform=[0.1, 0.25]}",
        ];
        let args = [
            &[
                "run",
                "harsh",
                "--controller=hold",
                SEVERAL_PARTS,
                "--out=out",
                threads,
            ][..],
            &short,
        ]
        .concat();
        standfast(dir.path(), &args).success();
        let row = rows(&dir.path().join("out/parts/part-000000.parquet")).remove(0);
        (files(&dir.path().join("out")), row)
    };
    let (one, row) = result("--threads=1");
    assert!(
        row["second_impulse_n_s"].is_number()
            && row["ground_step_m"].is_number()
            && row["outcome"] == "Fell",
        "{row:?}"
    );
    assert!(
        one == result("--threads=2").0,
        "two threads wrote something else"
    );
}
