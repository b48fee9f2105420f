//! Motors and gains of the servos. A figure is taken from the robot's file if it is credible. Otherwise it is in proportion to
//! the robot's weight, height and time.
//!
//! The figures in units of the robot are the figures of UT-mu2's settings.

use super::figures::rounded;
use super::limbs::Limbs;
use crate::tree::Motor;
use standfast_core::robot::{Foot, MotorOrigin, Robot, Servo, Units};

/// Largest credible torque of a joint, in m g h, and largest credible speed, in omega. (For robots of usual sizes,
/// placeholders such as 1000 N m and 100 rad/s are larger.)
const MOST_TORQUE: f64 = 5.0;
const MOST_SPEED: f64 = 15.0;
/// Least credible torque of a joint of a leg and of other joints, in m g h, and least credible speed, in omega.
const LEAST_LEG_TORQUE: f64 = 0.02;
const LEAST_TORQUE: f64 = 1e-5;
const LEAST_SPEED: f64 = 0.3;
/// Credible rotor inertias, in m h^2.
const ROTORS: [f64; 2] = [1e-7, 0.5];

/// Torque (N m) and speed (rad/s) that exporters write where nothing is stated.
const OF_EXPORTERS: [f64; 2] = [1.0, 20.0];

/// A kind of joint, by the part of the body that it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    Leg,
    Waist,
    /// Arms and neck.
    Arm,
}

impl Group {
    pub fn name(self) -> &'static str {
        match self {
            Group::Leg => "Legs",
            Group::Waist => "Waist",
            Group::Arm => "Arms and neck",
        }
    }

    /// The figures of a servo in units of the robot: torque, stiffness (m g h), damping (stiffness / omega), rotor
    /// inertia (m h^2).
    fn figures(self) -> [f64; 4] {
        match self {
            Group::Leg | Group::Waist => [0.33, 3.3, 0.176, 0.0065],
            Group::Arm => [0.123, 0.617, 0.15, 0.0026],
        }
    }
}

/// Speed at which the torque of a motor reaches zero, in omega, and the share of this speed up to which it has its full
/// torque.
const NO_TORQUE_SPEED: f64 = 3.55;
const FULL_TORQUE: f64 = 0.5;

/// The origin of a figure that is in proportion to the robot, and of one that its file states.
pub const ASSUMED: &str = "assumed";
const READ: &str = "read";

/// A servo, and where the figures of its motor are from.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundServo {
    pub servo: Servo,
    pub group: Group,
    pub origin: MotorOrigin,
}

/// The servos of a robot, whose home posture is known, and warnings. `format` is that of its file.
pub fn find(
    robot: &Robot,
    limbs: &Limbs,
    motors: &[Motor],
    format: &str,
) -> (Vec<FoundServo>, Vec<String>) {
    let units = Units::of(robot);
    let (omega, moment) = (units.omega(), units.weight_n() * units.length_m);
    let believed = |figure: Option<f64>, unit: f64, least: f64, most: f64| {
        figure.filter(|figure| (least * unit..=most * unit).contains(figure))
    };
    let origin = |stated: Option<f64>| stated.map_or(ASSUMED, |_| READ).to_string();
    // Friction and damping that are not stated are none, and not assumed.
    let loss = |stated: Option<f64>| match stated {
        Some(_) => READ.to_string(),
        None => MotorOrigin::default().friction,
    };
    let (mut servos, mut disbelieved) = (Vec::new(), Vec::new());
    let [torque, speed] = OF_EXPORTERS.map(Some);
    let is_default = |motor: &Motor| motor.effort_n_m == torque && motor.velocity_rad_s == speed;
    let are_defaults = motors.iter().all(is_default);
    for (j, motor) in motors.iter().enumerate() {
        let group = if Foot::BOTH.iter().any(|&foot| limbs.legs[foot].contains(&j)) {
            Group::Leg
        } else if limbs.waist.contains(&j) {
            Group::Waist
        } else {
            Group::Arm
        };
        let [torque, kp, kd, rotor] = group.figures();
        let least = if group == Group::Leg {
            LEAST_LEG_TORQUE
        } else {
            LEAST_TORQUE
        };
        let effort = believed(motor.effort_n_m, moment, least, MOST_TORQUE);
        let effort = effort.filter(|_| !are_defaults);
        // A URDF without a credible torque has no credible speed either.
        let velocity = effort.and(believed(
            motor.velocity_rad_s,
            omega,
            LEAST_SPEED,
            MOST_SPEED,
        ));
        let square = units.mass_kg * units.length_m * units.length_m;
        let stated_rotor = motor.rotor_inertia_kg_m2;
        let own_rotor = believed(stated_rotor, square, ROTORS[0], ROTORS[1]);
        for (stated, taken, unit) in [
            (motor.effort_n_m, effort, "N m"),
            (motor.velocity_rad_s, velocity, "rad/s"),
            (stated_rotor, own_rotor, "kg m^2"),
        ] {
            if let (Some(stated), None) = (stated, taken) {
                disbelieved.push((format!("{stated} {unit}"), robot.joints[j].name.as_str()));
            }
        }
        let torque_n_m = effort.unwrap_or(rounded(torque * moment, 2));
        // A small motor has light parts, and its servo is soft. Legs and waist are stiff, since they carry the body.
        let share = if group == Group::Arm {
            (torque_n_m / (torque * moment)).min(1.0)
        } else {
            1.0
        };
        let kp = rounded(share * kp * moment, 3);
        let no_torque = velocity.unwrap_or(rounded(NO_TORQUE_SPEED * omega, 2));
        let servo = Servo {
            kp,
            kd: rounded(kd * kp / omega, 3),
            torque_n_m,
            full_torque_speed_rad_s: rounded(FULL_TORQUE * no_torque, 3),
            no_torque_speed_rad_s: no_torque,
            rotor_inertia_kg_m2: own_rotor.unwrap_or(rounded(
                share * rotor * units.mass_kg * units.length_m * units.length_m,
                2,
            )),
            friction_n_m: motor.friction_n_m.unwrap_or(0.0),
            damping_n_m_s_rad: motor.damping_n_m_s_rad.unwrap_or(0.0),
        };
        servos.push(FoundServo {
            servo,
            group,
            origin: MotorOrigin {
                torque: origin(effort),
                speed: origin(velocity),
                rotor_inertia: origin(own_rotor),
                friction: loss(motor.friction_n_m),
                damping: loss(motor.damping_n_m_s_rad),
            },
        });
    }
    (servos, sentences(&disbelieved, format))
}

/// Sentences on the figures that were not credible, each with its joints.
fn sentences(disbelieved: &[(String, &str)], format: &str) -> Vec<String> {
    let mut by_figure: Vec<(&str, Vec<&str>)> = Vec::new();
    for (figure, joint) in disbelieved {
        match by_figure.iter_mut().find(|(other, _)| other == figure) {
            Some((_, joints)) => joints.push(joint),
            None => by_figure.push((figure, vec![joint])),
        }
    }
    let mut sentences = Vec::new();
    for (figure, joints) in by_figure {
        let joints = match joints.as_slice() {
            [joint] => (*joint).to_string(),
            [first, .., last] => format!("{} joints, {first} to {last}", joints.len()),
            [] => String::new(),
        };
        sentences.push(format!(
            "{figure} in the {format} cannot be true for a robot of this weight and height, stands beside such a figure, or is \
                 what exporters write at every joint, and is not used ({joints})"
        ));
    }
    sentences
}
