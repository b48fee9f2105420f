//! How hard a push must be to topple the robot, compared with another simulator and with common sense.

use crate::common::{Bench, push};
use rayon::prelude::*;
use standfast_sim::Push;
use standfast_sim::episode::{Outcome, Until};

/// Impulse between recovery and fall, to 0.02 N s, by bisection between 1.5 and 5 N s.
fn toppling_impulse(bench: &Bench, heading_deg: f64) -> f64 {
    let recovers = |impulse| bench.push(push(impulse, heading_deg)).outcome == Outcome::Recovered;
    let (mut stands, mut falls) = (1.5, 5.0);
    assert!(
        recovers(stands) && !recovers(falls),
        "at {heading_deg} degrees"
    );
    while falls - stands > 0.02 {
        let middle = 0.5 * (stands + falls);
        if recovers(middle) {
            stands = middle;
        } else {
            falls = middle;
        }
    }
    0.5 * (stands + falls)
}

/// A stiff robot topples as rigid body mechanics predicts, with any solver: MuJoCo gives the same impulses.
#[test]
fn a_robot_that_holds_its_posture_topples_as_in_mujoco() {
    let hold = Bench::new("hold");
    let mujoco = [(0.0, 2.7), (45.0, 3.75), (90.0, 3.9), (180.0, 2.5)];
    mujoco.par_iter().for_each(|&(heading, expected)| {
        let impulse = toppling_impulse(&hold, heading);
        println!("hold at {heading}: {impulse:.3} N s, MuJoCo {expected} N s");
        assert!(
            (impulse / expected - 1.0).abs() < 0.08,
            "at {heading}: {impulse} N s for {expected} N s"
        );
    });
}

/// A push that no robot survives, or that is NaN, ends with an outcome: without a panic, and without a robot left
/// upright in the sky.
#[test]
fn absurd_pushes_are_outcomes() {
    let (switching, hold) = (Bench::new("switching"), Bench::new("hold"));
    let impulses = [1e2, 1e4, 1e8, 1e20, f64::INFINITY, f64::NAN];
    impulses.par_iter().for_each(|&impulse_n_s| {
        for bench in [&switching, &hold] {
            for (heading_deg, height_m) in [
                (0.0, 0.0),
                (100.0, 0.0),
                (0.0, 10.0),
                (100.0, 1.0),
                (100.0, 60.0),
            ] {
                let push = Push {
                    impulse_n_s,
                    heading_deg,
                    height_m,
                    ..Push::default()
                };
                let record = bench.run(vec![push], None, 1.0, Until::Horizon, |_| {});
                println!(
                    "{impulse_n_s} N s: {:?} at {} s, {:?}",
                    record.outcome, record.end_s, record.fall_cause
                );
                assert!(
                    matches!(record.outcome, Outcome::Fell | Outcome::Diverged),
                    "{impulse_n_s} N s: {record:?}"
                );
            }
        }
    });
}
