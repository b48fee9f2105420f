//! Kalman filter of the COM on the pendulum model (paper, Sect. VI.A: "we also apply Kalman Filter in order to filter
//! out the noise of sensors").
//!
//! One axis: the state is `[com, com_vel]`, the input the measured ZMP (eq. 1, 2), the measurement the COM from
//! kinematics. What the model does not know (a push above all) enters as an acceleration that is white noise. The
//! gains are those of the steady state, found once.

use crate::lipm::pendulum::Pendulum;
use nalgebra::{Matrix2, RowVector2, Vector2};

/// What the filter trusts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// Standard deviation of the measured COM (m).
    pub com_m: f64,
    /// Standard deviation of the acceleration that the model leaves out (m/s^2), one sample a tick.
    pub acceleration_m_s2: f64,
}

/// The filter of one axis.
#[derive(Debug, Clone)]
pub struct Kalman {
    transition: Matrix2<f64>,
    /// Effect of the input (the ZMP, or an acceleration) over a tick.
    input: Vector2<f64>,
    gain: Vector2<f64>,
    /// `[com, com_vel]` (m, m/s).
    pub state: Vector2<f64>,
}

impl Kalman {
    /// Horizontal axis: the input is the ZMP (m).
    pub fn horizontal(pendulum: &Pendulum, trust: Trust) -> Self {
        let a = pendulum.transition();
        let transition = Matrix2::new(a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]);
        Self::new(transition, Vector2::new(a[(0, 2)], a[(1, 2)]), pendulum.dt, trust)
    }

    /// Vertical axis: the input is the acceleration f_z / m - g (m/s^2) (eq. 3).
    pub fn vertical(dt: f64, trust: Trust) -> Self {
        Self::new(Matrix2::new(1.0, dt, 0.0, 1.0), Vector2::new(0.5 * dt * dt, dt), dt, trust)
    }

    fn new(transition: Matrix2<f64>, input: Vector2<f64>, dt: f64, trust: Trust) -> Self {
        let measured = RowVector2::new(1.0, 0.0);
        let left_out = Vector2::new(0.5 * dt * dt, dt) * trust.acceleration_m_s2;
        let process = left_out * left_out.transpose();
        let variance = trust.com_m * trust.com_m;
        let mut covariance = Matrix2::identity();
        let mut gain = Vector2::zeros();
        for _ in 0..100_000 {
            let predicted = transition * covariance * transition.transpose() + process;
            let next = predicted.column(0) / (predicted[(0, 0)] + variance);
            covariance = (Matrix2::identity() - next * measured) * predicted;
            let done = (next - gain).norm() < 1e-12 * next.norm();
            gain = next;
            if done {
                break;
            }
        }
        Self { transition, input, gain, state: Vector2::zeros() }
    }

    /// One tick: the mean `input` over the tick that ended, and the COM measured now.
    pub fn update(&mut self, input: f64, com: f64) {
        let predicted = self.transition * self.state + self.input * input;
        self.state = predicted + self.gain * (com - predicted[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_velocity_of_a_pendulum_that_it_only_sees_the_place_of() {
        let pendulum = Pendulum { omega: 5.6, dt: 0.002 };
        let mut filter = Kalman::horizontal(&pendulum, Trust { com_m: 0.0005, acceleration_m_s2: 2.0 });
        let mut axis = nalgebra::Vector3::new(0.01, 0.2, 0.03);
        for _ in 0..150 {
            axis = pendulum.step(&axis, 0.0);
            filter.update(axis[2], axis[0]);
        }
        assert!((filter.state[1] - axis[1]).abs() < 1e-3 * axis[1].abs(), "{} for {}", filter.state[1], axis[1]);
    }
}
