//! Output for people and other programs: text, plots, pages, pictures and tables. These modules draw and write results,
//! and simulate nothing.

pub mod figure;
pub mod html;
pub mod html_page;
pub mod junit;
pub mod markdown;
pub mod mcap;
pub mod picture;
pub mod replay;
pub mod result;
pub mod scene;
pub mod table;
pub mod tables;
pub mod text;
pub mod trace;
pub mod trial_page;
pub mod tune_page;

use crate::campaign::Summary;
use crate::campaign::verdict::set_summary::SetOrigin;
use crate::error::{Error, Result};
use crate::files::{json_pretty, shell_word};
use std::io::ErrorKind;
use std::path::Path;

/// Names of the files in a folder whose files may be replaced, or none if the folder does not exist. Fails if the path
/// is a file, or if the folder holds a file whose name is not `own`. Errors name `option`, the command-line option that
/// gave the folder.
pub fn own_folder(option: &str, folder: &Path, own: impl Fn(&str) -> bool, accepted: &str) -> Result<Vec<String>> {
    let refuse = |problem: String| Err(Error::option(option, folder.display(), problem, accepted));
    let fail = |source| Error::Read { path: folder.into(), source };
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) if e.kind() == ErrorKind::NotADirectory => return refuse("it is a file".into()),
        Err(source) => return Err(fail(source)),
    };
    let mut names = Vec::new();
    for entry in entries {
        let name = entry.map_err(fail)?.file_name().to_string_lossy().into_owned();
        if !own(&name) {
            return refuse(format!("it holds {name:?}"));
        }
        names.push(name);
    }
    Ok(names)
}

/// A value as indented JSON, for the terminal or a file.
pub fn json(value: &impl serde::Serialize) -> String {
    // Only a map whose keys are not text can fail, and there is none.
    json_pretty(value).unwrap_or_default()
}

/// The command that simulates a trial of the result in `folder` again with a controller.
pub fn replay_command(summary: &Summary, set: &str, trial: u64, folder: &Path) -> String {
    let found = summary.sets.iter().find(|found| found.name == set).map(|found| found.origin.clone());
    replay_parts(&found.unwrap_or_else(|| SetOrigin::own(set)), folder).join(&trial.to_string())
}

/// The parts of the replay command before and after the number of the trial.
fn replay_parts(origin: &SetOrigin, folder: &Path) -> [String; 2] {
    let campaign = folder.join(&origin.campaign).display().to_string();
    let [campaign, gains] = [&campaign, &origin.gains].map(|word| shell_word(word));
    [format!("standfast push --campaign {campaign} --trial "), format!(" --controller {gains}")]
}

/// The JSON object with the fields of `record` added to its own.
pub fn with_fields_of(mut object: serde_json::Value, record: &impl serde::Serialize) -> serde_json::Value {
    use serde_json::Value::Object;
    if let (Object(all), Ok(Object(more))) = (&mut object, serde_json::to_value(record)) {
        all.extend(more);
    }
    object
}
