//! A robot at rest on ground that is not level, and with feet that are not at home. Sensors are ideal.

use crate::common::{Bench, account, config, push};
use nalgebra::Isometry2;
use rayon::prelude::*;
use standfast_core::control::estimate::heading;
use standfast_sim::episode::{self, Disturbance, Outcome, Tick, Until};
use standfast_sim::{Push, Variation};

/// A body that takes its footholds as level would lean against the slope and walk off.
#[test]
fn on_a_slope_the_robot_stands_as_at_home() {
    let benches = ["switching", "paper", "catch"].map(Bench::new);
    let slopes = [
        (0.0, 4.0, 0.004),
        (0.0, 5.0, 0.0),
        (90.0, 5.0, 0.005),
        (180.0, 4.0, -0.004),
        (-135.0, 5.0, 0.0),
    ];
    slopes.par_iter().with_max_len(1).for_each(|&(heading_deg, slope_deg, step_m)| {
        let variation = Variation {
            slope_deg: Some(slope_deg),
            slope_heading_deg: Some(heading_deg),
            ground_step_m: Some(step_m),
            ..Variation::default()
        };
        for bench in &benches {
            let disturbance = Disturbance { variation, ..Disturbance::default() };
            let mut least = f64::INFINITY;
            let record =
                episode::run(&bench.robot, &bench.factory, &config(2.0), disturbance, Until::Horizon, &mut |tick| {
                    least = least.min(account(tick).margin)
                })
                .unwrap();
            let name = &bench.design().family.gains.last().unwrap().name;
            println!("gain {name}, {slope_deg} degrees towards {heading_deg}: {:?}, margin {least:.2}", record.outcome);
            assert!(record.outcome == Outcome::Recovered && record.footsteps.taken.is_empty(), "{record:?}");
            assert!(least > 0.2, "gain {name}, {slope_deg} degrees towards {heading_deg}: margin {least}");
        }
    });
}

/// Distance of the feet from their places at home beside each other (m), and the angle between them (rad).
fn from_home(bench: &Bench, tick: &Tick) -> [f64; 2] {
    let [left, right] = [&tick.truth.soles.left, &tick.truth.soles.right];
    let frame = Isometry2::new(right.translation.vector.xy(), heading(right));
    let place = frame.inverse_transform_point(&left.translation.vector.xy().into());
    let home = bench.robot.home_posture();
    let kinematics = standfast_core::robot::Kinematics::at(&bench.robot, &home);
    let [left_home, right_home] =
        standfast_core::robot::Foot::BOTH.map(|foot| kinematics.sole_pose(&bench.robot, foot));
    let apart = (left_home.translation.vector - right_home.translation.vector).xy();
    [
        (place.coords - apart).norm(),
        (heading(left) - heading(right)).abs(),
    ]
}

/// After footsteps, also with crossed legs, the feet go back beside each other, and the next push finds the same stance
/// as the first one.
#[test]
fn a_robot_at_rest_walks_home_and_takes_the_same_push_again() {
    let bench = Bench::new("catch");
    let pushes = [
        (5.0, 0.0),
        (6.0, 45.0),
        (4.5, 90.0),
        (6.0, 135.0),
        (7.0, 180.0),
    ];
    pushes.par_iter().with_max_len(1).for_each(|&(impulse, heading_deg)| {
        let first = push(impulse, heading_deg);
        let again = Push { start_s: 8.0, ..first };
        let (mut at_rest, mut before_push) = (None, None);
        let record = bench.run(vec![first, again], None, 12.0, Until::Decided, |tick| {
            // The standing time of the judge is over before the feet move.
            if (tick.truth.time_s - 1.7).abs() < 1e-6 {
                at_rest = Some((from_home(&bench, tick), tick.report.phase.to_string()));
            }
            if (tick.truth.time_s - again.start_s).abs() < 1e-6 {
                before_push = Some(from_home(&bench, tick));
            }
        });
        let ([caught_m, _], phase) = at_rest.unwrap();
        let [home_m, turned_rad] = before_push.unwrap();
        println!(
            "{impulse} N s at {heading_deg}: {:.1} mm, at home {:.1} mm, {turned_rad:.3} rad, {:?} after {} footsteps",
            1e3 * caught_m,
            1e3 * home_m,
            record.outcome,
            record.footsteps.taken.len()
        );
        assert!(caught_m > 0.03 && phase == "switching", "{impulse} N s at {heading_deg}: {caught_m}");
        assert!(home_m < 0.01 && turned_rad < 0.1, "{impulse} N s at {heading_deg}: {home_m} m, {turned_rad} rad");
        assert_eq!(record.outcome, Outcome::Recovered, "{impulse} N s at {heading_deg}: {record:?}");
    });
}

/// A push that meets the robot anywhere on its walk home is caught, too.
#[test]
fn a_push_on_the_way_home_is_caught() {
    let bench = Bench::new("catch");
    let cases: Vec<_> = (0..12)
        .flat_map(|k| [0.0, 90.0, 180.0, -90.0].map(|heading| (2.0 + 0.2 * f64::from(k), heading)))
        .collect();
    cases
        .par_iter()
        .with_max_len(1)
        .for_each(|&(start_s, heading_deg)| {
            let second = Push {
                start_s,
                ..push(2.0, heading_deg)
            };
            let record = bench.run(
                vec![push(5.0, 0.0), second],
                None,
                16.0,
                Until::Fallen,
                |_| {},
            );
            println!(
                "at {start_s:.1} s towards {heading_deg}: {:?}",
                record.outcome
            );
            assert_eq!(
                record.outcome,
                Outcome::Recovered,
                "at {start_s} s towards {heading_deg}: {record:?}"
            );
        });
}
