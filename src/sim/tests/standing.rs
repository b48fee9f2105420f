//! Standing still in the simulated physics.

use crate::common::{Bench, sensor_errors};
use nalgebra::{Point2, Point3};
use rayon::prelude::*;
use standfast_sim::SensorErrors;
use standfast_sim::episode::{Outcome, Until};

/// Quantities from some seconds of standing.
#[derive(Debug)]
struct Standing {
    outcome: Outcome,
    /// Mean vertical contact force divided by m g, over the whole time and after the first half second.
    weight_ratio: [f64; 2],
    /// Smallest distance of the ZMP from the edge of the soles.
    zmp_margin_m: f64,
    /// Largest distance of the COM from its start, and mean distance over the last second.
    com_drift_m: f64,
    com_offset_m: f64,
}

fn stand(bench: &Bench, errors: Option<SensorErrors>, horizon_s: f64) -> Standing {
    let (mut forces, mut zmp_margin_m, mut coms) =
        (Vec::new(), f64::INFINITY, Vec::<Point3<f64>>::new());
    let record = bench.run(vec![], errors, horizon_s, Until::Horizon, |tick| {
        let truth = tick.truth;
        coms.push(truth.com);
        // No contact has acted at time 0.
        if truth.time_s > 0.0 {
            forces.push(truth.contact_force.z);
            let [x, y] = truth.zmp.expect("the robot stands");
            let support = tick.support.expect("the robot stands");
            zmp_margin_m = zmp_margin_m.min(-support.signed_distance(Point2::new(x, y)));
        }
    });
    let weight = bench.robot.weight_n();
    let mean_ratio = |forces: &[f64]| forces.iter().sum::<f64>() / forces.len() as f64 / weight;
    let drift = |com: &Point3<f64>| (com - coms[0]).norm();
    let last_second = &coms[coms.len() - 500..];
    Standing {
        outcome: record.outcome,
        weight_ratio: [mean_ratio(&forces), mean_ratio(&forces[250..])],
        zmp_margin_m,
        com_drift_m: coms.iter().map(drift).fold(0.0, f64::max),
        com_offset_m: last_second.iter().map(drift).sum::<f64>() / last_second.len() as f64,
    }
}

/// A robot at rest: the ground carries m g and presses inside the soles, and the COM does not drift.
#[test]
fn a_standing_robot_weighs_m_g_and_stays() {
    ["switching", "fixed", "hold"].par_iter().for_each(|gains| {
        let seen = stand(&Bench::new(gains), None, 10.0);
        println!("{gains}: {seen:?}");
        assert_eq!(seen.outcome, Outcome::Recovered, "{gains}");
        for ratio in seen.weight_ratio {
            assert!((ratio - 1.0).abs() < 1e-3, "{gains}: {seen:?}");
        }
        assert!(seen.zmp_margin_m > 0.03, "{gains}: {seen:?}");
        assert!(seen.com_drift_m < 0.002, "{gains}: {seen:?}");
    });
}

/// Noise has zero mean and biases are small: with both the robot stands, and its COM stays in place to a few
/// millimetres.
#[test]
fn sensor_errors_do_not_fell_a_standing_robot() {
    [("switching", 1), ("switching", 2), ("switching", 3)]
        .par_iter()
        .for_each(|&(gains, seed)| {
            let seen = stand(&Bench::new(gains), Some(sensor_errors(seed)), 5.0);
            println!("{gains}, seed {seed}: {seen:?}");
            assert_eq!(seen.outcome, Outcome::Recovered, "{gains}, seed {seed}");
            assert!(
                (seen.weight_ratio[1] - 1.0).abs() < 1e-3,
                "{gains}, seed {seed}: {seen:?}"
            );
            // The bias alone moves the COM by 1.2 mm (root mean square over seeds).
            assert!(
                seen.com_drift_m < 0.004 && seen.com_offset_m < 0.003,
                "{gains}, seed {seed}: {seen:?}"
            );
        });
}
