//! Kalman filter of the COM (paper, Sect. VI.A: "we also apply Kalman Filter in order to filter out the noise of
//! sensors").
//!
//! One axis: `com_acc = f / m + d`, with f the force of the ground less the weight (eq. 3, for all axes). The input is f / m by
//! the wrenches under the soles, the state `[com, com_vel, d]`; measured are the COM (from kinematics) and its
//! acceleration (from the IMU on the trunk). The paper's filter takes f from the pendulum, `omega^2 (com - zmp)`, and has no
//! d. Without d a push shows only once the COM has moved: at the end of a push of 50 ms the velocity was estimated at a
//! third to a half of what it was. And while a leg swings the force is not that of the pendulum: the velocity was off by
//! 0.1 m/s. The gains are those of the steady state.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

/// What the filter trusts: standard deviations, one sample a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// Of the COM measured (m).
    pub com_m: f64,
    /// Of the trunk's acceleration as that of the COM (m/s^2): mostly the limbs' motion relative to the trunk.
    pub acceleration_m_s2: f64,
    /// The same while a leg swings (m/s^2).
    pub swing_acceleration_m_s2: f64,
    /// Of the acceleration that the forces leave out and that is gone the next tick (m/s^2).
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
    gain: Matrix3x2<f64>,
    swing_gain: Matrix3x2<f64>,
    /// `[com, com_vel, d]` (m, m/s, m/s^2).
    pub state: Vector3<f64>,
}

impl Kalman {
    /// Of one axis, for a control period `dt` (s).
    pub fn new(dt: f64, trust: Trust) -> Self {
        let moved = 0.5 * dt * dt;
        let mut filter = Self {
            transition: Matrix3::new(1.0, dt, moved, 0.0, 1.0, dt, 0.0, 0.0, 1.0),
            input: Vector3::new(moved, dt, 0.0),
            output: Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            gain: Matrix3x2::zeros(),
            swing_gain: Matrix3x2::zeros(),
            state: Vector3::zeros(),
        };
        filter.gain = filter.steady_gain(&trust, trust.acceleration_m_s2);
        filter.swing_gain = filter.steady_gain(&trust, trust.swing_acceleration_m_s2);
        filter
    }

    fn steady_gain(&self, trust: &Trust, acceleration_m_s2: f64) -> Matrix3x2<f64> {
        let left_out = self.input * trust.model_m_s2;
        let pushes = Vector3::new(0.0, 0.0, trust.disturbance_m_s2);
        let process = left_out * left_out.transpose() + pushes * pushes.transpose();
        let noise = Matrix2::from_diagonal(&Vector2::new(trust.com_m.powi(2), acceleration_m_s2.powi(2)));
        let mut covariance = Matrix3::identity();
        let mut gain = Matrix3x2::zeros();
        for _ in 0..100_000 {
            let predicted = self.transition * covariance * self.transition.transpose() + process;
            // The noise makes this positive definite.
            let Some(inverse) = (self.output * predicted * self.output.transpose() + noise).try_inverse() else {
                break;
            };
            let next = predicted * self.output.transpose() * inverse;
            covariance = (Matrix3::identity() - next * self.output) * predicted;
            let done = (next - gain).norm() < 1e-12 * next.norm();
            gain = next;
            if done {
                break;
            }
        }
        gain
    }

    /// One tick: the mean f / m (m/s^2) over the tick that ended, and the COM (m) and its acceleration (m/s^2) measured
    /// now; whether a leg swings.
    pub fn update(&mut self, force_per_mass: f64, com: f64, com_acc: f64, swings: bool) {
        let predicted = self.transition * self.state + self.input * force_per_mass;
        let expected = self.output * predicted + Vector2::new(0.0, force_per_mass);
        let gain = if swings { &self.swing_gain } else { &self.gain };
        self.state = predicted + gain * (Vector2::new(com, com_acc) - expected);
    }
}

#[cfg(test)]
mod tests {
    use super::super::TRUST;
    use super::*;
    use crate::lipm::pendulum::Pendulum;

    const PENDULUM: Pendulum = Pendulum { omega: 5.6, dt: 0.002 };

    /// Force of the ground on a pendulum, over its mass (m/s^2).
    fn force(axis: &Vector3<f64>) -> f64 {
        PENDULUM.omega.powi(2) * (axis[0] - axis[2])
    }

    #[test]
    fn it_finds_the_velocity_of_a_pendulum_that_it_only_sees_the_place_of() {
        for swings in [false, true] {
            let mut filter = Kalman::new(PENDULUM.dt, TRUST);
            let mut axis = Vector3::new(0.01, 0.2, 0.03);
            for _ in 0..300 {
                let before = force(&axis);
                axis = PENDULUM.step(&axis, 0.0);
                filter.update(0.5 * (before + force(&axis)), axis[0], force(&axis), swings);
            }
            assert!((filter.state[1] - axis[1]).abs() < 1e-3 * axis[1].abs(), "{} for {}", filter.state[1], axis[1]);
        }
    }

    #[test]
    fn a_push_shows_in_the_velocity_while_it_lasts() {
        let (mut filter, push) = (Kalman::new(PENDULUM.dt, TRUST), 6.0);
        let square = PENDULUM.omega.powi(2);
        let mut axis = Vector3::zeros();
        for _ in 0..25 {
            // The ZMP stays where it is: a push is a ZMP moved the other way.
            axis = PENDULUM.step(&Vector3::new(axis[0], axis[1], -push / square), 0.0);
            filter.update(square * axis[0], axis[0], square * axis[0] + push, false);
        }
        assert!((filter.state[1] - axis[1]).abs() < 0.1 * axis[1], "{} for {} m/s", filter.state[1], axis[1]);
    }

    /// A trunk that is thrown about by a swinging leg tells less of the COM: here of 0.5 m/s in 50 ms, of which neither
    /// forces nor the COM show anything. How much less is a matter of [`TRUST`]; that nobody is believed is not.
    #[test]
    fn while_a_leg_swings_the_trunk_is_believed_less() {
        let velocity = |swing_acceleration_m_s2: f64, swings: bool| {
            let mut filter = Kalman::new(PENDULUM.dt, Trust { swing_acceleration_m_s2, ..TRUST });
            (0..25).for_each(|_| filter.update(0.0, 0.0, 10.0, swings));
            filter.state[1]
        };
        let [stands, swings] = [false, true].map(|swings| velocity(TRUST.swing_acceleration_m_s2, swings));
        assert!(swings < 0.75 * stands && stands < 0.5, "{swings} {stands}");
        assert_eq!(velocity(TRUST.acceleration_m_s2, true), stands);
        assert!(velocity(1e4, true).abs() < 1e-3, "{}", velocity(1e4, true));
    }
}
