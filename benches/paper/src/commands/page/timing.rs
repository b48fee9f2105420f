//! Measures the time to update the CPI sets to the new contact region after a landing, by the method of the controller
//! and by the method of the paper (eq. 25 with the stored Phi). Nothing else on the page depends on a clock.

use crate::render::page::study::Study;
use nalgebra::{DMatrix, Matrix2x6, Vector6};
use serde_json::{Value, json};
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::{Gain, OnlineSets};
use std::hint::black_box;
use std::time::Instant;

/// Update time that the paper states (ms).
const PAPER_MS: f64 = 0.15;
/// Number of updates that are timed.
const TIMES: usize = 4000;
/// Number of updates before the timed updates, which warm up the caches and the processor's clock.
const WARM_UP: usize = 200;

/// Median and 95th percentile of the time that `work` takes (ms), by a wall clock.
fn spread(mut work: impl FnMut()) -> Value {
    let mut times_ms: Vec<f64> = (0..WARM_UP + TIMES)
        .map(|_| {
            let start = Instant::now();
            work();
            1e3 * start.elapsed().as_secs_f64()
        })
        .skip(WARM_UP)
        .collect();
    times_ms.sort_by(f64::total_cmp);
    json!({ "median_ms": times_ms[TIMES / 2], "p95_ms": times_ms[TIMES * 95 / 100] })
}

/// Phi of eq. 24 and the matrix S of eq. 25, for one gain.
struct Stored {
    phi: Vec<Matrix2x6<f64>>,
    s: DMatrix<f64>,
}

impl Stored {
    fn new(gain: &Gain, horizon: usize, edges: usize) -> Self {
        let closed = gain.closed_loop();
        let mut row = Matrix2x6::zeros();
        (row[(0, 2)], row[(1, 5)]) = (1.0, 1.0);
        let phi: Vec<_> = std::iter::successors(Some(row), |row| Some(row * closed))
            .take(horizon + 1)
            .collect();
        Self {
            phi,
            s: DMatrix::zeros(edges * (horizon + 1), 6),
        }
    }

    /// Computes S for a contact region by eq. 25.
    fn update(&mut self, polygon: &SupportPolygon) {
        let edges = polygon.vertices().len();
        for (i, edge) in polygon.half_planes().enumerate() {
            let normal = (edge.normal / edge.distance).transpose();
            for (j, block) in self.phi.iter().enumerate() {
                self.s
                    .fixed_view_mut::<1, 6>(edges * j + i, 0)
                    .copy_from(&(normal * block));
            }
        }
    }

    /// The smallest `1 - row . x` over the rows of S, which is not negative inside of the CPI set.
    fn margin(&self, x: &Vector6<f64>) -> f64 {
        1.0 - (&self.s * x).max()
    }
}

/// Times of both methods, for the region and the state right after the first landing of the push from behind. `online`
/// is the time to update the controller's CPI sets and to ask each CPI set whether it holds the state; `stored_phi` is
/// the time to compute eq. 25 for all gains and to ask each matrix S the same question. Null if the origin of the
/// control frame is not inside of the region.
pub fn measure(study: &Study) -> Value {
    let (polygon, state, family) = (
        study.landed_allowed,
        study.pushes[0].landing.state,
        &study.design.family,
    );
    if polygon.half_planes().any(|edge| edge.distance <= 0.0) {
        return Value::Null;
    }
    let mut sets = OnlineSets::new(family);
    sets.update(&polygon);
    let held = sets.fastest_holding(&state);
    let online = spread(|| {
        sets.update(black_box(&polygon));
        for gain in 0..family.gains.len() {
            black_box(sets.holds(gain, black_box(&state)));
        }
    });
    let edges = polygon.vertices().len();
    let mut stored: Vec<Stored> = family
        .gains
        .iter()
        .zip(&study.sets)
        .map(|(gain, set)| Stored::new(gain, set.horizon, edges))
        .collect();
    let x = state.stacked();
    let stored_phi = spread(|| {
        for stored in &mut stored {
            stored.update(black_box(&polygon));
        }
        for stored in &stored {
            black_box(stored.margin(black_box(&x)) >= 0.0);
        }
    });
    let by_stored = stored.iter().rposition(|stored| stored.margin(&x) >= 0.0);
    let chosen = [held, by_stored].map(|gain| match gain {
        Some(i) => format!("gain {}", family.gains[i].name),
        None => "no gain".into(),
    });
    json!({
        "paper_ms": PAPER_MS, "repetitions": TIMES, "online": online, "stored_phi": stored_phi,
        "rows": stored.iter().map(|stored| stored.s.nrows()).sum::<usize>(),
        "gains": family.gains.len(), "chosen": chosen,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast::core::lipm::cpi_set::CpiSet;

    use standfast::core::lipm::{GainFamily, Pendulum};

    /// The timed computation gives the rows of eq. 25.
    #[test]
    fn the_stored_phi_gives_the_rows_of_the_stack() {
        let pendulum = Pendulum {
            omega: 5.63,
            dt: 0.002,
        };
        let family =
            GainFamily::design(&crate::gain_set("paper").unwrap(), pendulum, 0.048).unwrap();
        let polygon = SupportPolygon::rectangle(-0.05, 0.07, -0.08, 0.09).unwrap();
        for gain in &family.gains {
            let mut stored = Stored::new(gain, 20, 4);
            stored.update(&polygon);
            let stacked = CpiSet::stacked(gain, &polygon, 20).unwrap();
            assert!((&stored.s - &stacked.rows).amax() < 1e-9, "{}", gain.name);
            let x = Vector6::new(0.01, -0.1, 0.02, 0.0, 0.2, -0.03);
            assert!((stored.margin(&x) - stacked.margin(x.as_slice())).abs() < 1e-9);
        }
    }
}
