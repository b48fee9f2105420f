//! Bounded disturbances of the pendulum, for CPI sets that hold on robots that differ from it.
//!
//! A disturbance w shifts the ZMP at which the ground acts: `com_acc = omega^2 (com - zmp - w)`. It stands for all that
//! the pendulum leaves out: an unknown place of the COM, a ZMP that does not follow, moving limbs, a delay, noise. Only
//! a bound for each axis is known of w; w may be constant or change at every tick.
//!
//! A gain responds to the effects of the disturbances, so that the ZMP j periods ahead is the predicted one plus a sum
//! over the disturbances until then. The largest value of this sum is the [`Spread`]. The ZMP stays inside the support
//! for all disturbances if the predicted one stays inside the support less the spread. This gives the maximal robust
//! CPI set (E. G. Gilbert and K. T. Tan, Linear systems with state and control constraints, IEEE Trans. Automatic
//! Control 36(9), 1991; I. Kolmanovsky and E. G. Gilbert, Theory and computation of disturbance invariant sets for
//! discrete-time linear systems, Mathematical Problems in Engineering 4, 1998, eq. 5.1 and theorem 6.3).

use super::axis_loop::AxisLoop;
use super::pendulum::Pendulum;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Periods after which the sum of a spread is replaced by its bound, which makes the set a little too small.
const MAX_PERIODS: usize = 20_000;
/// Remainder at which the sum ends (m per m of disturbance).
const NEGLIGIBLE: f64 = 1e-13;

/// Bound of the disturbance of the ZMP in a file, in half sole lengths: one number for both axes, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number or two, [x, y], in half sole lengths")]
pub enum ZmpDisturbance {
    Both(f64),
    Each([f64; 2]),
}

impl Default for ZmpDisturbance {
    fn default() -> Self {
        Self::Both(0.0)
    }
}

impl ZmpDisturbance {
    /// The bounds of both axes, in half sole lengths.
    pub fn bounds(self) -> Vector2<f64> {
        match self {
            Self::Both(bound) => Vector2::new(bound, bound),
            Self::Each([x, y]) => Vector2::new(x, y),
        }
    }

    /// Whether there is no disturbance.
    pub fn is_none(&self) -> bool {
        self.bounds() == Vector2::zeros()
    }

    /// The text of the value in a file, times `factor`.
    pub(super) fn text(self, factor: f64) -> String {
        match self {
            Self::Both(bound) => format!("{:.4}", bound * factor),
            Self::Each([x, y]) => format!("[{:.4}, {:.4}]", x * factor, y * factor),
        }
    }
}

/// Largest distance by which disturbances can have moved the ZMP of a closed loop, for each number of periods.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spread {
    /// In x and y (m); the last value is the limit. Empty without disturbances.
    after: Vec<[f64; 2]>,
}

impl Spread {
    /// The spread of a closed loop under disturbances of at most `bounds` (m).
    pub fn new(pendulum: &Pendulum, x: &AxisLoop, y: &AxisLoop, bounds: Vector2<f64>) -> Self {
        if bounds == Vector2::zeros() {
            return Self::default();
        }
        let [x, y] = [x, y].map(|axis| per_metre(pendulum, axis));
        let sum = |sums: &[f64], periods: usize| sums[periods.min(sums.len() - 1)];
        let after = (0..x.len().max(y.len()))
            .map(|j| [bounds.x * sum(&x, j), bounds.y * sum(&y, j)])
            .collect();
        Self { after }
    }

    /// Whether there are no disturbances.
    pub fn is_none(&self) -> bool {
        self.after.is_empty()
    }

    /// Largest distance by which the ZMP can have moved after this number of periods, in x and y (m).
    pub fn after(&self, periods: usize) -> [f64; 2] {
        self.after
            .get(periods)
            .copied()
            .unwrap_or_else(|| self.limit())
    }

    /// Largest distance by which disturbances can ever have moved the ZMP, in x and y (m).
    pub fn limit(&self) -> [f64; 2] {
        self.after.last().copied().unwrap_or_default()
    }
}

/// Sums of `|C A^i E|` over i < j for j = 0, 1, ... (m per m), where A is the closed loop, E the effect of a
/// disturbance over a period, and C the row that gives the ZMP. The last value bounds all later ones.
fn per_metre(pendulum: &Pendulum, axis: &AxisLoop) -> Vec<f64> {
    let lags = axis.cascade(pendulum, &axis.observable_poles());
    let mut state = pendulum.disturbance();
    let (mut sum, mut sums) = (0.0, vec![0.0]);
    loop {
        // The loop is a cascade of lags (see `online`), and the sum over the output of a lag is at most its present
        // value / (1 - l) plus the sum over its input.
        let rest: f64 = lags
            .iter()
            .map(|(lag, output)| (output * state)[0].abs() / (1.0 - lag))
            .sum();
        if rest < NEGLIGIBLE || sums.len() > MAX_PERIODS {
            sums.push(sum + rest);
            return sums;
        }
        sum += state[2].abs();
        sums.push(sum);
        state = axis.closed * state;
    }
}

#[cfg(test)]
mod tests {
    use super::super::gains::{Gain, GainPoles};
    use super::super::testing::PENDULUM;
    use super::*;

    fn spread(poles: [f64; 3], bounds: [f64; 2]) -> (Gain, Spread) {
        let gain = Gain::design(
            &PENDULUM,
            &GainPoles {
                name: "g".into(),
                x: poles,
                y: poles,
            },
        );
        let spread = Spread::new(&PENDULUM, &gain.x, &gain.y, bounds.into());
        (gain, spread)
    }

    #[test]
    fn a_constant_disturbance_moves_the_zmp_as_far_as_any_with_real_poles_p_1_q() {
        // In continuous time the ZMP goes to -(1 + p) (1 + q) / (p q) of the disturbance.
        for (p, q) in [(0.15, 5.0), (1.2, 5.0), (0.8, 10.0)] {
            let (gain, spread) = spread([p, 1.0, q], [0.002, 0.001]);
            let (mut state, bound) = (nalgebra::Vector3::<f64>::zeros(), 0.002);
            for j in 0..20_000 {
                assert!((state[2].abs() - spread.after(j)[0]).abs() < 1e-12, "{j}");
                state = gain.x.closed * state + PENDULUM.disturbance() * bound;
            }
            let factor = (1.0 + p) * (1.0 + q) / (p * q);
            assert!(
                (spread.limit()[0] / bound - factor).abs() < 0.02 * factor,
                "{p} {q}: {:?}",
                spread.limit()
            );
            assert!((spread.limit()[1] - 0.5 * spread.limit()[0]).abs() < 1e-15);
        }
    }

    #[test]
    fn a_very_slow_pole_is_bounded_and_no_disturbance_is_none() {
        let (_, slow) = spread([1e-5, 1.0, 5.0], [0.001; 2]);
        assert!(
            slow.limit()[0] >= 0.0012 / 1e-5 * 0.99,
            "{:?}",
            slow.limit()
        );
        let (_, none) = spread([1.2, 1.0, 5.0], [0.0; 2]);
        assert!(none.is_none() && none.limit() == [0.0; 2] && none.after(7) == [0.0; 2]);
    }
}
