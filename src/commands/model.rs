//! `standfast model`: prints a robot as it was read, and its kinematics at given joint angles.

use super::arguments::MotorsArgs;
use super::terminal::print;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_files::assets::DEFAULT_ROBOT;
use standfast_report::text::model;
use standfast_robots::urdf::Files;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast model                               UT-mu2
  standfast model my.urdf                       what was understood of a robot
  standfast model --set left_knee_flexion=0.7   where COM and links are then
  standfast model my.urdf --json                all of it, for a program

With --json the kinematics have the base at the origin, unrotated. The settings
of a robot are in a .toml file of the same name beside its URDF or MJCF, or are inferred.")]
pub struct ModelArgs {
    /// Robot by name, or URDF or MJCF file
    #[arg(value_name = "URDF", default_value = DEFAULT_ROBOT)]
    pub robot: String,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Print where COM and links are at this joint angle; others are at 0
    #[arg(long, value_name = "JOINT=RAD", value_delimiter = ',')]
    pub set: Vec<String>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &ModelArgs) -> Result<ExitCode> {
    print(&answer(args)?)
}

/// What to print. Fails if the robot cannot be loaded, has no joint of a given name, or if an angle is not a finite
/// number.
fn answer(args: &ModelArgs) -> Result<String> {
    let robot = Files::open(&args.robot)?
        .with_motors(args.motors.file.as_deref())?
        .load()?;
    let q = joint_angles(&robot, &args.set)?;
    if args.json {
        return Ok(standfast_report::json(&model::kinematics_json(&robot, &q)));
    }
    let links = if args.set.is_empty() {
        String::new()
    } else {
        model::links(&robot, &q)
    };
    Ok(model::description(&robot) + &links)
}

/// The angle of every joint (rad), from assignments `joint=rad`. Joints that are not named are at 0.
fn joint_angles(robot: &Robot, assignments: &[String]) -> Result<Vec<f64>> {
    let mut q: Vec<Option<f64>> = vec![None; robot.joints.len()];
    for assignment in assignments {
        let Some((name, value)) = assignment
            .split_once('=')
            .map(|(n, v)| (n.trim(), v.trim()))
        else {
            return Err(Error::value(
                "--set",
                "angle",
                assignment,
                "not an assignment",
                "JOINT=RAD",
            ));
        };
        let Some(joint) = robot.joints.iter().position(|j| j.name == name) else {
            return Err(Error::value(
                "--set",
                name,
                value,
                "no such joint",
                model::joint_names(robot).join(", "),
            ));
        };
        let angle = value.parse::<f64>().ok().filter(|a| a.is_finite());
        let Some(angle) = angle else {
            return Err(Error::value(
                "--set",
                name,
                value,
                "not an angle",
                "a finite number (rad)",
            ));
        };
        let (least, most) = (robot.joints[joint].lower_rad, robot.joints[joint].upper_rad);
        if !(least..=most).contains(&angle) {
            let accepted = format!(
                "{least:.4} to {most:.4} rad (the unit is fixed: 90 degrees are 1.5708 rad)"
            );
            return Err(Error::value(
                "--set",
                name,
                format!("{value} rad"),
                "is beyond the joint's range",
                accepted,
            ));
        }
        if q[joint].replace(angle).is_some() {
            return Err(Error::value(
                "--set",
                name,
                value,
                "given twice",
                "each joint once",
            ));
        }
    }
    Ok(q.into_iter().map(|angle| angle.unwrap_or(0.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn args(q: &[&str], json: bool) -> ModelArgs {
        ModelArgs {
            robot: "ut-mu2".into(),
            motors: MotorsArgs::default(),
            set: q.iter().map(|s| s.to_string()).collect(),
            json,
        }
    }

    #[test]
    fn json_has_the_kinematics_at_the_given_angles() {
        let text = answer(&args(
            &[
                "left_knee_flexion=1.5707963267948966",
                "right_knee_flexion=0.1",
            ],
            true,
        ))
        .unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        assert!((json["mass_kg"].as_f64().unwrap() - 8.0).abs() < 1e-4);
        assert_eq!(json["joints"][7], "left_knee_flexion");
        assert_eq!(json["com_jacobian"].as_array().unwrap().len(), 3);
        assert_eq!(json["com_jacobian"][2].as_array().unwrap().len(), 26);
        assert_eq!(json["links"].as_object().unwrap().len(), 26);
        // The shin points backwards: knee at (-0.046, 0.055, -0.233), ankle at (-0.008, 0, -0.113) in the shin.
        let ankle = &json["links"]["left_ankle_flexion"];
        let at = |k: usize| ankle["position_m"][k].as_f64().unwrap();
        assert!(
            (at(0) - (-0.046 - 0.113)).abs() < 1e-12 && (at(2) - (-0.233 + 0.008)).abs() < 1e-12,
            "{ankle}"
        );
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turn = |k: usize| ankle["quaternion_wxyz"][k].as_f64().unwrap();
        assert!(
            (turn(0) - half).abs() < 1e-12 && (turn(2) - half).abs() < 1e-12,
            "{ankle}"
        );
    }

    #[test]
    fn bad_angles_are_refused() {
        for (q, expected) in [
            (
                "left_knee=1",
                "--set: left_knee = 1: no such joint; accepted: left_shoulder_flexion, ",
            ),
            (
                "left_knee_flexion=x",
                "--set: left_knee_flexion = x: not an angle",
            ),
            (
                "left_knee_flexion=nan",
                "--set: left_knee_flexion = nan: not an angle",
            ),
            (
                "left_knee_flexion=40",
                "--set: left_knee_flexion = 40 rad: is beyond the joint's range; accepted: 0.0000 to 1.9199 rad",
            ),
            ("left_knee_flexion", "left_knee_flexion: not an assignment"),
        ] {
            let error = answer(&args(&[q], true)).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
        assert!(
            answer(&args(
                &["left_knee_flexion=1", "left_knee_flexion=1"],
                false
            ))
            .is_err()
        );
    }

    /// The text on one line.
    fn read(text: &str) -> String {
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_swing_that_the_motors_cannot_make_is_told() {
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        robot.reach[0].swing_time_s = 0.14;
        robot.reach[1].x_m[1] = 0.5;
        let text = read(&model::description(&robot));
        let too_short = "in 0.14 s; WARNING: less than the 0.146 s that the motors of a leg need";
        let too_far = "sideways from 0.25 of it on; WARNING: the legs do not reach all of it";
        assert!(text.contains(too_short) && text.contains(too_far), "{text}");
        assert_eq!(text.matches("WARNING").count(), 2, "{text}");
    }

    /// Joints that are not named are at 0, which may be beyond their range.
    #[test]
    fn a_joint_beyond_its_range_is_told() {
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        robot.joints[7].lower_rad = 0.1;
        let text = model::links(&robot, &joint_angles(&robot, &[]).unwrap());
        assert!(
            text.contains("left_knee_flexion = 0 rad is outside its limits (0.1000 to 1.9199 rad)"),
            "{text}"
        );
    }

    #[test]
    fn the_text_describes_the_robot() {
        let text = read(&answer(&args(&["right_knee_flexion=0.1"], false)).unwrap());
        for part in [
            "20 joints",
            "beside: x -150 to 150 mm, y 75 to 180 mm, in 0.15 s; the motors of a leg need 0.146 s",
            "in front: x 105 to 130 mm, y -30 to 75 mm, in 0.2 s, sideways from 0.25 of it on;",
            "96.172 x 69.172 x 7.288 mm",
            "[battery_and_boards]",
            "Assumed",
        ] {
            assert!(text.contains(part), "{part} not in:\n{text}");
        }
    }
}
