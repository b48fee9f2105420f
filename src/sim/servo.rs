//! Joint servos: `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff` within limits of torque and speed.
//!
//! The damping term becomes the joint's own damping, which the engines integrate implicitly. This makes the servo as
//! stable as an implicit position actuator at steps of 1 to 2 ms. At the torque limit, the clamped torque replaces
//! spring and damping.

use crate::robot::Servo;

/// Torque of a servo over one physics step: `tau = constant - damping * dq`, with dq at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Constant part of the torque (N m).
    pub constant: f64,
    /// Damping (N m s/rad).
    pub damping: f64,
}

/// The servo law at joint angle `q` (rad) and joint speed `dq` (rad/s), for one physics step.
///
/// The torque limit is checked with the speed at the start of the step. If a joint brakes hard within a step, its
/// torque can exceed the limit by `kd` times the change of speed.
pub fn drive(servo: &Servo, q: f64, dq: f64, q_ref: f64, dq_ref: f64, tau_ff: f64) -> Drive {
    let constant = servo.kp * (q_ref - q) + servo.kd * dq_ref + tau_ff;
    let wanted = constant - servo.kd * dq;
    // A motor can brake with its full torque; only the driving torque decreases with speed.
    let forward = if dq > 0.0 { servo.available_torque(dq) } else { servo.torque_n_m };
    let backward = if dq < 0.0 { servo.available_torque(dq) } else { servo.torque_n_m };
    if wanted > forward || wanted < -backward {
        Drive { constant: wanted.clamp(-backward, forward), damping: 0.0 }
    } else {
        Drive { constant, damping: servo.kd }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVO: Servo = Servo {
        kp: 80.0,
        kd: 2.5,
        torque_n_m: 8.0,
        full_torque_speed_rad_s: 10.0,
        no_torque_speed_rad_s: 20.0,
        rotor_inertia_kg_m2: 0.005,
    };

    #[test]
    fn torque_stays_within_the_motor_whatever_is_asked() {
        for (dq, expected) in [(0.0, 8.0), (10.0, 8.0), (15.0, 4.0), (20.0, 0.0), (30.0, 0.0), (-30.0, 8.0)] {
            let drive = drive(&SERVO, 0.0, dq, 10.0, 0.0, 0.0);
            assert_eq!(drive, Drive { constant: expected, damping: 0.0 }, "at {dq} rad/s");
        }
        assert_eq!(drive(&SERVO, 0.0, -15.0, -10.0, 0.0, 0.0).constant, -4.0);
    }

    #[test]
    fn within_the_limits_it_is_a_damped_spring_with_feed_forward() {
        let drive = drive(&SERVO, 0.1, 0.3, 0.12, 0.2, 0.5);
        assert!((drive.constant - (80.0 * 0.02 + 2.5 * 0.2 + 0.5)).abs() < 1e-12);
        assert_eq!(drive.damping, 2.5);
    }
}
