//! A robot as it was read, and its kinematics at given joint angles, as text and JSON.

use crate::table::{Table, cell, headings, number, texts};
use crate::text::layout::{signed, wrapped};
use nalgebra::Matrix3xX;
use serde_json::{Map, Value, json};
use standfast_core::robot::swing_time::least_swing_time_s;
use standfast_core::robot::{Foot, Joint, Kinematics, MotorOrigin, Robot};
use standfast_sim::Pairs;
use std::fmt::Write;

/// Names of the joints, in the order of joint angles.
pub fn joint_names(robot: &Robot) -> Vec<&str> {
    robot
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect()
}

/// Kinematics at joint angles `q` (rad), with the base at the origin, unrotated.
fn at(robot: &Robot, q: &[f64]) -> Kinematics {
    let mut posture = robot.zero_posture();
    posture.q.copy_from_slice(q);
    Kinematics::at(robot, &posture)
}

/// Mass, COM, COM Jacobian (columns: base linear, base angular, joints) and link poses at joint angles `q` (rad), with
/// the base at the origin, unrotated; then everything that does not depend on the angles.
pub fn kinematics_json(robot: &Robot, q: &[f64]) -> Value {
    let kinematics = at(robot, q);
    let mut jacobian = Matrix3xX::zeros(6 + robot.joints.len());
    kinematics.com_jacobian(robot, &mut jacobian);
    let rows: Vec<Vec<f64>> = jacobian
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    let mut links = Map::new();
    for (i, frame) in robot.frames.iter().enumerate() {
        let pose = kinematics.frame_pose(robot, i);
        // A rotation has two quaternions; the one with w >= 0 is taken.
        let turn = if pose.rotation.w < 0.0 {
            -pose.rotation.into_inner()
        } else {
            pose.rotation.into_inner()
        };
        links.insert(
            frame.name.clone(),
            json!({
                "position_m": pose.translation.vector.as_slice(),
                "quaternion_wxyz": [turn.w, turn.i, turn.j, turn.k],
            }),
        );
    }
    let by_joint = |value: &dyn Fn(usize) -> Value| -> Map<String, Value> {
        robot
            .joints
            .iter()
            .enumerate()
            .map(|(i, joint)| (joint.name.clone(), value(i)))
            .collect()
    };
    let [left, right] = Foot::BOTH.map(|foot| {
        let sole = &robot.soles[foot];
        json!({
            "link": robot.frames[sole.frame].name,
            "length_m": 2.0 * sole.half_m[0],
            "width_m": 2.0 * sole.half_m[1],
            "thickness_m": sole.thickness_m,
        })
    });
    let pairs = Pairs::new(robot);
    let touching: Vec<_> = pairs
        .touching_at_home
        .iter()
        .map(|pair| pair.map(|link| &robot.links[link].name))
        .collect();
    json!({
        "name": robot.name,
        "mass_kg": robot.mass(),
        "com_m": kinematics.com().coords.as_slice(),
        "joints": joint_names(robot),
        "q_rad": q,
        "com_jacobian": rows,
        "links": links,
        "limits_rad": by_joint(&|i| json!([robot.joints[i].lower_rad, robot.joints[i].upper_rad])),
        "home": {
            "q_rad": by_joint(&|i| json!(robot.home_rad[i])),
            "com_height_m": robot.home_com_height(),
            "omega_rad_s": robot.omega(),
        },
        "trunk": robot.links[robot.trunk].name,
        "soles": { "left": left, "right": right },
        "servos": by_joint(&|i| json!(robot.servos[i])),
        "motor_origins": by_joint(&|i| json!(robot.motor_origins[i])),
        "hardest_on_one_leg": robot.hardest_on_one_leg().map(|(joint, share)| json!({
            "joint": robot.joints[joint].name,
            "share_of_torque": share,
        })),
        "friction": robot.friction,
        "delay_s": robot.delay_s,
        "noise": robot.noise,
        "contacts": {
            "colliding_pairs": pairs.count(),
            "touching_at_home": touching,
        },
        "reach": robot.reach,
        "notes": robot.notes,
        "assumptions": robot.assumptions,
    })
}

/// Everything that does not depend on joint angles, as text.
pub fn description(robot: &Robot) -> String {
    let kinematics = Kinematics::at_home(robot);
    let com = kinematics.com();
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |s: String| _ = writeln!(text, "{s}");
    line(format!(
        "{}: {} joints, {:.6} kg",
        robot.name,
        robot.joints.len(),
        robot.mass()
    ));
    let mut item = |mark: &str, what: String| line(wrapped(mark, &what).trim_end().into());
    item(
        "home     ",
        format!(
            "the COM is at {}, {} mm (x, y) from the middle of the soles, {:.4} m above them; omega is {:.4} rad/s",
            signed(1e3 * com.x, 2),
            signed(1e3 * com.y, 2),
            com.z,
            robot.omega()
        ),
    );
    item(
        "trunk    ",
        format!(
            "{} (it carries the IMU, and pushes act on it)",
            robot.links[robot.trunk].name
        ),
    );
    for foot in Foot::BOTH {
        let sole = &robot.soles[foot];
        let center = kinematics.sole_pose(robot, foot).translation;
        item(
            "sole     ",
            format!(
                "{}: {} x {} x {} mm (x, y, z), at home centred at {}, {} mm",
                robot.frames[sole.frame].name,
                short(2e3 * sole.half_m[0]),
                short(2e3 * sole.half_m[1]),
                short(1e3 * sole.thickness_m),
                signed(1e3 * center.x, 2),
                signed(1e3 * center.y, 2)
            ),
        );
    }
    if let Some((joint, share)) = robot.hardest_on_one_leg() {
        let (name, percent) = (&robot.joints[joint].name, 100.0 * share);
        item(
            "one leg  ",
            format!("carries the robot with {percent:.0} % of the torque of {name}"),
        );
    }
    let noise = &robot.noise;
    item("ground   ", format!("friction {}", robot.friction));
    item(
        "delay    ",
        format!("{} ms from sensing to torque", 1e3 * robot.delay_s),
    );
    item(
        "noise    ",
        format!(
            "encoders {} rad, gyro {} rad/s, orientation {} rad, accelerometer {} m/s^2, soles {} N and {} N m",
            noise.joint_angle_rad,
            noise.gyro_rad_s,
            noise.orientation_rad,
            noise.accelerometer_m_s2,
            noise.sole_force_n,
            noise.sole_moment_n_m
        ),
    );
    let pairs = Pairs::new(robot);
    item(
        "contact  ",
        format!(
            "{} pairs of links collide: of both legs, and of an arm with trunk, legs and the other arm; {} more touch at home, \
             and do not",
            pairs.count(),
            pairs.touching_at_home.len()
        ),
    );
    reach_text(robot, &mut item);
    line("\nTree of links: mass of each moving link, and in brackets what is fixed to it".into());
    tree_text(robot, 0, 1, &mut line);
    line(format!(
        "\n{}\n{}",
        joint_table(robot),
        servo_table(robot).trim_end()
    ));
    line(motor_origins(robot));
    for (heading, sentences) in [
        ("Changed or left out on reading", &robot.notes),
        ("Assumed, because it is not published", &robot.assumptions),
    ] {
        if !sentences.is_empty() {
            line(format!("\n{heading}"));
            for sentence in sentences {
                line(wrapped("  - ", sentence).trim_end().into());
            }
        }
    }
    text
}

/// Writes where a foot can land, and whether the motors can swing it there in the time that the settings state.
fn reach_text(robot: &Robot, item: &mut impl FnMut(&str, String)) {
    if robot.reach.is_empty() {
        return item("reach    ", "not given".into());
    }
    let about = "where a foot can land: offsets from the stance sole's centre, x forward and y to the side of the swing foot, and \
                 the time of the swing (`limit` uses this)";
    item("reach    ", about.into());
    for region in &robot.reach {
        let ([x0, x1], [y0, y1]) = (region.x_m, region.y_m);
        let around = match region.sideways_from {
            0.0 => String::new(),
            share => format!(", sideways from {share} of it on"),
        };
        let [x0, x1, y0, y1] = [x0, x1, y0, y1].map(|length_m| short(1e3 * length_m));
        let (name, time_s) = (&region.name, region.swing_time_s);
        item(
            "         ",
            format!("{name}: x {x0} to {x1} mm, y {y0} to {y1} mm, in {time_s} s{around};"),
        );
        let needs = match least_swing_time_s(robot, region) {
            Some(least_s) if least_s <= time_s => {
                format!("the motors of a leg need {least_s:.3} s for its farthest corner")
            }
            Some(least_s) => {
                format!(
                    "WARNING: less than the {least_s:.3} s that the motors of a leg need for its farthest corner"
                )
            }
            None => "WARNING: the legs do not reach all of it".into(),
        };
        item("           ", needs);
    }
}

/// Writes a link and, indented, the links that it carries.
fn tree_text(robot: &Robot, link: usize, depth: usize, line: &mut impl FnMut(String)) {
    let body = &robot.links[link];
    let fixed: Vec<&str> = robot
        .frames
        .iter()
        .filter(|frame| frame.link == link && frame.name != body.name)
        .map(|frame| frame.name.as_str())
        .collect();
    let fixed = if fixed.is_empty() {
        String::new()
    } else {
        format!(" [{}]", fixed.join(", "))
    };
    let by = link
        .checked_sub(1)
        .map(|j| robot.joints[j].name.as_str())
        .filter(|name| *name != body.name);
    let by = by
        .map(|name| format!(" (joint {name})"))
        .unwrap_or_default();
    let mark = format!("{:indent$}{} ", "", body.name, indent = 2 * depth);
    line(
        wrapped(&mark, &format!("{:.6} kg{fixed}{by}", body.mass_kg))
            .trim_end()
            .into(),
    );
    for (j, joint) in robot.joints.iter().enumerate() {
        if joint.parent == link {
            tree_text(robot, j + 1, depth + 1, line);
        }
    }
}

fn joint_table(robot: &Robot) -> String {
    let mut joints = Table::new(
        "",
        headings("joint", ["axis", "limits [deg]", "limits [rad]"]),
    );
    for joint in &robot.joints {
        let axis = [joint.axis.x, joint.axis.y, joint.axis.z]
            .map(short)
            .join(" ");
        let limits = [
            range(joint, 1, f64::to_degrees),
            range(joint, 4, std::convert::identity),
        ];
        joints.row(texts([joint.name.clone(), axis]).chain(texts(limits)));
    }
    joints.text()
}

/// The limits of a joint, converted and with `decimals` decimals.
fn range(joint: &Joint, decimals: usize, convert: impl Fn(f64) -> f64) -> String {
    match [joint.lower_rad, joint.upper_rad].map(convert) {
        [lower, upper] if lower.is_finite() && upper.is_finite() => {
            format!("{lower:.decimals$} to {upper:.decimals$}")
        }
        _ => "none".into(),
    }
}

/// A component of an axis with at most three decimals, without trailing zeros.
fn short(component: f64) -> String {
    ((1e3 * component).round() / 1e3 + 0.0).to_string()
}

/// Whether a joint has friction or damping.
fn has_losses(robot: &Robot) -> bool {
    let mut servos = robot.servos.iter();
    servos.any(|servo| servo.friction_n_m != 0.0 || servo.damping_n_m_s_rad != 0.0)
}

fn servo_table(robot: &Robot) -> String {
    let head = ["home", "kp", "kd", "torque", "full to", "none at", "rotor"];
    let mut note = "Servos: the angle at home in rad, kp in N m/rad, kd in N m s/rad, the torque in N m, up to which speed it is \
                    there in full and at which there is none in rad/s, and the inertia of the rotor in kg m^2."
        .to_string();
    let losses: &[&str] = if has_losses(robot) {
        &["friction", "damping"]
    } else {
        &[]
    };
    if !losses.is_empty() {
        note += " Of the joints: their dry friction in N m and their damping in N m s/rad.";
    }
    let columns = headings("joint", head).chain(losses.iter().copied().map(number));
    let mut servos = Table::new("", columns).with_note(note);
    for ((joint, servo), home_rad) in robot.joints.iter().zip(&robot.servos).zip(&robot.home_rad) {
        let numbers = [
            servo.kp,
            servo.kd,
            servo.torque_n_m,
            servo.full_torque_speed_rad_s,
            servo.no_torque_speed_rad_s,
            servo.rotor_inertia_kg_m2,
            servo.friction_n_m,
            servo.damping_n_m_s_rad,
        ];
        let names = texts([joint.name.clone(), format!("{home_rad:.4}")]);
        // A row ends with the last column.
        servos.row(
            names
                .chain(numbers.map(cell))
                .take(1 + head.len() + losses.len()),
        );
    }
    servos.text()
}

/// Where the figures of the motors are from, each figure with the number of joints of each origin.
fn motor_origins(robot: &Robot) -> String {
    type Origin = fn(&MotorOrigin) -> &str;
    let mut figures: Vec<(_, Origin)> = vec![
        ("torque", |of| &of.torque),
        ("speeds", |of| &of.speed),
        ("rotor", |of| &of.rotor_inertia),
    ];
    if has_losses(robot) {
        figures.extend([
            ("friction", (|of| &of.friction) as Origin),
            ("damping", |of| &of.damping),
        ]);
    }
    let told = figures.into_iter().map(|(name, origin)| {
        let mut origins: Vec<(&str, usize)> = Vec::new();
        for from in robot.motor_origins.iter().map(origin) {
            match origins.iter_mut().find(|(known, _)| *known == from) {
                Some((_, joints)) => *joints += 1,
                None => origins.push((from, 1)),
            }
        }
        let origins: Vec<String> = origins
            .into_iter()
            .map(|(from, joints)| format!("{from} ({joints})"))
            .collect();
        format!("{name} {}", origins.join(", "))
    });
    let from = format!(
        "Origins of the motors' figures, with numbers of joints: {}.",
        told.collect::<Vec<_>>().join("; ")
    );
    wrapped("", &from).trim_end().into()
}

/// Positions of COM and links at joint angles `q` (rad), and a note for each angle outside of its limits.
pub fn links(robot: &Robot, q: &[f64]) -> String {
    let kinematics = at(robot, q);
    let com = kinematics.com();
    let mut text =
        String::from("\nPositions at the given angles, with the base at the origin [m]\n");
    let width = robot
        .frames
        .iter()
        .map(|f| f.name.len())
        .max()
        .unwrap_or(0)
        .max(3);
    let mut line = |name: &str, p: [f64; 3]| {
        _ = writeln!(
            text,
            "  {name:width$} {:+.6} {:+.6} {:+.6}",
            p[0], p[1], p[2]
        );
    };
    line("COM", com.coords.into());
    for (i, frame) in robot.frames.iter().enumerate() {
        line(
            &frame.name,
            kinematics.frame_pose(robot, i).translation.vector.into(),
        );
    }
    for (joint, &angle) in robot.joints.iter().zip(q) {
        if !(joint.lower_rad..=joint.upper_rad).contains(&angle) {
            _ = writeln!(
                text,
                "  note: {} = {angle} rad is outside its limits ({:.4} to {:.4} rad)",
                joint.name, joint.lower_rad, joint.upper_rad
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_and_damping_are_told_where_there_is_any() {
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        let without = description(&robot);
        assert!(
            !without.contains("damping in N m s/rad") && !without.contains("friction settings")
        );
        robot.servos[3].friction_n_m = 0.125;
        robot.servos[5].damping_n_m_s_rad = 0.0375;
        robot.motor_origins[3].friction = "measured".into();
        let with = description(&robot);
        let row = |joint: usize, ends: &str| {
            let name = &robot.joints[joint].name;
            let mut lines = with.lines().map(str::trim);
            lines.any(|line| line.starts_with(name.as_str()) && line.ends_with(ends))
        };
        assert!(row(3, " 0.125        0"), "{with}");
        assert!(row(5, " 0   0.0375"), "{with}");
        let words = with.split_whitespace().collect::<Vec<_>>().join(" ");
        let origins = "friction settings (19), measured (1); damping settings (20).";
        assert!(words.contains(origins), "{with}");
    }
}
