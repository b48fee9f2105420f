//! What a person or another program is told: reports of runs, descriptions of robots and sets, pictures, progress.

mod change;
mod comparison;
pub mod cpi;
mod cpi_plot;
pub mod html;
mod html_page;
pub mod junit;
mod layout;
pub mod limit;
mod limit_plot;
pub mod markdown;
pub mod model;
pub mod motion;
pub mod motion_plot;
pub mod outputs;
pub mod palette;
pub mod paper;
pub mod picture;
pub mod plot;
pub mod progress;
pub mod push;
pub mod replay;
pub mod replays;
pub mod response;
mod response_plot;
pub mod result;
pub mod scale;
pub mod scenario;
mod story;
pub mod table;
pub mod trace;

pub use change::ChangeArgs;
pub use comparison::failed_gates;

use crate::campaign::Summary;
use crate::error::{Error, Result};
use crate::files::shell_word;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Prints to the standard output; a reader that has gone (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write { path: "standard output".into(), source: e }),
        _ => Ok(()),
    }
}

/// The files in a folder that `option` names and whose files may be replaced; none if it is not there. Errors: it is a file,
/// or holds one whose name is not `own`.
pub(crate) fn own_folder(
    option: &str,
    folder: &Path,
    own: impl Fn(&str) -> bool,
    accepted: &str,
) -> Result<Vec<String>> {
    let refuse = |problem: String| Err(Error::value("arguments", option, folder.display(), problem, accepted));
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

/// One JSON object, as it is printed.
pub fn json(value: &impl serde::Serialize) -> String {
    // Only a map with keys that are not text could fail; there is none.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}

/// The command that replays a trial of a result in `folder`.
pub fn replay_command(summary: &Summary, set: &str, trial: u64, folder: &Path) -> String {
    let origin = summary.sets.iter().find(|found| found.name == set).map(|found| &found.origin);
    let (campaign, gains) = origin.map_or(("campaign.toml", set), |origin| (&origin.campaign, &origin.gains));
    let [before, after] = replay_parts(&folder.join(campaign).display().to_string(), gains);
    format!("{before}{trial}{after}")
}

/// What stands before and after the number of a trial in the command that replays it.
fn replay_parts(campaign: &str, gains: &str) -> [String; 2] {
    let [campaign, gains] = [campaign, gains].map(shell_word);
    [format!("standfast push --campaign {campaign} --trial "), format!(" --gains {gains}")]
}

/// A JSON object with the fields of `record` after its own.
fn with_fields_of(mut object: serde_json::Value, record: &impl serde::Serialize) -> serde_json::Value {
    use serde_json::Value::Object;
    if let (Object(all), Ok(Object(more))) = (&mut object, serde_json::to_value(record)) {
        all.extend(more);
    }
    object
}

/// A file to write that fails at once, not after all the work: of an unknown kind, or in a folder that is not there.
pub(crate) fn check_output(option: &str, path: &Path, kinds: &[&str]) -> Result<()> {
    let fail = |problem, accepted: &str| Err(Error::value("arguments", option, path.display(), problem, accepted));
    if !path.extension().and_then(|e| e.to_str()).is_some_and(|e| kinds.contains(&e)) {
        return fail("unknown kind of file", &format!("a name that ends in .{}", kinds.join(" or .")));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return fail("its folder does not exist", "a folder that does");
    }
    if path.is_dir() {
        return fail("it is a folder", "the name of a file");
    }
    Ok(())
}
