//! The sensors: encoders, an IMU on the trunk, and a wrench sensor under each sole, with noise and bias. The delay is
//! not theirs; it acts between command and torque, in [`Plant`](super::plant::Plant).

use crate::robot::{Foot, Imu, PerFoot, Sensed, SensorNoise, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

/// Sensor errors of one episode: a stream of standard normal numbers, and their scale.
///
/// The plant takes the same number of values at the start (for the bias) and at every tick (for the noise), in a fixed
/// order. So the noise of a sensor at a tick depends on the stream only, and not on the controller.
#[derive(Clone)]
pub struct SensorErrors {
    /// Scale of the noise, relative to the robot's own [`SensorNoise`].
    pub noise_scale: f64,
    /// Standard deviation of the bias, which is constant over the episode, relative to [`SensorNoise`].
    pub bias_scale: f64,
    pub normal: Box<dyn NormalStream>,
}

/// A stream of independent standard normal numbers.
pub trait NormalStream: Send + Sync {
    fn next(&mut self) -> f64;
    /// A copy that goes on with the same numbers.
    fn copy(&self) -> Box<dyn NormalStream>;
}

impl Clone for Box<dyn NormalStream> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// The sensors of a robot, which add bias and noise to the true values.
#[derive(Clone)]
pub struct Sensors {
    noise: SensorNoise,
    errors: Option<SensorErrors>,
    /// The bias, drawn once per episode.
    bias: Errors,
}

/// One additive error for each number of a [`Sensed`].
#[derive(Clone)]
struct Errors {
    q: Vec<f64>,
    orientation: Vector3<f64>,
    gyro: Vector3<f64>,
    accelerometer: Vector3<f64>,
    soles: PerFoot<Wrench>,
}

impl Sensors {
    /// Sensors of a robot with `joints` joints. Without `errors` they are ideal.
    pub fn new(joints: usize, noise: SensorNoise, mut errors: Option<SensorErrors>) -> Self {
        let mut bias = Errors {
            q: vec![0.0; joints],
            orientation: Vector3::zeros(),
            gyro: Vector3::zeros(),
            accelerometer: Vector3::zeros(),
            soles: PerFoot::default(),
        };
        if let Some(errors) = &mut errors {
            bias.draw(&noise, errors.bias_scale, &mut *errors.normal);
        }
        Self { noise, errors, bias }
    }

    /// Turns true values into the readings of this tick.
    pub fn corrupt(&mut self, truth: &mut Sensed) {
        let Some(errors) = &mut self.errors else { return };
        self.bias.add_to(truth);
        let mut noise = self.bias.clone();
        noise.draw(&self.noise, errors.noise_scale, &mut *errors.normal);
        noise.add_to(truth);
    }
}

impl Errors {
    fn draw(&mut self, sd: &SensorNoise, scale: f64, normal: &mut dyn NormalStream) {
        for q in &mut self.q {
            *q = scale * sd.joint_angle_rad * normal.next();
        }
        let mut vector = |sd: f64| Vector3::from_fn(|_, _| scale * sd * normal.next());
        self.orientation = vector(sd.orientation_rad);
        self.gyro = vector(sd.gyro_rad_s);
        self.accelerometer = vector(sd.accelerometer_m_s2);
        for foot in Foot::BOTH {
            self.soles[foot] = Wrench { force: vector(sd.sole_force_n), moment: vector(sd.sole_moment_n_m) };
        }
    }

    fn add_to(&self, sensed: &mut Sensed) {
        for (q, e) in sensed.q.iter_mut().zip(&self.q) {
            *q += e;
        }
        let Imu { orientation, gyro, accelerometer } = &mut sensed.imu;
        *orientation *= UnitQuaternion::from_scaled_axis(self.orientation);
        *gyro += self.gyro;
        *accelerometer += self.accelerometer;
        for foot in Foot::BOTH {
            sensed.soles[foot].force += self.soles[foot].force;
            sensed.soles[foot].moment += self.soles[foot].moment;
        }
    }
}
