//! The settings of a robot as a commented TOML file.

use super::servos;
use super::soles;
use crate::facing::Forward;
use standfast_core::robot::swing_time::least_swing_time_s;
use standfast_core::robot::{LandingRegion, MotorOrigin, PerFoot, Robot};
use standfast_files::assets::{decimal, one_line, quoted};
use std::fmt::Write;

/// The origins of a robot's figures.
pub struct Origins {
    pub soles: PerFoot<soles::FoundSole>,
    pub servos: Vec<servos::FoundServo>,
    /// Joints whose angles at home the solver found.
    pub solved: Vec<usize>,
    /// Whether the soles were stated by the user.
    pub soles_are_stated: bool,
    /// The axis of the base that points forward, and why.
    pub forward: (Forward, &'static str),
    /// The range that was given to joints without one (rad).
    pub range_rad: Option<f64>,
    /// Name of the reference posture from which the home posture started, and its file.
    pub reference: Option<String>,
}

/// Width of the list of joints in a group of servos.
const WIDTH: usize = 110;

/// The text of the settings for a file of this format. It reads back as the same robot.
pub fn toml(file: &str, format: &str, robot: &Robot, origins: &Origins) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |s: String| _ = writeln!(text, "{s}");
    let mut column = |figure: String, comment: &str| line(format!("{figure:<32}# {comment}"));
    column(
        format!("trunk = {}", quoted(&robot.links[robot.trunk].name)),
        "link with the IMU, on which pushes act; read",
    );
    column(
        format!("friction = {}", decimal(robot.friction)),
        "friction coefficient between soles and ground [-]; assumed",
    );
    column(
        format!("delay_s = {}", robot.delay_s),
        "delay from sensing to torque [s]; assumed",
    );
    let (forward, why) = origins.forward;
    if forward != Forward::default() {
        column(
            format!("forward = {}", quoted(forward.name())),
            &format!("axis of the base that points forward: {why}; read"),
        );
    }
    if let Some(range_rad) = origins.range_rad {
        column(
            format!("range_rad = {}", decimal(range_rad)),
            "range of the joints that have none, to both sides; assumed",
        );
    }
    let mut rest = String::new();
    let mut line = |s: &str| _ = writeln!(rest, "{s}");
    line("\n# Shown by `standfast model`.\nassumptions = [");
    for assumption in robot.assumptions.iter() {
        line(&format!("    {},", quoted(assumption)));
    }
    line("]\n");
    soles_text(robot, origins, &mut line);
    reach_text(robot, &mut line);
    noise_text(robot, &mut line);
    servos_text(robot, origins, &mut line);
    home_text(robot, origins, &mut line);
    let head = format!(
        "# What {} cannot state, inferred by `standfast init` and to be edited. Units are SI, angles are in radians.\n\
         # \"read\" is from the {format}, \"solved\" follows from what it says, and \"assumed\" is in proportion to the robot's weight,\n\
         # height and time: each such figure is that of the built-in robot UT-mu2 for a robot of this size.\n\n",
        one_line(file)
    );
    head + &text + &rest
}

fn soles_text(robot: &Robot, origins: &Origins, line: &mut dyn FnMut(&str)) {
    let soles = [
        ("left", &origins.soles.left),
        ("right", &origins.soles.right),
    ];
    let origin = if origins.soles_are_stated {
        "stated before"
    } else {
        "read"
    };
    if soles.iter().all(|(_, found)| found.is_box) {
        line(&format!(
            "[soles]                         # links with one collision box each; {origin}"
        ));
        for (side, found) in soles {
            line(&format!(
                "{side} = {}",
                quoted(&robot.frames[found.sole.frame].name)
            ));
        }
    } else {
        let what = if origins.soles_are_stated {
            ""
        } else {
            ", the rectangle around the lowest points of what collides there"
        };
        line(&format!(
            "# The face on which each foot stands{what}; {origin}.\n\
             # A center is in the frame of the link. (For a link with one collision box, its name alone says all of this.)",
        ));
        for (side, found) in soles {
            let [length, width] = found.sole.half_m.map(|half| 2.0 * half);
            let center = found.in_frame.translation.vector;
            line(&format!(
                "[soles.{side}]\nlink = {}",
                quoted(&robot.frames[found.sole.frame].name)
            ));
            line(&format!(
                "center_m = [{}, {}, {}]",
                decimal(center.x),
                decimal(center.y),
                decimal(center.z)
            ));
            line(&format!(
                "size_m = [{}, {}]             # length (x), width (y)",
                decimal(length),
                decimal(width)
            ));
            if found.in_frame.rotation.angle() > 1e-9 {
                let (roll, pitch, yaw) = found.in_frame.rotation.euler_angles();
                line(&format!(
                    "rpy_rad = [{}, {}, {}]",
                    decimal(roll),
                    decimal(pitch),
                    decimal(yaw)
                ));
            }
        }
    }
}

fn reach_text(robot: &Robot, line: &mut dyn FnMut(&str)) {
    if robot.reach.is_empty() {
        return line("\n# No landing places were found, so that there is no [[reach]].");
    }
    line(
        "\n# Where a foot can land and how soon: regions of offsets from the centre of the stance sole to that of the landing\n\
         # one, x forward and y to the side of the swing foot, the one at home first. Solved: the legs reach them without\n\
         # touching, and the motors of the swing leg can make it in that time (`standfast model` computes the least time).",
    );
    for region in &robot.reach {
        let LandingRegion {
            name,
            x_m: [x0, x1],
            y_m: [y0, y1],
            swing_time_s,
            sideways_from,
            arc_m,
        } = region;
        line(&format!("[[reach]]\nname = {}", quoted(name)));
        line(&format!(
            "x_m = [{}, {}]              # [m]",
            decimal(*x0),
            decimal(*x1)
        ));
        line(&format!(
            "y_m = [{}, {}]               # [m]",
            decimal(*y0),
            decimal(*y1)
        ));
        let needs = least_swing_time_s(robot, region)
            .map_or(String::new(), |s| format!("; the motors need {s:.3} s"));
        line(&format!(
            "swing_time_s = {swing_time_s}            # from the lift to the landing [s]{needs}"
        ));
        if *sideways_from > 0.0 {
            line(&format!(
                "sideways_from = {sideways_from}            # share of the swing from which on the foot moves sideways"
            ));
        }
        if *arc_m > 0.0 {
            line(&format!(
                "arc_m = {arc_m}                   # how far it swings out on its way [m]"
            ));
        }
    }
}

fn noise_text(robot: &Robot, line: &mut dyn FnMut(&str)) {
    let noise = &robot.noise;
    line(
        "\n# Standard deviations of white noise, with one sample per control tick; all assumed.\n[noise]",
    );
    for (key, value, comment) in [
        ("joint_angle_rad", noise.joint_angle_rad, "encoders [rad]"),
        (
            "joint_speed_rad_s",
            noise.joint_speed_rad_s,
            "speeds of the joints [rad/s]",
        ),
        (
            "gyro_rad_s",
            noise.gyro_rad_s,
            "angular velocity of the trunk [rad/s]",
        ),
        (
            "orientation_rad",
            noise.orientation_rad,
            "orientation of the trunk, about each axis [rad]",
        ),
        (
            "accelerometer_m_s2",
            noise.accelerometer_m_s2,
            "acceleration of the trunk [m/s^2]",
        ),
        (
            "sole_force_n",
            noise.sole_force_n,
            "force under each sole, each axis [N]",
        ),
        (
            "sole_moment_n_m",
            noise.sole_moment_n_m,
            "moment about each sole's centre, each axis [N m]",
        ),
    ] {
        figure(line, key, value, comment);
    }
}

fn servos_text(robot: &Robot, origins: &Origins, line: &mut dyn FnMut(&str)) {
    // Joints with the same figures from the same origin share a group.
    let mut groups: Vec<(&servos::FoundServo, Vec<usize>)> = Vec::new();
    for (j, found) in origins.servos.iter().enumerate() {
        match groups.iter_mut().find(|(other, _)| *other == found) {
            Some((_, joints)) => joints.push(j),
            None => groups.push((found, vec![j])),
        }
    }
    groups.sort_by_key(|(found, _)| found.group);
    for (
        servos::FoundServo {
            servo,
            group,
            origin,
        },
        joints,
    ) in groups
    {
        line(&format!("\n# {}\n[[servos]]\njoints = [", group.name()));
        let mut row = String::from("   ");
        for &j in &joints {
            let name = quoted(&robot.joints[j].name);
            if row.len() + name.len() > WIDTH {
                line(&row);
                row = "   ".into();
            }
            _ = write!(row, " {name},");
        }
        line(&row);
        line("]");
        let full_torque_speed = match &origin.speed[..] {
            "read" | servos::ASSUMED => {
                "largest speed with full torque [rad/s]; assumed: half of the next".to_string()
            }
            other => format!(
                "largest speed with full torque [rad/s]; {}",
                one_line(other)
            ),
        };
        for (key, value, comment) in [
            ("kp_n_m_rad", servo.kp, "stiffness [N m/rad]; assumed"),
            ("kd_n_m_s_rad", servo.kd, "damping [N m s/rad]; assumed"),
            (
                "torque_n_m",
                servo.torque_n_m,
                &format!(
                    "torque limit at low speed [N m]; {}",
                    one_line(&origin.torque)
                ),
            ),
            (
                "full_torque_speed_rad_s",
                servo.full_torque_speed_rad_s,
                &full_torque_speed,
            ),
            (
                "no_torque_speed_rad_s",
                servo.no_torque_speed_rad_s,
                &format!(
                    "speed with zero torque, linear between [rad/s]; {}",
                    one_line(&origin.speed)
                ),
            ),
            (
                "rotor_inertia_kg_m2",
                servo.rotor_inertia_kg_m2,
                &format!(
                    "rotor inertia seen at the joint [kg m^2]; {}",
                    one_line(&origin.rotor_inertia)
                ),
            ),
        ] {
            figure(line, key, value, comment);
        }
        let MotorOrigin {
            torque,
            speed,
            rotor_inertia,
            friction,
            damping,
        } = origin;
        let mut origins = vec![
            ("torque", torque),
            ("speed", speed),
            ("rotor_inertia", rotor_inertia),
        ];
        // Joints without friction or damping have no figure of which to say where it is from.
        for (key, value, what, name, from) in [
            (
                "friction_n_m",
                servo.friction_n_m,
                "dry friction [N m]",
                "friction",
                friction,
            ),
            (
                "damping_n_m_s_rad",
                servo.damping_n_m_s_rad,
                "damping in the joint [N m s/rad]",
                "damping",
                damping,
            ),
        ] {
            if value != 0.0 {
                figure(line, key, value, &format!("{what}; {}", one_line(from)));
                origins.push((name, from));
            }
        }
        let origins = origins
            .iter()
            .map(|(name, from)| format!("{name} = {}", quoted(from)));
        line(&format!(
            "origin = {{ {} }}",
            origins.collect::<Vec<_>>().join(", ")
        ));
    }
}

fn home_text(robot: &Robot, origins: &Origins, line: &mut dyn FnMut(&str)) {
    let from = match &origins.reference {
        Some(name) => format!("It is the reference posture {}, with legs that are", one_line(name)),
        None => {
            "The knees are assumed to be bent by 0.7 rad, and the\n# arms hang, clear of the body. The legs are".into()
        }
    };
    line(&format!(
        "\n# Home posture [rad]. Joints that are not named are at 0. {from} solved for flat, level soles and the COM\n\
         # above their middle in x.\n[home_rad]"
    ));
    for (j, (joint, &angle)) in robot.joints.iter().zip(&robot.home_rad).enumerate() {
        if angle != 0.0 {
            let origin = match (origins.solved.contains(&j), &origins.reference) {
                (true, _) => "solved",
                (false, Some(_)) => "read",
                (false, None) => "assumed",
            };
            line(&format!(
                "{:<40}# {origin}",
                format!("{} = {}", key(&joint.name), decimal(angle))
            ));
        }
    }
}

/// A line with a number.
fn figure(line: &mut dyn FnMut(&str), key: &str, value: f64, comment: &str) {
    line(&format!(
        "{:<32}# {comment}",
        format!("{key} = {}", decimal(value))
    ));
}

fn key(name: &str) -> String {
    let is_bare = name
        .chars()
        .all(|c| c.is_ascii_alphanumeric() || "_-".contains(c))
        && !name.is_empty();
    if is_bare { name.into() } else { quoted(name) }
}
