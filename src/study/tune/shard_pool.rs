//! Several programs that run one search together, by a folder that all of them see.
//!
//! Each program runs the whole search, but simulates only its share of the trials, writes their results to a part, and
//! waits for the parts of the others. So all programs make the same decisions and write the same bytes, whatever their
//! number. A part that is there is not run again: a member that was stopped can be started again, while the others
//! wait.

use crate::store::shard::Shard;
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::assets;
use standfast_files::{json, write_atomic};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Largest size of a file that is read (bytes). The files of a search are far smaller.
const MOST_BYTES: u64 = 100_000_000;
/// How often a member looks for the parts of the others.
const LOOKS_EVERY: Duration = Duration::from_millis(500);

/// A member of a team, or a program that works alone.
#[derive(Clone, Copy)]
pub struct ShardPool<'a> {
    pub shard: Option<Shard>,
    pub folder: &'a Path,
    /// The hash of the task, which every file of the search carries.
    pub task: &'a str,
    /// Somebody sets this to stop early.
    pub stop: &'a AtomicBool,
    /// Called once for each piece of work whose parts are incomplete, with the first shard that is missing.
    pub on_wait: &'a (dyn Fn(Shard) + Sync),
}

impl ShardPool<'_> {
    /// The results of all jobs, in order. `name` is the name of this piece of work, which no other one of the search
    /// has. Fails if it is stopped from outside, if a part cannot be written or read, or if a job fails.
    pub fn gather<T: Serialize + DeserializeOwned + Send>(
        &self,
        name: &str,
        jobs: usize,
        run: impl Fn(usize) -> Result<T> + Sync,
    ) -> Result<Vec<T>> {
        let own: Vec<usize> = (0..jobs)
            .filter(|&job| self.shard.is_none_or(|shard| shard.takes(job as u64)))
            .collect();
        let run_own = || {
            own.par_iter()
                .with_max_len(1)
                .map(|&job| match self.stop.load(Ordering::Relaxed) {
                    true => Err(Error::Interrupted),
                    false => run(job),
                })
                .collect::<Result<Vec<T>>>()
        };
        let Some(shard) = self.shard else {
            return run_own();
        };
        let path = self.part(name, shard);
        if read_of::<Vec<T>>(&path, self.task)?.is_none() {
            let part = SearchFile {
                task: self.task.into(),
                found: run_own()?,
            };
            write_atomic(&path, json(&part)?.as_bytes())?;
        }
        let mut parts = Vec::new();
        for index in 1..=shard.count {
            parts.push(self.wait(name, Shard { index, ..shard })?.into_iter());
        }
        let turns = (0..jobs).map(|job| parts[job % shard.count as usize].next());
        turns.collect::<Option<Vec<T>>>().ok_or_else(|| {
            let problem =
                format!("parts of {name} are of another search; remove this folder, and start all shards again");
            Error::Parts { path: self.folder.into(), problem }
        })
    }

    fn part(&self, name: &str, shard: Shard) -> PathBuf {
        self.folder
            .join("parts")
            .join(format!("{name}-{}-of-{}.json", shard.index, shard.count))
    }

    /// Waits for the part of a member, and reads it.
    fn wait<T: DeserializeOwned>(&self, name: &str, member: Shard) -> Result<Vec<T>> {
        let path = self.part(name, member);
        let mut is_told = false;
        loop {
            if let Some(part) = read_of(&path, self.task)? {
                return Ok(part);
            }
            if self.stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            if !is_told {
                (self.on_wait)(member);
                is_told = true;
            }
            sleep(LOOKS_EVERY);
        }
    }
}

/// What a file of a search holds, with the hash of the task to which it belongs.
#[derive(Debug, Serialize, Deserialize)]
pub struct SearchFile<T> {
    pub task: String,
    pub found: T,
}

/// The content of the file at a path. It is None if there is no file. Fails as [`read`] does, or if the file belongs to
/// another task than the one with the hash `task`.
pub fn read_of<T: DeserializeOwned>(path: &Path, task: &str) -> Result<Option<T>> {
    match read::<SearchFile<T>>(path)? {
        Some(file) if file.task != task => Err(damaged(path, "its task is another one")),
        file => Ok(file.map(|file| file.found)),
    }
}

/// The file of JSON at a path, if there is one. Fails if it is no file, cannot be read, or is no such JSON.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    match assets::read(path, MOST_BYTES) {
        Err(Error::Read { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            Ok(None)
        }
        text => serde_json::from_slice(&text?)
            .map(Some)
            .map_err(|e| damaged(path, &e.to_string())),
    }
}

/// The error of a file that is not as the search wrote it.
pub fn damaged(path: &Path, problem: &str) -> Error {
    let problem = format!("is damaged ({problem}); remove it, and the same command makes it again");
    Error::Parts {
        path: path.into(),
        problem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn a_team_knows_what_one_would_know_and_runs_no_job_twice() {
        let dir = tempfile::tempdir().unwrap();
        let (stop, count) = (AtomicBool::new(false), AtomicUsize::new(0));
        let job = |i: usize| {
            count.fetch_add(1, Ordering::Relaxed);
            Ok(i * i)
        };
        let member = |shard: &str| {
            let shard = Some(shard.parse().unwrap());
            ShardPool {
                shard,
                folder: dir.path(),
                task: "a",
                stop: &stop,
                on_wait: &|_| {},
            }
            .gather("squares", 10, job)
            .unwrap()
        };
        let all = std::thread::scope(|scope| {
            ["1/3", "2/3", "3/3"]
                .map(|shard| scope.spawn(move || member(shard)))
                .map(|one| one.join().unwrap())
        });
        let squares: Vec<usize> = (0..10).map(|i| i * i).collect();
        assert!(all.iter().all(|gathered| *gathered == squares));
        assert_eq!(
            (member("2/3"), count.load(Ordering::Relaxed)),
            (squares.clone(), 10)
        );
        let alone = ShardPool {
            shard: None,
            folder: dir.path(),
            task: "a",
            stop: &stop,
            on_wait: &|_| {},
        };
        assert_eq!(alone.gather("squares", 10, job).unwrap(), squares);
        assert_eq!(count.load(Ordering::Relaxed), 20);
    }

    #[test]
    fn whoever_waits_can_be_stopped_and_a_damaged_part_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let on_wait = |missing: Shard| {
            assert_eq!(missing.to_string(), "2/2");
            stop.store(true, Ordering::Relaxed);
        };
        let team = ShardPool {
            shard: Some("1/2".parse().unwrap()),
            folder: dir.path(),
            task: "a",
            stop: &stop,
            on_wait: &on_wait,
        };
        assert!(matches!(team.gather("a", 4, Ok), Err(Error::Interrupted)));
        for (part, problem) in [
            ("{", "EOF"),
            (
                "{\"task\": \"b\", \"found\": [1, 3]}",
                "its task is another one",
            ),
        ] {
            std::fs::write(dir.path().join("parts/a-2-of-2.json"), part).unwrap();
            let message = team.gather("a", 4, Ok).unwrap_err().to_string();
            let is_named = message.contains("parts/a-2-of-2.json: is damaged")
                && message.contains("remove it");
            assert!(is_named && message.contains(problem), "{message}");
        }
    }
}
