//! The closed loop of one axis (eq. 11-13): its poles, its feedback, and its form as a cascade of first-order lags.

use super::pendulum::Pendulum;
use nalgebra::{Matrix3, RowVector3, Vector3};

/// One axis of the closed loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLoop {
    /// The poles as multiples of -omega.
    pub poles: [f64; 3],
    /// Feedback vector f of eq. 12, which acts on [com, com_vel, zmp]; its units are 1/s, 1, 1/s.
    pub feedback: Vector3<f64>,
    /// Diagonal block of eq. 13, which acts on [com, com_vel, zmp].
    pub closed: Matrix3<f64>,
}

impl AxisLoop {
    /// Places the poles, which must be positive.
    pub fn design(pendulum: &Pendulum, poles: [f64; 3]) -> Self {
        let feedback = pendulum.feedback(poles);
        Self {
            poles,
            feedback,
            closed: pendulum.closed(&feedback),
        }
    }

    /// The poles that affect the ZMP. If a pole is exactly at -omega, the feedback does not read the convergent mode.
    pub(super) fn observable_poles(&self) -> Vec<f64> {
        let mut poles = self.poles.to_vec();
        if let Some(i) = poles.iter().position(|p| *p == 1.0) {
            poles.remove(i);
        }
        poles
    }

    /// The observable part of the loop as a cascade of first-order lags, one for each pole in `through`, which must
    /// include the loop's own observable poles. For each lag it gives the discrete pole l and the row that maps [com,
    /// com_vel, zmp] to the output of the lag. The output of the last lag is the ZMP. Lags before the first of the
    /// loop's own poles have the output 0.
    pub(super) fn cascade(
        &self,
        pendulum: &Pendulum,
        through: &[f64],
    ) -> Vec<(f64, RowVector3<f64>)> {
        let mut own = self.observable_poles();
        let mut row = RowVector3::new(0.0, 0.0, 1.0);
        let mut cascade = Vec::with_capacity(through.len());
        for pole in through.iter().rev() {
            let lag = pendulum.discrete_pole(*pole);
            cascade.push((lag, row));
            row = row * (self.closed - Matrix3::identity() * lag) / (1.0 - lag);
            if let Some(i) = own.iter().position(|p| p == pole) {
                own.swap_remove(i);
            }
            if own.is_empty() {
                // This is exactly zero by Cayley-Hamilton, apart from rounding.
                row = RowVector3::zeros();
            }
        }
        cascade.reverse();
        cascade
    }
}
