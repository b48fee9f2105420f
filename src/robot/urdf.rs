//! Reads a [`Robot`] from a URDF and the settings beside it.
//!
//! What a URDF may contain stands in the module `tree`. `effort` and `velocity` of its limits and the `dynamics` of its
//! joints are not used, because the settings describe the servos.

use super::ankle::Ankle;
use super::kinematics::Kinematics;
use super::model::{Foot, PerFoot, Robot};
use super::settings::{self, Settings};
use super::tree::Tree;
use crate::assets::{self, Kind, Source};
use crate::error::{Error, Result};
use nalgebra::Vector3;
use std::path::Path;

/// Largest difference in height between the soles at home (m).
const LEVEL_M: f64 = 1e-4;
/// Largest tilt of each sole at home (rad).
const FLAT_RAD: f64 = 1e-3;

/// The error for a URDF file without its settings.
fn no_settings(urdf: &str, settings: &Path) -> Error {
    let problem = "the file with the robot's settings is missing";
    let accepted = "a TOML file beside the URDF with trunk, soles, home posture, servos, delay, friction and noise; \
                    the example is assets/robots/ut-mu2.toml, and the chapter Robots of the guide explains each key";
    Error::value(urdf, "settings", settings.display(), problem, accepted)
}

impl Robot {
    /// Loads a built-in robot by its name, or a URDF file with its settings beside it (same name, `.toml`).
    ///
    /// # Errors
    /// A file cannot be read, is malformed, or describes a robot that this program cannot simulate.
    pub fn load(name_or_path: &str) -> Result<Robot> {
        let urdf = assets::open(Kind::Robot, name_or_path)?;
        let settings = match urdf.file.strip_prefix("builtin:") {
            Some(name) => assets::open(Kind::RobotSettings, name)?,
            None => {
                let beside = Path::new(name_or_path).with_extension("toml");
                if !beside.exists() {
                    return Err(no_settings(name_or_path, &beside));
                }
                assets::open(Kind::RobotSettings, &beside.to_string_lossy())?
            }
        };
        let robot = Robot::parse(&urdf, &settings)?;
        robot.notes.iter().for_each(|note| log::warn!("{name_or_path}: {note}"));
        Ok(robot)
    }

    /// Builds a robot from the text of its two files. It fails as [`load`](Self::load) does.
    pub fn parse(urdf: &Source, settings: &Source) -> Result<Robot> {
        let tree = Tree::parse(urdf)?;
        let parsed: Settings = settings::parse(settings)?;
        let file = settings.file.as_str();
        let mut robot = Robot {
            trunk: parsed.trunk(file, &tree.frames)?,
            soles: parsed.soles(file, &tree)?,
            home_rad: parsed.home(file, &tree.joints)?,
            servos: parsed.servos(file, &tree.joints)?,
            noise: parsed.noise,
            delay_s: parsed.delay_s,
            friction: parsed.friction,
            reach: parsed.reach,
            assumptions: parsed.assumptions,
            name: tree.name,
            links: tree.links,
            joints: tree.joints,
            frames: tree.frames,
            notes: tree.notes,
        };
        check_home(file, &robot)?;
        for foot in Foot::BOTH {
            robot.soles[foot].ankle = Ankle::of(&robot, foot);
        }
        Ok(robot)
    }
}

/// Checks that the soles are flat and level with each other at home, without which no standing posture is defined.
fn check_home(file: &str, robot: &Robot) -> Result<()> {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &robot.home_posture());
    let soles = PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot));
    for foot in Foot::BOTH {
        let tilt = (soles[foot].rotation * Vector3::z()).angle(&Vector3::z());
        if tilt > FLAT_RAD {
            let value = format!("{} tilted by {tilt:.4} rad", robot.frames[robot.soles[foot].frame].name);
            let accepted = format!("up to {FLAT_RAD} rad with the base unrotated");
            return Err(Error::value(file, "home_rad", value, "soles must be flat at home", accepted));
        }
    }
    let step = soles.left.translation.z - soles.right.translation.z;
    if step.abs() > LEVEL_M {
        let value = format!("left sole {step:+.5} m above the right one");
        let accepted = format!("up to {LEVEL_M} m");
        return Err(Error::value(file, "home_rad", value, "soles must be level with each other at home", accepted));
    }
    Ok(())
}
