//! The data that a plant (simulated or real) and a controller exchange at each control tick, and their times.
//!
//! At the beginning of each tick the plant supplies a [`Sensed`] and takes the resulting [`Command`], which holds until
//! the next one. Joint angles and speeds, orientation and angular velocity are those at this time. The accelerometer
//! gives the change of the trunk's velocity over the past tick ([`Imu::over`]), and the wrenches are means over the
//! past tick, since contact forces vary too fast for one sample. At the first tick there is no past: the trunk counts
//! as at rest, and the weight is on the soles. Until the first command, a plant holds its posture ([`Command::hold`]),
//! or the home posture with the torques that carry it ([`Robot::home_command`](crate::robot::Robot::home_command)).

use crate::robot::{Foot, GRAVITY, PerFoot};
use nalgebra::{UnitQuaternion, Vector3};

/// The sensor readings, which are all that a controller sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Time since the start of the episode (s).
    pub time_s: f64,
    /// Joint angles (rad), one per joint.
    pub q: Vec<f64>,
    /// Joint speeds (rad/s), one per joint.
    pub dq: Vec<f64>,
    pub imu: Imu,
    /// Wrench of the ground on each sole, in sole axes, averaged over the past tick.
    pub soles: PerFoot<Wrench>,
}

impl Sensed {
    /// Fails if there are not `joints` angles and speeds, or if a number is NaN or larger than any real sensor reads.
    pub fn check(&self, joints: usize) -> Result<(), SensedError> {
        for (field, values) in [("q", &self.q), ("dq", &self.dq)] {
            if values.len() != joints {
                return Err(SensedError::WrongLength {
                    field,
                    length: values.len(),
                    joints,
                });
            }
            within(LARGEST_READING, field, values)?;
        }
        within(LARGEST_READING, "time_s", &[self.time_s])?;
        let Imu {
            orientation,
            gyro,
            accelerometer,
        } = &self.imu;
        within(
            LARGEST_READING,
            "imu.orientation",
            orientation.coords.as_slice(),
        )?;
        within(LARGEST_READING, "imu.gyro", gyro.as_slice())?;
        within(
            LARGEST_READING,
            "imu.accelerometer",
            accelerometer.as_slice(),
        )?;
        for foot in Foot::BOTH {
            within(
                LARGEST_LOAD,
                "soles.force",
                self.soles[foot].force.as_slice(),
            )?;
            within(
                LARGEST_LOAD,
                "soles.moment",
                self.soles[foot].moment.as_slice(),
            )?;
        }
        Ok(())
    }
}

/// Largest magnitude of a valid reading (rad, rad/s, m/s^2, s), and of a force or moment (N, N m). Forces and moments
/// grow with the robot, and the heaviest accepted robot weighs 1e9 N.
const LARGEST_READING: f64 = 1e6;
const LARGEST_LOAD: f64 = 1e12;

fn within(largest: f64, field: &'static str, values: &[f64]) -> Result<(), SensedError> {
    match values
        .iter()
        .position(|value| value.is_nan() || value.abs() > largest)
    {
        Some(index) => Err(SensedError::NoReading {
            field,
            index,
            value: values[index],
            largest,
        }),
        None => Ok(()),
    }
}

/// Why a [`Sensed`] is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SensedError {
    #[error("{field} has {length} values; accepted: one for each of the robot's {joints} joints")]
    WrongLength {
        field: &'static str,
        length: usize,
        joints: usize,
    },
    #[error(
        "{field}[{index}] = {value}: is not a valid reading; accepted: -{largest:e} to {largest:e}"
    )]
    NoReading {
        field: &'static str,
        index: usize,
        value: f64,
        largest: f64,
    },
}

/// Inertial measurement unit. It is fixed to the trunk, at the origin and along the axes of the trunk's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Rotation from the trunk's frame to the world.
    pub orientation: UnitQuaternion<f64>,
    /// Angular velocity (rad/s), in the trunk's frame.
    pub gyro: Vector3<f64>,
    /// Specific force, that is acceleration less gravity (m/s^2), in the trunk's frame, averaged over the past tick.
    pub accelerometer: Vector3<f64>,
}

impl Imu {
    /// The reading at the end of a tick of `tick_s` (s), during which the velocity of the trunk's origin (m/s, world
    /// frame) changed from `before` to `now`. `angular` is the trunk's angular velocity (rad/s, world frame).
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
    /// Force (N).
    pub force: Vector3<f64>,
    /// Moment (N m).
    pub moment: Vector3<f64>,
}

/// The command to the joint servos, which holds until the next tick:
/// `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff`, within the servo's limits.
#[derive(Debug, PartialEq)]
pub struct Command {
    /// Joint angles (rad).
    pub q_ref: Vec<f64>,
    /// Joint rates (rad/s).
    pub dq_ref: Vec<f64>,
    /// Feed-forward torques (N m).
    pub tau_ff: Vec<f64>,
    /// Stiffness kp (N m/rad) and damping kd (N m s/rad) of each joint. If None, the robot's servos have their own.
    /// With zeros the command consists of torques alone.
    pub gains: Option<Vec<[f64; 2]>>,
}

/// Largest stiffness and damping that a command may ask for, as for the servos of a robot.
const LARGEST_GAIN: f64 = 1e12;

/// Why a [`Command`] is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CommandError {
    #[error("{field} has {length} values; accepted: one for each of the robot's {joints} joints")]
    WrongLength {
        field: &'static str,
        length: usize,
        joints: usize,
    },
    #[error("{field}[{index}] = {value}: is not a command; accepted: {accepted}")]
    NoCommand {
        field: &'static str,
        index: usize,
        value: f64,
        accepted: &'static str,
    },
}

impl Command {
    /// Holds these joint angles (rad) by the servos alone.
    pub fn hold(q: &[f64]) -> Self {
        let zeros = vec![0.0; q.len()];
        Self {
            q_ref: q.to_vec(),
            dq_ref: zeros.clone(),
            tau_ff: zeros,
            gains: None,
        }
    }

    /// Fails if there is not one number for each of `joints` joints, or if a number is NaN or infinite, or a gain
    /// negative.
    pub fn check(&self, joints: usize) -> Result<(), CommandError> {
        for (field, values) in [
            ("q_ref", &self.q_ref),
            ("dq_ref", &self.dq_ref),
            ("tau_ff", &self.tau_ff),
        ] {
            if values.len() != joints {
                return Err(CommandError::WrongLength {
                    field,
                    length: values.len(),
                    joints,
                });
            }
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                let accepted = "a finite number";
                return Err(CommandError::NoCommand {
                    field,
                    index,
                    value: values[index],
                    accepted,
                });
            }
        }
        let Some(gains) = &self.gains else {
            return Ok(());
        };
        if gains.len() != joints {
            return Err(CommandError::WrongLength {
                field: "gains",
                length: gains.len(),
                joints,
            });
        }
        for (index, pair) in gains.iter().enumerate() {
            if let Some(&value) = pair
                .iter()
                .find(|gain| !(0.0..=LARGEST_GAIN).contains(*gain))
            {
                return Err(CommandError::NoCommand {
                    field: "gains",
                    index,
                    value,
                    accepted: "0 to 1e12",
                });
            }
        }
        Ok(())
    }

    /// Whether both commands are the same to the bit.
    pub fn is_same(&self, other: &Self) -> bool {
        fn same<'a>(
            a: impl IntoIterator<Item = &'a f64>,
            b: impl IntoIterator<Item = &'a f64>,
        ) -> bool {
            a.into_iter()
                .map(|v| v.to_bits())
                .eq(b.into_iter().map(|v| v.to_bits()))
        }
        let gains = match (&self.gains, &other.gains) {
            (Some(a), Some(b)) => same(a.as_flattened(), b.as_flattened()),
            (a, b) => a.is_none() && b.is_none(),
        };
        gains
            && same(&self.q_ref, &other.q_ref)
            && same(&self.dq_ref, &other.dq_ref)
            && same(&self.tau_ff, &other.tau_ff)
    }
}

impl Clone for Command {
    fn clone(&self) -> Self {
        let Self {
            q_ref,
            dq_ref,
            tau_ff,
            gains,
        } = self;
        Self {
            q_ref: q_ref.clone(),
            dq_ref: dq_ref.clone(),
            tau_ff: tau_ff.clone(),
            gains: gains.clone(),
        }
    }

    /// Allocates only if there is not enough room.
    fn clone_from(&mut self, other: &Self) {
        self.q_ref.clone_from(&other.q_ref);
        self.dq_ref.clone_from(&other.dq_ref);
        self.tau_ff.clone_from(&other.tau_ff);
        self.gains.clone_from(&other.gains);
    }
}
