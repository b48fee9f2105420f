//! Kalman filter of the COM on the pendulum model (paper, Sect. VI.A: "we also apply Kalman Filter in order to filter
//! out the noise of sensors").
//!
//! One axis: `com_acc = omega^2 (com - zmp) + d` (eq. 1, 2, and a disturbance). The input is the measured ZMP, the state
//! `[com, com_vel, d]`; measured are the COM (from kinematics) and its acceleration (from the IMU on the trunk). The
//! paper's filter has no `d`. Without it a push shows only once the COM has moved: at the end of a push of 50 ms the
//! velocity was estimated at a third to a half of what it was. The gains are those of the steady state.

use crate::lipm::pendulum::Pendulum;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

/// What the filter trusts: standard deviations, one sample a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// Of the COM measured (m).
    pub com_m: f64,
    /// Of the trunk's acceleration as that of the COM (m/s^2): mostly the limbs' motion relative to the trunk.
    pub acceleration_m_s2: f64,
    /// Of the acceleration that the model leaves out and that is gone the next tick (m/s^2).
    pub model_m_s2: f64,
    /// Of the change of the disturbance from tick to tick (m/s^2): a push starts at once.
    pub disturbance_m_s2: f64,
}

/// The filter of one axis.
#[derive(Debug, Clone)]
pub struct Kalman {
    transition: Matrix3<f64>,
    /// Effect of the input over a tick.
    input: Vector3<f64>,
    /// Rows: COM and its acceleration, from the state.
    output: Matrix2x3<f64>,
    /// Effect of the input on the acceleration.
    direct: f64,
    gain: [Matrix3x2<f64>; 2],
    /// `[com, com_vel, d]` (m, m/s, m/s^2).
    pub state: Vector3<f64>,
}

impl Kalman {
    /// Of one axis, for a control period `dt` (s).
    pub fn new(dt: f64, trust: [Trust; 2]) -> Self {
        let gain = trust.map(|trust| Self::gain(dt, trust));

        let moved = 0.5 * dt * dt;
        let transition = Matrix3::new(1.0, dt, moved, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
        let input = Vector3::new(moved, dt, 0.0);
        let output = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let direct = 1.0;
        Self { transition, input, output, direct, gain, state: Vector3::zeros() }
    }

    fn gain(dt: f64, trust: Trust) -> Matrix3x2<f64> {
        let moved = 0.5 * dt * dt;
        let transition = Matrix3::new(1.0, dt, moved, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
        let input = Vector3::new(moved, dt, 0.0);
        let output = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let left_out = input * trust.model_m_s2;
        let pushes = Vector3::new(0.0, 0.0, trust.disturbance_m_s2);
        let process = left_out * left_out.transpose() + pushes * pushes.transpose();
        let noise = Matrix2::from_diagonal(&Vector2::new(trust.com_m.powi(2), trust.acceleration_m_s2.powi(2)));
        let mut covariance = Matrix3::identity();
        let mut gain = Matrix3x2::zeros();
        for _ in 0..100_000 {
            let predicted = transition * covariance * transition.transpose() + process;
            // The noise makes this positive definite.
            let Some(inverse) = (output * predicted * output.transpose() + noise).try_inverse() else { break };
            let next = predicted * output.transpose() * inverse;
            covariance = (Matrix3::identity() - next * output) * predicted;
            let done = (next - gain).norm() < 1e-12 * next.norm();
            gain = next;
            if done {
                break;
            }
        }
        gain
    }

    /// One tick: the mean `input` over the tick that ended, and the COM and its acceleration measured now.
    pub fn update(&mut self, input: f64, com: f64, com_acc: f64, mode: usize) {
        let predicted = self.transition * self.state + self.input * input;
        let expected = self.output * predicted + Vector2::new(0.0, self.direct * input);
        self.state = predicted + self.gain[mode] * (Vector2::new(com, com_acc) - expected);
    }
}

#[cfg(test)]
mod tests {
    use super::super::estimator::TRUST;
    use super::*;

    const PENDULUM: Pendulum = Pendulum { omega: 5.6, dt: 0.002 };

    #[test]
    fn it_finds_the_velocity_of_a_pendulum_that_it_only_sees_the_place_of() {
        let mut filter = Kalman::horizontal(&PENDULUM, TRUST);
        let mut axis = Vector3::new(0.01, 0.2, 0.03);
        for _ in 0..300 {
            axis = PENDULUM.step(&axis, 0.0);
            filter.update(axis[2], axis[0], PENDULUM.omega.powi(2) * (axis[0] - axis[2]));
        }
        assert!((filter.state[1] - axis[1]).abs() < 1e-3 * axis[1].abs(), "{} for {}", filter.state[1], axis[1]);
    }

    #[test]
    fn a_push_shows_in_the_velocity_while_it_lasts() {
        let (mut filter, push) = (Kalman::horizontal(&PENDULUM, TRUST), 6.0);
        let square = PENDULUM.omega.powi(2);
        let mut axis = Vector3::zeros();
        for _ in 0..25 {
            // The ZMP stays where it is: a push is a ZMP moved the other way.
            axis = PENDULUM.step(&Vector3::new(axis[0], axis[1], -push / square), 0.0);
            filter.update(0.0, axis[0], square * axis[0] + push);
        }
        assert!((filter.state[1] - axis[1]).abs() < 0.1 * axis[1], "{} for {} m/s", filter.state[1], axis[1]);
    }
}
