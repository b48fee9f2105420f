//! Joint servos: `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff` within limits of torque and speed.
//!
//! The damping term becomes the joint's own damping, which the engines integrate implicitly. So the servo is as stable
//! as an implicit position actuator at steps of 1 to 2 ms. The torque then depends on the speed at the end of the step,
//! which an impact may change by many rad/s. Therefore the implicit part of the damping is limited, so that the torque
//! stays within its limit for all but the hardest impacts. The excess of such an impact is subtracted in the next
//! steps. The rest of the damping acts with the speed at the start of the step. At the limit, the clamped torque
//! replaces spring and damping.

use standfast_core::robot::Servo;

/// Torque of a servo over one physics step: `tau = constant - damping * dq`, with dq at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Constant part of the torque (N m).
    pub constant: f64,
    /// Damping (N m s/rad).
    pub damping: f64,
}

/// The target of a servo: its reference angle (rad) and speed (rad/s), and a torque in addition (N m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub q_ref: f64,
    pub dq_ref: f64,
    pub tau_ff: f64,
}

/// The servo law at joint angle `q` (rad) and joint speed `dq` (rad/s), for one physics step of `step_s`.
///
/// The torque at the end of the step is within the limit, too, if the speed stays or changes towards rest, and then by
/// up to `full_torque_speed_rad_s` more. There are two exceptions. One is a harder impact. The other is a servo whose
/// rotor is so light that explicit damping would be unstable: the part of its damping that stability needs remains
/// implicit, and may add to the torque. The excess of a step is [`owed`] (N m), and subtracted from the limit of the
/// next steps.
pub fn drive(servo: &Servo, step_s: f64, q: f64, dq: f64, target: Target, owed: f64) -> Drive {
    let wanted = servo.kp * (target.q_ref - q) + servo.kd * (target.dq_ref - dq) + target.tau_ff;
    let (most, least) = (
        (servo.torque_n_m - owed.max(0.0)).max(0.0),
        (-servo.torque_n_m - owed.min(0.0)).min(0.0),
    );
    // A motor can brake with its full torque; only the driving torque decreases with speed.
    let forward = if dq > 0.0 {
        most.min(servo.available_torque(dq))
    } else {
        most
    };
    let backward = if dq < 0.0 {
        (-least).min(servo.available_torque(dq))
    } else {
        -least
    };
    if wanted > forward || wanted < -backward {
        return Drive {
            constant: wanted.clamp(-backward, forward),
            damping: 0.0,
        };
    }
    // Distances to the smallest and the largest speed at the end of the step.
    let (down, up) = (
        dq.max(0.0) + servo.full_torque_speed_rad_s,
        servo.full_torque_speed_rad_s - dq.min(0.0),
    );
    let within_limit = ((most - wanted) / down).min((wanted - least) / up);
    // Explicit damping of more than the rotor's inertia per step would reverse the joint's motion.
    let stable = (servo.kd - servo.rotor_inertia_kg_m2 / step_s).max(0.0);
    let damping = within_limit.max(stable).min(servo.kd);
    Drive {
        constant: wanted + damping * dq,
        damping,
    }
}

/// The excess of a servo's torque over its limit (N m, with the sign of the torque) after a step with torque `tau`, if
/// it was `owed` before. With it, the average over any number of steps in a row is within the limit, except for the
/// last step.
pub fn owed(servo: &Servo, owed: f64, tau: f64) -> f64 {
    let sum = owed + tau;
    sum - sum.clamp(-servo.torque_n_m, servo.torque_n_m)
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
        friction_n_m: 0.0,
        damping_n_m_s_rad: 0.0,
    };

    /// The drive at 0 rad, without feed-forward.
    fn drive(dq: f64, q_ref: f64) -> Drive {
        super::drive(
            &SERVO,
            0.002,
            0.0,
            dq,
            Target {
                q_ref,
                dq_ref: 0.0,
                tau_ff: 0.0,
            },
            0.0,
        )
    }

    #[test]
    fn torque_stays_within_the_motor_whatever_is_asked() {
        for (dq, expected) in [
            (0.0, 8.0),
            (10.0, 8.0),
            (15.0, 4.0),
            (20.0, 0.0),
            (30.0, 0.0),
            (-30.0, 8.0),
        ] {
            assert_eq!(
                drive(dq, 10.0),
                Drive {
                    constant: expected,
                    damping: 0.0
                },
                "at {dq} rad/s"
            );
        }
        assert_eq!(drive(-15.0, -10.0).constant, -4.0);
    }

    #[test]
    fn within_the_limits_it_is_a_damped_spring_with_feed_forward() {
        let drive = super::drive(
            &SERVO,
            0.002,
            0.1,
            0.3,
            Target {
                q_ref: 0.12,
                dq_ref: 0.2,
                tau_ff: 0.5,
            },
            0.0,
        );
        let torque = drive.constant - drive.damping * 0.3;
        assert!((torque - (80.0 * 0.02 + 2.5 * (0.2 - 0.3) + 0.5)).abs() < 1e-12);
        // The change of torque within a step with steady acceleration is damped.
        assert!(drive.damping > 0.1 && drive.damping <= 2.5, "{drive:?}");
    }

    #[test]
    fn an_impact_within_the_step_does_not_take_the_torque_beyond_its_limit() {
        for dq in [-8.0, -1.0, 0.0, 0.5, 3.0, 9.0] {
            for q_ref in [-0.2, -0.05, 0.0, 0.02, 0.1, 0.3] {
                let drive = drive(dq, q_ref);
                for after in [dq, 0.0, dq.max(0.0) + 10.0, dq.min(0.0) - 10.0] {
                    let torque = drive.constant - drive.damping * after;
                    assert!(
                        torque.abs() <= 8.0 + 1e-12,
                        "{torque} N m, {dq} to {after} rad/s, {q_ref} rad"
                    );
                }
            }
        }
    }

    #[test]
    fn a_light_rotor_keeps_the_damping_that_it_needs() {
        // 2.5 N m s/rad for 2 ms would reverse the motion of any joint with less than 0.005 kg m^2.
        let light = Servo {
            rotor_inertia_kg_m2: 0.002,
            ..SERVO
        };
        let drive = super::drive(
            &light,
            0.002,
            0.0,
            0.0,
            Target {
                q_ref: 0.09,
                dq_ref: 0.0,
                tau_ff: 0.0,
            },
            0.0,
        );
        assert!((drive.damping - 1.5).abs() < 1e-12, "{drive:?}");
    }
    #[test]
    fn what_an_impact_adds_to_the_torque_is_taken_from_the_next_steps() {
        let light = Servo {
            kd: 40.0,
            rotor_inertia_kg_m2: 1e-4,
            ..SERVO
        };
        for (servo, impact) in [(SERVO, 300.0), (light, 0.5)] {
            for sign in [1.0, -1.0] {
                let target = Target {
                    q_ref: 0.09 * sign,
                    dq_ref: 0.0,
                    tau_ff: 0.0,
                };
                let (mut ahead, mut sum, mut highest, mut steps) = (0.0, 0.0, 0.0_f64, 0.0);
                // The impact is within the first step. After it the joint is at rest, and its target asks for a large
                // torque.
                while steps == 0.0 || ahead != 0.0 {
                    let drive = super::drive(&servo, 0.002, 0.0, 0.0, target, ahead);
                    let after = if steps == 0.0 { -impact * sign } else { 0.0 };
                    let tau = drive.constant - drive.damping * after;
                    ahead = owed(&servo, ahead, tau);
                    (sum, highest, steps) =
                        (sum + tau * sign, highest.max(tau * sign), steps + 1.0);
                }
                assert!(
                    highest > 16.0 && steps > 1.0 && sum <= 8.0 * steps + 1e-9,
                    "{highest}, {sum} in {steps}"
                );
            }
        }
    }
}
