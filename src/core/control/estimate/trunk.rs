//! Position and velocity of the trunk, from its accelerometer and from the position that follows from the standing
//! feet.
//!
//! For one axis, with the acceleration a, its noise of standard deviation s_a, and a measured position of noise s_p,
//! this is the Kalman filter in its steady state:
//!
//! ```text
//! p += v dt + a dt^2 / 2,  v += a dt                       at every tick
//! p += alpha (measured - p),  v += beta / dt (measured - p)  if a foot stands
//! ```
//!
//! Its gains have a closed form (Kalata 1984, "The tracking index"): with the index L = s_a dt^2 / s_p and
//! r = (4 + L - sqrt(8 L + L^2)) / 4, they are `alpha = 1 - r^2` and `beta = 2 (2 - alpha) - 4 sqrt(1 - alpha)`.

use crate::robot::{GRAVITY, SensorNoise};
use nalgebra::Vector3;

/// Ratio of the assumed noise to the noise of the sensors. It covers biases, and feet that roll and slide.
const MORE_NOISE: f64 = 2.0;
/// Least noise of a measured position, as a share of the COM height, for a robot that states no noise.
const LEAST_NOISE: f64 = 1e-4;

/// The filter. Position (m) and velocity (m/s) of the trunk's origin are in the world frame.
#[derive(Debug, Clone)]
pub struct TrunkFilter {
    dt: f64,
    alpha: f64,
    beta: f64,
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
}

impl TrunkFilter {
    /// The filter for a trunk at rest at `position`, with a control period `dt` (s) and the sensors of a robot whose COM is
    /// `height` (m) above the ground.
    pub fn new(noise: &SensorNoise, height: f64, dt: f64, position: Vector3<f64>) -> Self {
        // The IMU of a turned trunk takes some gravity for acceleration, and the position by the feet is off.
        let acceleration_m_s2 =
            MORE_NOISE * (noise.accelerometer_m_s2 + GRAVITY * noise.orientation_rad);
        let position_m = height * (noise.orientation_rad + noise.joint_angle_rad).max(LEAST_NOISE);
        let index =
            acceleration_m_s2.max(MORE_NOISE * GRAVITY * LEAST_NOISE) * dt * dt / position_m;
        let r = (4.0 + index - (8.0 * index + index * index).sqrt()) / 4.0;
        let alpha = 1.0 - r * r;
        let beta = 2.0 * (2.0 - alpha) - 4.0 * (1.0 - alpha).sqrt();
        Self {
            dt,
            alpha,
            beta,
            position,
            velocity: Vector3::zeros(),
        }
    }

    /// Moves on by a tick with the given mean acceleration (m/s^2, world frame, without gravity).
    pub fn predict(&mut self, acceleration: Vector3<f64>) {
        self.position += self.velocity * self.dt + acceleration * (0.5 * self.dt * self.dt);
        self.velocity += acceleration * self.dt;
    }

    /// Corrects by a measured position (m, world frame).
    pub fn correct(&mut self, measured: Vector3<f64>) {
        let off = measured - self.position;
        self.position += off * self.alpha;
        self.velocity += off * (self.beta / self.dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.002;

    /// The gains equal those of the Riccati equation, iterated until it converges.
    #[test]
    fn the_gains_are_those_of_the_steady_kalman_filter() {
        use nalgebra::{Matrix2, Vector2};
        let height = 0.309;
        let noise = SensorNoise {
            joint_angle_rad: 5e-4,
            joint_speed_rad_s: 0.02,
            orientation_rad: 3e-3,
            gyro_rad_s: 0.01,
            accelerometer_m_s2: 0.05,
            sole_force_n: 0.5,
            sole_moment_n_m: 0.01,
        };
        let filter = TrunkFilter::new(&noise, height, DT, Vector3::zeros());
        let q = 2.0 * (noise.accelerometer_m_s2 + GRAVITY * noise.orientation_rad);
        let p = height * (noise.orientation_rad + noise.joint_angle_rad);
        let transition = Matrix2::new(1.0, DT, 0.0, 1.0);
        let input = Vector2::new(0.5 * DT * DT, DT) * q;
        let (mut covariance, mut gain) = (Matrix2::identity(), Vector2::zeros());
        for _ in 0..200_000 {
            let predicted =
                transition * covariance * transition.transpose() + input * input.transpose();
            gain = predicted.column(0) / (predicted[(0, 0)] + p * p);
            covariance = predicted - gain * predicted.row(0);
        }
        assert!(
            (filter.alpha - gain[0]).abs() < 1e-6 * gain[0],
            "{} {}",
            filter.alpha,
            gain[0]
        );
        assert!(
            (filter.beta / DT - gain[1]).abs() < 1e-6 * gain[1],
            "{} {}",
            filter.beta / DT,
            gain[1]
        );
    }
}
