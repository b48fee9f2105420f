//! What passes between a plant (simulated or real) and a controller, once a control tick, and when.
//!
//! At the beginning of each tick the plant gives a [`Sensed`] and takes the [`Command`] that follows from it, which holds until
//! the next one. Joint angles, orientation and angular velocity are those of that moment. The accelerometer is the change of the
//! trunk's velocity over the tick that ends ([`Imu::over`]), and the wrenches are means over it: what is read in one instant of a
//! contact tells little. In the first tick nothing has happened yet: the trunk was at rest, and the weight is on the soles. Until
//! the first answer a plant holds the posture that it is in ([`Command::hold`]), or home with the torques that carry it
//! (`Design::home_command`).

use super::model::{Foot, GRAVITY, PerFoot};
use nalgebra::{UnitQuaternion, Vector3};

/// What the sensors tell: the only thing that a controller sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Joint angles (rad), one per joint.
    pub q: Vec<f64>,
    pub imu: Imu,
    /// Of the ground on each sole, in the axes of the sole; mean over the last tick.
    pub soles: PerFoot<Wrench>,
}

impl Sensed {
    /// Errors: not `joints` angles, or a number that no sensor of a robot on Earth reads.
    pub fn check(&self, joints: usize) -> Result<(), SensedError> {
        if self.q.len() != joints {
            return Err(SensedError::WrongLength { field: "q", length: self.q.len(), joints });
        }
        let Imu { orientation, gyro, accelerometer } = &self.imu;
        plausible("q", &self.q)?;
        plausible("imu.orientation", orientation.coords.as_slice())?;
        plausible("imu.gyro", gyro.as_slice())?;
        plausible("imu.accelerometer", accelerometer.as_slice())?;
        for foot in Foot::BOTH {
            plausible("soles.force", self.soles[foot].force.as_slice())?;
            plausible("soles.moment", self.soles[foot].moment.as_slice())?;
        }
        Ok(())
    }
}

/// The largest number that is taken for a reading (rad, rad/s, m/s^2, N, N m).
const LARGEST_READING: f64 = 1e6;

fn plausible(field: &'static str, values: &[f64]) -> Result<(), SensedError> {
    match values.iter().position(|value| value.is_nan() || value.abs() > LARGEST_READING) {
        Some(index) => Err(SensedError::NoReading { field, index, value: values[index] }),
        None => Ok(()),
    }
}

/// What is wrong with a [`Sensed`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SensedError {
    #[error("{field} has {length} values; accepted: one for each of the robot's {joints} joints")]
    WrongLength { field: &'static str, length: usize, joints: usize },
    #[error("{field}[{index}] = {value}: is no reading; accepted: -1e6 to 1e6")]
    NoReading { field: &'static str, index: usize, value: f64 },
}

/// Inertial measurement unit, rigid with the trunk: at the origin of the trunk's frame, axes parallel to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Trunk frame to world.
    pub orientation: UnitQuaternion<f64>,
    /// Angular velocity (rad/s), trunk frame.
    pub gyro: Vector3<f64>,
    /// Specific force (acceleration less gravity) (m/s^2), trunk frame, mean over the last tick.
    pub accelerometer: Vector3<f64>,
}

impl Imu {
    /// What it reads at the end of a tick of `tick_s` in which the velocity of the trunk's origin (world, m/s) went from `before`
    /// to `now`; the trunk turns at `angular` (world, rad/s).
    pub fn over(
        tick_s: f64,
        orientation: UnitQuaternion<f64>,
        [before, now]: [Vector3<f64>; 2],
        angular: Vector3<f64>,
    ) -> Self {
        let to_trunk = orientation.inverse();
        let acceleration = (now - before) / tick_s;
        Self {
            orientation,
            gyro: to_trunk * angular,
            accelerometer: to_trunk * (acceleration + Vector3::new(0.0, 0.0, GRAVITY)),
        }
    }
}

/// A force and a moment about the centre of a sole's contact face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// (N)
    pub force: Vector3<f64>,
    /// (N m)
    pub moment: Vector3<f64>,
}

/// What a controller asks of the joint servos until the next tick:
/// `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff`, within the servo's limits.
#[derive(Debug, PartialEq)]
pub struct Command {
    /// (rad)
    pub q_ref: Vec<f64>,
    /// (rad/s)
    pub dq_ref: Vec<f64>,
    /// (N m)
    pub tau_ff: Vec<f64>,
}

impl Clone for Command {
    fn clone(&self) -> Self {
        Self { q_ref: self.q_ref.clone(), dq_ref: self.dq_ref.clone(), tau_ff: self.tau_ff.clone() }
    }

    /// Allocates only where there is no room.
    fn clone_from(&mut self, other: &Self) {
        self.q_ref.clone_from(&other.q_ref);
        self.dq_ref.clone_from(&other.dq_ref);
        self.tau_ff.clone_from(&other.tau_ff);
    }
}

impl Command {
    /// Stay at these joint angles (rad), by the servos alone.
    pub fn hold(q: &[f64]) -> Self {
        let zeros = vec![0.0; q.len()];
        Self { q_ref: q.to_vec(), dq_ref: zeros.clone(), tau_ff: zeros }
    }

    /// Every number is one.
    pub fn is_finite(&self) -> bool {
        [&self.q_ref, &self.dq_ref, &self.tau_ff].into_iter().flatten().all(|value| value.is_finite())
    }
}
