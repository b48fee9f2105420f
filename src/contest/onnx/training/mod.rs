//! What the training of a policy left, read into its file: `standfast init POLICY.onnx`. Each figure says whether it was read,
//! inferred, or assumed as its trainer usually does it.

mod known;
mod metadata;
mod text;
mod yaml;

use super::net;
use super::written::Written;
use crate::contest::beside;
use crate::error::{Error, Result};
use crate::robot::Robot;
use std::path::{Path, PathBuf};

/// Longest description that is read (bytes).
const MOST_BYTES: u64 = 10_000_000;

/// The file of the policy in `model` for a robot. It is read from the file `from`, or from one that lies where its trainer
/// puts it, or from the network's own metadata. Errors: none of these says what the policy observes, or what one says does
/// not fit the robot.
pub fn written(model: &Path, from: Option<&Path>, robot: &Robot) -> Result<Written> {
    let file = model.to_string_lossy();
    let bad = |problem: String, accepted: &str| Error::value(&file, "model", file.clone(), problem, accepted);
    let bytes = crate::assets::read(model, beside::MOST_FILE_BYTES)?;
    let metadata = net::metadata(&bytes).map_err(|problem| bad(problem, "an ONNX file"))?;
    let training = match from.map(PathBuf::from).or_else(|| description(model)) {
        Some(path) => {
            let text = String::from_utf8_lossy(&crate::assets::read(&path, MOST_BYTES)?).into_owned();
            yaml::training(&path.to_string_lossy(), &text, robot)?
        }
        None => metadata::training(&file, &metadata, robot)?.ok_or_else(|| {
            let accepted = "the metadata of holosoma or mjlab in it, or --from with a deploy.yaml of unitree_rl_lab or the \
                            configuration of unitree_rl_gym. The guide's chapter onnx.md has the file to write by hand";
            bad("says nothing of its joints and of what it observes".into(), accepted)
        })?,
    };
    Ok(Written { text: text::toml(model, &training), assumed: training.assumed(), by: training.by })
}

/// The description of a policy where its trainer puts it.
fn description(model: &Path) -> Option<PathBuf> {
    let folder = model.parent().unwrap_or(Path::new(""));
    let of_stem = |end: &str| model.with_extension(end);
    let exported =
        [folder.join("deploy.yaml"), folder.join("params/deploy.yaml"), folder.join("../params/deploy.yaml")];
    [of_stem("deploy.yaml"), of_stem("yaml")].into_iter().chain(exported).find(|path| path.is_file())
}
