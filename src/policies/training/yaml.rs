//! The descriptions of policies in YAML: which format a file has.

use super::booster::Booster;
use super::deploy::Deploy;
use super::descriptors::Descriptors;
use super::gym::Gym;
use super::humanoidverse::HumanoidVerse;
use super::known::Training;
use super::leapp::Leapp;
use super::lists::parsed;
use super::rl_sar::RlSar;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;

/// The formats that are read, in words.
pub const FORMATS: &str = "a deploy.yaml of unitree_rl_lab, a description by LEAPP, IO_descriptors of Isaac Lab, or a configuration of \
     unitree_rl_gym, booster_gym, HumanoidVerse (ASAP, FALCON) or rl_sar";

/// The training that this file describes.
pub fn training(file: &str, text: &str, robot: &Robot) -> Result<Training> {
    // Each format has a key that the others lack, at the start of a line or within a table.
    let states = |key: &str| text.lines().any(|line| line.starts_with(key));
    let has = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
    if states("joint_ids_map:") {
        return Deploy::training(parsed(file, text)?, file, robot);
    }
    if states("pipeline:") {
        return Leapp::training(parsed(file, text)?, file, robot);
    }
    if states("articulations:") {
        return Descriptors::training(parsed(file, text)?, file);
    }
    if states("JOINT_KP:") {
        return HumanoidVerse::training(parsed(file, text)?, file, robot);
    }
    if has("default_qpos:") {
        return Booster::training(parsed(file, text)?, file, robot);
    }
    if has("rl_kp:") {
        return RlSar::training(file, text);
    }
    if !states("kps:") {
        let accepted = format!(
            "{FORMATS}; the guide's chapter onnx.md has the file of a policy to write by hand"
        );
        return Err(Error::value(
            file,
            "description",
            file,
            "describes no policy that is known here",
            accepted,
        ));
    }
    let missing: Vec<&str> = Gym::KEYS
        .into_iter()
        .filter(|key| !states(&format!("{key}:")))
        .collect();
    if missing.is_empty() {
        return Gym::training(parsed(file, text)?, file, robot);
    }
    let what = match states("control_dt:") {
        true => "a configuration of unitree_rl_gym for the robot itself (deploy_real)",
        false => "a configuration with kps",
    };
    let accepted = "that for the simulation (deploy_mujoco of unitree_rl_gym), which states it";
    Err(Error::value(
        file,
        "description",
        what,
        format!("does not state {}", missing.join(", ")),
        accepted,
    ))
}
