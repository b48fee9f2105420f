//! The path of the page of a trial in a result folder, and of its small picture.

use base64::prelude::{BASE64_STANDARD, Engine};
use standfast_files::assets::read;
use standfast_files::sha256_hex;
use standfast_study::store::folder::REPLAYS;
use standfast_study::verdict::controller_summary::ControllerOrigin;
use std::path::{Path, PathBuf};

/// Largest size of a picture that is shown (bytes).
const MOST_BYTES: u64 = 10_000_000;

/// Path of the page of a trial, relative to the result folder, with one entrant or with two. Names of variants contain
/// characters that some file systems and CI services refuse; they are replaced, and a hash keeps the names apart.
pub fn replay_file(trial: u64, controller: &str) -> PathBuf {
    let mut name: String = controller
        .chars()
        .map(|c| match c.is_ascii_alphanumeric() || "-_.=@".contains(c) {
            true => c,
            false => '-',
        })
        .collect();
    if name != controller {
        name += &format!("-{}", &sha256_hex(controller.as_bytes())[..8]);
    }
    Path::new(REPLAYS).join(format!("trial-{trial}-{name}.html"))
}

/// Path of the page of a trial of a controller, relative to a report in `folder`. None if there is no such page.
pub fn replay_found(folder: &Path, origin: &ControllerOrigin, trial: u64) -> Option<String> {
    let path = Path::new(&origin.campaign)
        .with_file_name("")
        .join(replay_file(trial, &origin.controller));
    folder
        .join(&path)
        .is_file()
        .then(|| path.display().to_string())
}

/// The small picture beside a page that was [found](replay_found), for a report in `folder`.
pub fn picture_found(folder: &Path, page: &str) -> Option<String> {
    let svg = read(&folder.join(page).with_extension("svg"), MOST_BYTES).ok()?;
    Some(format!(
        "data:image/svg+xml;base64,{}",
        BASE64_STANDARD.encode(svg)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_controller_has_its_own_file_with_a_name_that_all_systems_accept() {
        let names = [
            "catch",
            "paper:stepping.alpha=2",
            "paper-stepping.alpha=2",
            "a b",
            "a/b",
        ]
        .map(|controller| {
            let path = replay_file(7, controller);
            assert_eq!(path.parent(), Some(Path::new(REPLAYS)));
            path.file_name().unwrap().to_str().unwrap().to_string()
        });
        assert_eq!(names[0], "trial-7-catch.html");
        for (i, name) in names.iter().enumerate() {
            assert!(
                !name.contains([':', ' ', '/', '\\', '"', '<', '>', '|', '*', '?']),
                "{name}"
            );
            assert!(!names[..i].contains(name), "{name} twice");
        }
    }
}
