//! Kalman filter of the COM. Sect. VI.A: "we also apply Kalman Filter in order to filter out the noise of sensors".
//!
//! The model of one axis is `com_acc = f / m + d`, where f is the ground reaction force less the weight (eq. 3, for all
//! axes), m is the mass, and d is the acceleration by a disturbance. The state is `[com, com_vel, d]`. The input is f /
//! m from the wrenches under the soles. The measurements are the COM (from kinematics) and its acceleration (from the
//! IMU on the trunk). The filter gains are those of the steady state.
//!
//! The paper takes f from the pendulum, `omega^2 (com - zmp)`, and has no d. Without d a push shows only once the COM
//! has moved: at the end of a push of 50 ms, the estimated velocity was a third to a half of the true one. And while a
//! leg swings, f is not the pendulum's: the estimated velocity was off by 0.1 m/s.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

/// Assumed noise of measurements and model: standard deviations, for one sample per tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// Noise of the measured COM (m).
    pub com_m: f64,
    /// Error of taking the trunk's acceleration for that of the COM (m/s^2). It is mostly the motion of the limbs.
    pub acceleration_m_s2: f64,
    /// The same error while a leg swings (m/s^2).
    pub swing_acceleration_m_s2: f64,
    /// Acceleration that the measured forces miss, independent from tick to tick (m/s^2).
    pub model_m_s2: f64,
    /// Change of the disturbance d from tick to tick (m/s^2). It is large because a push starts at once.
    pub disturbance_m_s2: f64,
}

/// The filter of one axis.
#[derive(Debug, Clone)]
pub struct Kalman {
    transition: Matrix3<f64>,
    /// Effect of the input f / m on the state over a tick.
    input: Vector3<f64>,
    /// Maps the state to the COM and its acceleration.
    output: Matrix2x3<f64>,
    gain: Matrix3x2<f64>,
    swing_gain: Matrix3x2<f64>,
    /// `[com, com_vel, d]` (m, m/s, m/s^2).
    pub state: Vector3<f64>,
}

impl Kalman {
    /// The filter of one axis, for a control period `dt` (s).
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
            // The measurement noise makes this matrix positive definite.
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

    /// Runs one tick. `force_per_mass` is the mean f / m (m/s^2) over the past tick; `com` (m) and `com_acc` (m/s^2)
    /// are measured now; `swings` says whether a leg swings.
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

    /// Ground reaction force on a pendulum, divided by its mass (m/s^2).
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
            // The ZMP stays where it is; a push acts like a ZMP shifted against the push.
            axis = PENDULUM.step(&Vector3::new(axis[0], axis[1], -push / square), 0.0);
            filter.update(square * axis[0], axis[0], square * axis[0] + push, false);
        }
        assert!((filter.state[1] - axis[1]).abs() < 0.1 * axis[1], "{} for {} m/s", filter.state[1], axis[1]);
    }

    /// A trunk that a swinging leg shakes tells less of the COM. Here the IMU shows 10 m/s^2 for 50 ms, or 0.5 m/s,
    /// while forces and COM show nothing. [`TRUST`] sets how much less the filter believes the IMU; that no filter
    /// believes it fully is tested here.
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
