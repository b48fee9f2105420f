//! The files of a result that people and CI services look at.

use crate::campaign::store::folder::REPLAYS;
use crate::campaign::{Summary, TrialRow};
use crate::error::Result;
use crate::files::{sha256_hex, write_atomic};
use crate::render::text::layout::wrapped;
use crate::render::{html, junit, markdown, plot};
use std::path::{Path, PathBuf};

/// Their names, in the order in which they are written.
pub const FILES: [&str; 4] = ["report.html", "summary.md", "junit.xml", "success.svg"];

/// Writes them beside `summary.json`. `rows` are sorted by trial, then by set.
pub fn write(summary: &Summary, rows: &[TrialRow], folder: &Path) -> Result<()> {
    let [report, markdown, junit, success] = FILES.map(|name| folder.join(name));
    plot::success::write(&success, summary)?;
    write_atomic(&report, html::page(summary, rows, folder)?.as_bytes())?;
    write_atomic(&markdown, markdown::text(summary).as_bytes())?;
    write_atomic(&junit, junit::xml(summary)?.as_bytes())
}

/// What to say when they and others are there.
pub fn written(folder: &Path, others: &[&str]) -> String {
    let files = [&FILES[..], others].concat().join(", ");
    wrapped("written: ", &format!("{}: {files}", folder.display())).trim_end().into()
}

/// Whether a comparison may be written to a folder: it is new, empty, or holds an earlier comparison.
pub fn may_be_written_to(folder: &Path) -> bool {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return !folder.exists() };
    let is_comparison = || folder.join("summary.json").is_file() && !folder.join("parts").exists();
    entries.next().is_none() || is_comparison()
}

/// The page that shows a trial, as seen from the result folder. Names of variants hold signs that not every file system
/// takes, nor every CI service.
pub fn replay_file(trial: u64, set: &str) -> PathBuf {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.=".contains(c);
    let mut name: String = set.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    if name != set {
        name += &format!("-{}", &sha256_hex(set.as_bytes())[..8]);
    }
    Path::new(REPLAYS).join(format!("trial-{trial}-{name}.html"))
}

/// The page of a trial, if it is there: its path as seen from a report in `folder`, for a set whose campaign is the file
/// `campaign` as seen from there.
pub fn replay_found(folder: &Path, campaign: &str, trial: u64, set: &str) -> Option<String> {
    let path = Path::new(campaign).parent().unwrap_or(Path::new("")).join(replay_file(trial, set));
    folder.join(&path).is_file().then(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_a_file_of_its_own_that_any_system_takes() {
        let names = ["catch", "paper:stepping.alpha=2", "paper-stepping.alpha=2", "a b", "a/b"].map(|set| {
            let path = replay_file(7, set);
            assert_eq!(path.parent(), Some(Path::new(REPLAYS)));
            path.file_name().unwrap().to_str().unwrap().to_string()
        });
        assert_eq!(names[0], "trial-7-catch.html");
        for (i, name) in names.iter().enumerate() {
            assert!(!name.contains([':', ' ', '/', '\\', '"', '<', '>', '|', '*', '?']), "{name}");
            assert!(!names[..i].contains(name), "{name} twice");
        }
    }

    use crate::campaign::store::folder::RESULT_FILES;

    #[test]
    fn what_is_written_is_taken_away_before_more_trials_are_run() {
        assert!(FILES.iter().all(|name| RESULT_FILES.contains(name)));
    }
}
