//! Commands that results keep. A result has the files of its controllers in `inputs/controllers`. If a trial is simulated
//! again, controllers that are programs are started from there. A result from elsewhere could so run anybody's code. So
//! this machine notes, in the state folder of the user, a hash of all files in each such folder that it has made. If
//! the files have another hash, a command is started only if somebody [allows](ask_by) it.

use standfast_core::error::{Error, Result};
use standfast_files::assets;
use standfast_files::{json, sha256_hex, write_atomic};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Where a result keeps the files of its controllers.
const GAINS: &str = "inputs/controllers";

/// A command that a result keeps.
pub struct Kept<'a> {
    /// The controller's file.
    pub file: &'a str,
    pub command: String,
    pub made: Made,
}

/// The origin of the files of a result's controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Made {
    /// This program, since it was started.
    Now,
    /// This machine, earlier.
    Earlier,
    /// Nobody knows.
    Elsewhere,
}

/// Says whether a command may be started.
type Ask = dyn Fn(&Kept) -> bool + Send + Sync;

static ASK: OnceLock<Box<Ask>> = OnceLock::new();
/// The answers so far, by the controller's file and its command.
static ANSWERS: Mutex<Option<HashMap<(PathBuf, String), bool>>> = Mutex::new(None);
/// Hashes of the inputs that this program has made.
static MADE: Mutex<Option<HashSet<String>>> = Mutex::new(None);

/// Sets the function that is asked once before each command of a result is started. Without it, only commands are
/// started whose files this machine has made. It has no effect if it was called before.
pub fn ask_by(ask: impl Fn(&Kept) -> bool + Send + Sync + 'static) {
    _ = ASK.set(Box::new(ask));
}

/// Fails if `file` is the file of a controller in a result, and its command may not be started.
pub(super) fn check(file: &str, command: &[String]) -> Result<()> {
    let Some((path, gains)) = place(file) else {
        return Ok(());
    };
    let command = command.join(" ");
    let mut answers = ANSWERS.lock().unwrap_or_else(PoisonError::into_inner);
    let answer = answers
        .get_or_insert_default()
        .entry((path, command.clone()))
        .or_insert_with(|| {
            let kept = Kept {
                file,
                command: command.clone(),
                made: made(&gains),
            };
            ASK.get()
                .map_or(kept.made != Made::Elsewhere, |ask| ask(&kept))
        });
    if *answer {
        Ok(())
    } else {
        Err(Error::NotStarted {
            file: file.into(),
            command,
        })
    }
}

/// The whole path of a file that a result keeps, and the folder in which it lies. It is None for any other file.
fn place(file: &str) -> Option<(PathBuf, PathBuf)> {
    let path = std::fs::canonicalize(file).ok()?;
    let gains = path.parent()?.to_path_buf();
    let result = gains.parent()?.parent()?;
    let is_result = ["campaign.toml", "parts"]
        .iter()
        .any(|name| result.join(name).exists());
    (gains.ends_with(GAINS) && is_result).then_some((path, gains))
}

fn made(gains: &Path) -> Made {
    let Some(hash) = read(gains).and_then(|files| hash(&files)) else {
        return Made::Elsewhere;
    };
    if MADE
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .get_or_insert_default()
        .contains(&hash)
    {
        return Made::Now;
    }
    let is_noted = state_folder().is_some_and(|folder| folder.join(hash).is_file());
    if is_noted {
        Made::Earlier
    } else {
        Made::Elsewhere
    }
}

/// Notes that this machine has made the inputs of a result, given by their paths in its folder. It has no effect if
/// there are other files beside those of the controllers, which a program might load, or if the note cannot be written:
/// then a command is not started without asking.
pub fn note(result: &Path, inputs: &[(String, Vec<u8>)]) {
    let of_controllers = inputs.iter().filter_map(|(name, bytes)| {
        let name = Path::new(name).strip_prefix(GAINS).ok()?;
        Some((name.to_path_buf(), bytes.clone()))
    });
    let mut ours: Vec<_> = of_controllers.collect();
    ours.sort();
    let Some(hash) =
        hash(&ours).filter(|_| read(&result.join(GAINS)).is_some_and(|files| files == ours))
    else {
        return;
    };
    let noted = state_folder().map(|folder| write_atomic(&folder.join(&hash), b""));
    if let Some(Err(error)) = noted {
        log::debug!("{error}");
    }
    MADE.lock()
        .unwrap_or_else(PoisonError::into_inner)
        .get_or_insert_default()
        .insert(hash);
}

/// All files under a folder in the order of their paths, which are relative to it. It is None if an entry cannot be
/// read, or is not a file.
fn read(folder: &Path) -> Option<Vec<(PathBuf, Vec<u8>)>> {
    let (mut files, mut folders) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).ok()? {
            let path = entry.ok()?.path();
            if path.is_dir() && !path.is_symlink() {
                folders.push(path);
                continue;
            }
            let bytes = assets::read(&path, super::companion_files::MOST_FILE_BYTES).ok()?;
            files.push((path.strip_prefix(folder).ok()?.to_path_buf(), bytes));
        }
    }
    files.sort();
    Some(files)
}

fn hash(files: &[(PathBuf, Vec<u8>)]) -> Option<String> {
    let of_each: Vec<(&str, String)> = files
        .iter()
        .map(|(path, bytes)| Some((path.to_str()?, sha256_hex(bytes))))
        .collect::<Option<_>>()?;
    Some(sha256_hex(json(&of_each).ok()?.as_bytes()))
}

/// The folder of the noted hashes. Each hash is the name of an empty file.
fn state_folder() -> Option<PathBuf> {
    let whole = |name: &str| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let state = whole("XDG_STATE_HOME").or_else(|| Some(whole("HOME")?.join(".local/state")));
    Some(state?.join("standfast/inputs"))
}
