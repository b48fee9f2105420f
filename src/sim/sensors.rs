//! The sensors: encoders, an IMU on the trunk, and a wrench sensor under each sole, with noise and bias. They have no
//! delay. The delay of the robot acts between command and torque, in [`Plant`](super::plant::Plant).

use nalgebra::{UnitQuaternion, Vector3};
use standfast_core::robot::{Foot, PerFoot, SensorNoise};
use standfast_core::socket::{Imu, Sensed, Wrench};
use std::sync::Arc;

/// Sensor errors of one episode: standard normal numbers, and their scale.
#[derive(Clone)]
pub struct SensorErrors {
    /// Scale of the noise, relative to the robot's own [`SensorNoise`].
    pub noise_scale: f64,
    /// Standard deviation of the bias, which is constant over the episode, relative to [`SensorNoise`].
    pub bias_scale: f64,
    pub normal: Arc<dyn Normal>,
}

/// Standard normal numbers as a function of time and sensor: the reading of one sensor does not change those of others.
pub trait Normal: Send + Sync {
    /// Fills `channels` with the independent numbers of a sensor, at a control tick or for its bias.
    fn draw(&self, when: NoiseDraw, sensor: Sensor, channels: &mut [f64]);
}

/// The purpose for which numbers are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseDraw {
    /// The bias, which is drawn once.
    Bias,
    /// The noise of this control tick.
    Tick(u64),
}

/// The sensors. The drawn numbers depend on the number of the sensor, so a new sensor takes a new number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    JointAngles = 0,
    JointSpeeds = 1,
    Orientation = 2,
    Gyro = 3,
    Accelerometer = 4,
    LeftSoleForce = 5,
    LeftSoleMoment = 6,
    RightSoleForce = 7,
    RightSoleMoment = 8,
}

/// The sensors of a robot, which add bias and noise to the true values.
#[derive(Clone)]
pub struct Sensors {
    noise: SensorNoise,
    errors: Option<SensorErrors>,
    /// The bias, drawn once per episode, and room for the errors of a tick.
    bias: Errors,
    now: Errors,
}

/// One additive error for each number of a [`Sensed`].
#[derive(Clone)]
struct Errors {
    q: Vec<f64>,
    dq: Vec<f64>,
    orientation: Vector3<f64>,
    gyro: Vector3<f64>,
    accelerometer: Vector3<f64>,
    soles: PerFoot<Wrench>,
}

impl Sensors {
    /// Sensors of a robot with `joints` joints. Without `errors` they are ideal.
    pub fn new(joints: usize, noise: SensorNoise, errors: Option<SensorErrors>) -> Self {
        let mut bias = Errors {
            q: vec![0.0; joints],
            dq: vec![0.0; joints],
            orientation: Vector3::zeros(),
            gyro: Vector3::zeros(),
            accelerometer: Vector3::zeros(),
            soles: PerFoot::default(),
        };
        if let Some(errors) = &errors {
            bias.draw(&noise, errors.bias_scale, &*errors.normal, NoiseDraw::Bias);
        }
        Self {
            noise,
            errors,
            now: bias.clone(),
            bias,
        }
    }

    /// Turns true values into the readings of a control tick.
    pub fn corrupt(&mut self, truth: &mut Sensed, tick: u64) {
        let Some(errors) = &self.errors else { return };
        self.bias.add_to(truth);
        self.now.draw(
            &self.noise,
            errors.noise_scale,
            &*errors.normal,
            NoiseDraw::Tick(tick),
        );
        self.now.add_to(truth);
    }
}

impl Errors {
    fn draw(&mut self, sd: &SensorNoise, scale: f64, normal: &dyn Normal, when: NoiseDraw) {
        let draw = |sensor: Sensor, sd: f64, channels: &mut [f64]| {
            normal.draw(when, sensor, channels);
            for channel in channels {
                *channel *= scale * sd;
            }
        };
        draw(Sensor::JointAngles, sd.joint_angle_rad, &mut self.q);
        draw(Sensor::JointSpeeds, sd.joint_speed_rad_s, &mut self.dq);
        draw(
            Sensor::Orientation,
            sd.orientation_rad,
            self.orientation.as_mut_slice(),
        );
        draw(Sensor::Gyro, sd.gyro_rad_s, self.gyro.as_mut_slice());
        draw(
            Sensor::Accelerometer,
            sd.accelerometer_m_s2,
            self.accelerometer.as_mut_slice(),
        );
        let PerFoot { left, right } = &mut self.soles;
        draw(
            Sensor::LeftSoleForce,
            sd.sole_force_n,
            left.force.as_mut_slice(),
        );
        draw(
            Sensor::LeftSoleMoment,
            sd.sole_moment_n_m,
            left.moment.as_mut_slice(),
        );
        draw(
            Sensor::RightSoleForce,
            sd.sole_force_n,
            right.force.as_mut_slice(),
        );
        draw(
            Sensor::RightSoleMoment,
            sd.sole_moment_n_m,
            right.moment.as_mut_slice(),
        );
    }

    fn add_to(&self, sensed: &mut Sensed) {
        for (reading, error) in sensed
            .q
            .iter_mut()
            .zip(&self.q)
            .chain(sensed.dq.iter_mut().zip(&self.dq))
        {
            *reading += error;
        }
        let Imu {
            orientation,
            gyro,
            accelerometer,
        } = &mut sensed.imu;
        *orientation *= UnitQuaternion::from_scaled_axis(self.orientation);
        *gyro += self.gyro;
        *accelerometer += self.accelerometer;
        for foot in Foot::BOTH {
            sensed.soles[foot].force += self.soles[foot].force;
            sensed.soles[foot].moment += self.soles[foot].moment;
        }
    }
}
