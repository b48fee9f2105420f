//! The program from outside, for tests of its files and messages.

use std::process::{Child, Command, Output};
use std::{collections::BTreeMap, fs, path::Path};
use tempfile::TempDir;

/// A campaign with little to simulate.
pub const SHORT: [&str; 8] = [
    "run",
    "smoke",
    "--controller=hold",
    "--set=episode.horizon_s=0.4",
    "--set=episode.judge.standing_time_s=0.1",
    "--set=push.start_s=0.05",
    "--set=push.impulse_n_s={uniform=[0, 4]}",
    "--out=out",
];
/// The number of trials for one part of a campaign, and for several parts, of which the last is not full.
pub const FEW: &str = "--trials=3";
pub const SEVERAL_PARTS: &str = "--trials=26";

pub use super::PROGRAM;

/// Folder in which the program notes the inputs that it has made.
pub const STATE: &str = env!("CARGO_TARGET_TMPDIR");

/// A run of the program that has ended.
pub struct Run(Output);

impl Run {
    pub fn of(command: &mut Command) -> Self {
        Self(command.output().unwrap())
    }

    /// Asserts this exit code.
    #[track_caller]
    pub fn code(self, code: i32) -> Self {
        assert_eq!(
            self.0.status.code(),
            Some(code),
            "{:?} {}{}",
            self.0.status,
            stdout(&self),
            stderr(&self)
        );
        self
    }

    #[track_caller]
    pub fn success(self) -> Self {
        self.code(0)
    }

    pub fn get_output(&self) -> &Output {
        &self.0
    }
}

pub fn standfast(folder: &Path, args: &[&str]) -> Run {
    Run::of(
        Command::new(PROGRAM)
            .current_dir(folder)
            .args(args)
            .env("XDG_STATE_HOME", STATE),
    )
}

/// Sends a signal, by its name, to a program that runs.
pub fn send(signal: &str, to: &Child) {
    assert!(
        Command::new("kill")
            .args(["-s", signal, &to.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
}

/// The arguments of the short campaign with further ones.
pub fn short<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SHORT[..], more].concat()
}

pub fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// All files under a folder, by their paths, without the lock, which is empty.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            found.extend(
                files(&entry.path())
                    .into_iter()
                    .map(|(k, v)| (format!("{name}/{k}"), v)),
            );
        } else if name != ".lock" {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

pub fn stdout(run: &Run) -> String {
    String::from_utf8(run.get_output().stdout.clone()).unwrap()
}

pub fn stderr(run: &Run) -> String {
    String::from_utf8(run.get_output().stderr.clone()).unwrap()
}
