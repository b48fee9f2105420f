//! Reads the records of a policy's training into a file: `standfast init POLICY.onnx`. Each figure says whether it was
//! read, inferred, or assumed as its trainer usually does it.

mod booster;
mod deploy;
mod descriptors;
mod gym;
mod humanoidverse;
mod known;
mod leapp;
mod lists;
mod metadata;
mod rl_sar;
#[cfg(test)]
mod tests;
mod text;
mod yaml;

use known::Training;

use super::net;
use standfast_controllers::PolicyFile;
use standfast_controllers::companion_files;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_files::assets;
use standfast_robots::motors::Motors;
use std::path::{Path, PathBuf};

/// Largest size of a description that is read (bytes).
const MOST_BYTES: u64 = 10_000_000;

/// Writes the file of the policy in `model` for a robot. The description is read from the file `from` or the
/// `.deploy.yaml` of the policy's name, else from the metadata of the network, else from where a trainer puts a
/// description. It fails if no description is found, or if a description does not fit the robot.
pub fn written(model: &Path, from: Option<&Path>, robot: &Robot) -> Result<PolicyFile> {
    let training = training(model, from, robot)?;
    Ok(PolicyFile {
        text: text::toml(model, &training),
        assumed: training.assumed(),
        by: training.by,
    })
}

/// The motors of the training of a policy (`.onnx`, `.pt`), or of one that a description (`.yaml`) is of.
pub fn motors(path: &Path, robot: &Robot) -> Result<Motors> {
    let is_description = path.extension().is_some_and(|extension| {
        ["yaml", "yml"]
            .iter()
            .any(|yaml| extension.eq_ignore_ascii_case(yaml))
    });
    let training = match is_description {
        true => described(path, robot)?,
        false => training(path, None, robot)?,
    };
    let list = |figure: &Option<known::Figure<Vec<f64>>>| {
        figure.as_ref().map(|figure| figure.value.clone())
    };
    let [torque_n_m, rotor_inertia_kg_m2] = [
        list(&training.torque_n_m),
        list(&training.rotor_inertia_kg_m2),
    ];
    Ok(Motors::of_training(
        path,
        &training.joints.value,
        torque_n_m.as_deref(),
        rotor_inertia_kg_m2.as_deref(),
    ))
}

/// The training that a description of a policy is of.
fn described(path: &Path, robot: &Robot) -> Result<Training> {
    let text = String::from_utf8_lossy(&assets::read(path, MOST_BYTES)?).into_owned();
    yaml::training(&path.to_string_lossy(), &assets::without_mark(text), robot)
}

fn training(model: &Path, from: Option<&Path>, robot: &Robot) -> Result<Training> {
    let file = model.to_string_lossy();
    let bad = |problem: String, accepted: &str| {
        Error::value(&file, "model", file.clone(), problem, accepted)
    };
    let bytes = assets::read(model, companion_files::MOST_FILE_BYTES)?;
    let metadata =
        net::metadata(&bytes).map_err(|problem| bad(problem, "an ONNX or TorchScript file"))?;
    let own = model.with_extension("deploy.yaml");
    let stated = from
        .map(Path::to_path_buf)
        .or_else(|| own.is_file().then_some(own));
    // The metadata surely belong to this policy; another description beside it may belong to another one.
    let training = match &stated {
        Some(path) => Some(described(path, robot)?),
        None => metadata::training(&file, &metadata, robot)?,
    };
    let training = match (training, description(model)) {
        (Some(training), _) => training,
        (None, Some(path)) => described(&path, robot)?,
        (None, None) => {
            let accepted = format!(
                "the metadata of holosoma or mjlab in it, or behind it {}. The guide's chapter onnx.md has the file to write by hand",
                yaml::FORMATS
            );
            return Err(bad(
                "says nothing of its joints and of what it observes".into(),
                &accepted,
            ));
        }
    };
    training.check()?;
    Ok(training)
}

/// The description of a policy where its trainer puts it.
fn description(model: &Path) -> Option<PathBuf> {
    let folder = model.parent().unwrap_or(Path::new(""));
    let exported = [
        folder.join("deploy.yaml"),
        folder.join("params/deploy.yaml"),
        folder.join("../params/deploy.yaml"),
        folder.join("config.yaml"),
        folder.join("IO_descriptors.yaml"),
    ];
    [model.with_extension("yaml")]
        .into_iter()
        .chain(exported)
        .find(|path| path.is_file())
}
