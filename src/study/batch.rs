//! Many jobs that know nothing of each other, over the cores of this machine and over several machines. What is finished is
//! kept in a folder, so the same command goes on after an interruption.
//!
//! The jobs of a list are dealt out to parts, and the parts to [shards](Shard). A part is a file, which is written when all
//! of its jobs have ended, and never run again. Results are always read from the parts, so they are the same, to the bit,
//! for any number of threads, shards and interruptions. Each part carries the hash of the task, and a folder belongs to one
//! task.

use crate::plan::usual_folder;
use crate::store::folder::joined;
use crate::store::manifest::{self, Manifest};
use crate::store::shard::Shard;
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use standfast_controllers::turns::in_turn;
use standfast_core::error::{Error, Result};
use standfast_files::assets;
use standfast_files::{json, json_pretty, sha256_hex, write_atomic};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

/// The file of the task.
pub const TASK: &str = "task.json";
/// Largest size of a file that is read (bytes). The files of a batch are far smaller.
const MOST_BYTES: u64 = 100_000_000;
/// How often a shard looks for the parts of the others.
const LOOKS_EVERY: Duration = Duration::from_millis(500);

/// How jobs run here, and where their results are kept.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    pub folder: &'a Path,
    /// The hash of the task, which every part carries.
    pub task: &'a str,
    /// The share of this program, if several run the batch.
    pub shard: Option<Shard>,
    /// Somebody sets this to stop early.
    pub stop: &'a AtomicBool,
    /// Called after every episode that is run here, from any thread.
    pub on_episode: &'a (dyn Fn() + Sync),
    /// Called after every job that is run here, from any thread.
    pub on_job: &'a (dyn Fn() + Sync),
    /// Called once for each list whose parts this program waits for, with the first shard that is missing.
    pub on_wait: &'a (dyn Fn(Shard) + Sync),
}

/// A list of jobs. Job j belongs to part j mod `parts`.
#[derive(Debug, Clone)]
pub struct Jobs {
    /// The name of the list, which no other list of the task has.
    pub name: String,
    pub count: usize,
    pub parts: usize,
}

impl Batch<'_> {
    /// The parts of this shard that the folder lacks.
    pub fn lacks(&self, jobs: &Jobs) -> Vec<usize> {
        jobs.lacking(self.folder, self.shard)
    }

    /// Fails if somebody has asked to stop.
    pub fn go_on(&self) -> Result<()> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err(Error::Interrupted),
            false => Ok(()),
        }
    }

    /// Runs what the folder lacks of this shard on the threads of the caller's pool, one job at a time on each, and
    /// writes it. Fails if it is stopped from outside, if a part cannot be written, or if a job fails.
    pub fn run<T: Serialize + Send>(
        &self,
        jobs: &Jobs,
        run: impl Fn(usize) -> Result<T> + Sync,
    ) -> Result<()> {
        let parts = self.lacks(jobs).into_iter();
        let parts = parts.map(|part| (part, jobs.of_part(part)));
        let write = |&part: &usize, found| self.write(&jobs.part(self.folder, part), &found);
        self.each(parts, run, write)
    }

    /// Runs the jobs of these parts, and calls `write` with the results of each part.
    fn each<T: Send, J: ExactSizeIterator<Item = usize> + Send>(
        &self,
        parts: impl Iterator<Item = (usize, J)> + Send,
        run: impl Fn(usize) -> Result<T> + Sync,
        write: impl Fn(&usize, Vec<T>) -> Result<()> + Sync,
    ) -> Result<()> {
        let run_one = |_: &usize, job| {
            let result = run(job)?;
            (self.on_job)();
            Ok(result)
        };
        run_parts(parts, self.stop, run_one, write)
    }

    /// The results of all jobs, in order; None if parts are missing. Fails if a part cannot be read.
    pub fn results<T: DeserializeOwned>(&self, jobs: &Jobs) -> Result<Option<Vec<T>>> {
        let mut parts = Vec::new();
        for part in 0..jobs.parts {
            let path = jobs.part(self.folder, part);
            let Some(found) = read_of::<Vec<T>>(&path, self.task)? else {
                return Ok(None);
            };
            if found.len() != jobs.of_part(part).len() {
                return Err(damaged(&path, "it has not the results of its jobs"));
            }
            parts.push(found.into_iter());
        }
        let turns = (0..jobs.count).filter_map(|job| parts[job % jobs.parts].next());
        Ok(Some(turns.collect()))
    }

    /// The results of `count` jobs, of which each shard runs its own and waits for the parts of the others. Without shards
    /// nothing is kept.
    pub fn gather<T: Serialize + DeserializeOwned + Send>(
        &self,
        name: &str,
        count: usize,
        run: impl Fn(usize) -> Result<T> + Sync,
    ) -> Result<Vec<T>> {
        let Some(shard) = self.shard else {
            let all = Mutex::new(Vec::new());
            self.each(std::iter::once((0, 0..count)), run, |_, results| {
                *all.lock().unwrap_or_else(PoisonError::into_inner) = results;
                Ok(())
            })?;
            return Ok(all.into_inner().unwrap_or_else(PoisonError::into_inner));
        };
        let jobs = &Jobs {
            name: name.into(),
            count,
            parts: shard.count as usize,
        };
        self.run(jobs, run)?;
        let mut is_told = false;
        loop {
            if let Some(results) = self.results(jobs)? {
                return Ok(results);
            }
            self.go_on()?;
            if let (Some(&part), false) = (jobs.lacking(self.folder, None).first(), is_told) {
                (self.on_wait)(Shard {
                    index: part as u64 + 1,
                    ..shard
                });
                is_told = true;
            }
            sleep(LOOKS_EVERY);
        }
    }

    /// Writes a file of the task, with its hash.
    pub fn write<T: Serialize>(&self, path: &Path, found: &T) -> Result<()> {
        let file = TaskFile {
            task: self.task.into(),
            found,
        };
        write_atomic(path, json_pretty(&file)?.as_bytes())
    }
}

/// Runs the jobs of these parts in their order, spread over the threads of the caller's pool one by one, so that cores stay
/// busy to the end and an interruption loses only the few unfinished parts. Calls `write` with the results of a part, in
/// the order of its jobs, when the last one has ended. Fails if somebody has set `stop`, or if a job or a `write` fails.
pub fn run_parts<P: Send + Sync, J, I, T: Send>(
    parts: impl Iterator<Item = (P, J)> + Send,
    stop: &AtomicBool,
    run: impl Fn(&P, I) -> Result<T> + Sync,
    write: impl Fn(&P, Vec<T>) -> Result<()> + Sync,
) -> Result<()>
where
    J: ExactSizeIterator<Item = I> + Send,
    I: Send,
{
    // A part is made when its first job is due, and gone when its last one is written: memory does not grow with the list.
    let jobs = parts.flat_map(|(part, jobs)| {
        let results = Mutex::new(Vec::from_iter((0..jobs.len()).map(|_| None)));
        let part = Arc::new((part, results));
        jobs.enumerate()
            .map(move |(place, job)| (Arc::clone(&part), place, job))
    });
    jobs.par_bridge().try_for_each(|(part, place, job)| {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let (part, results) = &*part;
        let result = in_turn(|| run(part, job))?;
        let all: Vec<T> = {
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results[place] = Some(result);
            if results.iter().any(Option::is_none) {
                return Ok(());
            }
            results.drain(..).flatten().collect()
        };
        write(part, all)
    })
}

impl Jobs {
    /// A list of which each job is a part of its own.
    pub fn kept_one_by_one(name: &str, count: usize) -> Self {
        Self {
            name: name.into(),
            count,
            parts: count,
        }
    }

    /// Number of parts of a shard, or of all.
    pub fn parts_of(&self, shard: Option<Shard>) -> usize {
        self.all_of(shard).count()
    }

    /// The parts of a shard, or of all, that a folder lacks.
    pub fn lacking(&self, folder: &Path, shard: Option<Shard>) -> Vec<usize> {
        self.all_of(shard)
            .filter(|&part| !self.part(folder, part).exists())
            .collect()
    }

    /// The shards whose parts a folder lacks, as `2,4-6`, if there are as many as `shard` says.
    pub fn missing_shards(&self, folder: &Path, shard: Option<Shard>) -> String {
        let count = shard.map_or(1, |shard| shard.count);
        let shards: BTreeSet<u64> = self
            .lacking(folder, None)
            .into_iter()
            .map(|part| part as u64 % count + 1)
            .collect();
        joined(shards.into_iter().map(|shard| (shard, shard + 1))).join(",")
    }

    fn all_of(&self, shard: Option<Shard>) -> impl Iterator<Item = usize> + use<> {
        (0..self.parts).filter(move |&part| shard.is_none_or(|shard| shard.takes(part as u64)))
    }

    /// The jobs of a part.
    fn of_part(&self, part: usize) -> impl ExactSizeIterator<Item = usize> + use<> {
        (part..self.count.max(part)).step_by(self.parts)
    }

    /// The path of a part.
    fn part(&self, folder: &Path, part: usize) -> PathBuf {
        folder
            .join("parts")
            .join(format!("{}-{}-of-{}.json", self.name, part + 1, self.parts))
    }
}

/// What a file of a batch holds, with the hash of the task to which it belongs.
#[derive(Debug, Serialize, Deserialize)]
struct TaskFile<T> {
    task: String,
    found: T,
}

/// The content of the file at a path. It is None if there is no file. Fails as [`read`] does, or if the file belongs to
/// another task than the one with the hash `task`.
pub fn read_of<T: DeserializeOwned>(path: &Path, task: &str) -> Result<Option<T>> {
    match read::<TaskFile<Value>>(path)? {
        Some(file) if file.task != task => Err(damaged(path, "its task is another one")),
        Some(file) => serde_json::from_value(file.found)
            .map(Some)
            .map_err(|e| damaged(path, &e.to_string())),
        None => Ok(None),
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

/// The error of a file that is not as it was written.
pub fn damaged(path: &Path, problem: &str) -> Error {
    let problem = format!("is damaged ({problem}); remove it, and the same command makes it again");
    Error::Parts {
        path: path.into(),
        problem,
    }
}

/// Fails if the folder of a search is a file.
pub fn check_out(folder: &Path) -> Result<()> {
    if folder.exists() && !folder.is_dir() {
        return Err(Error::option(
            "--out",
            folder.display(),
            "it is a file",
            "a folder, new or of this search",
        ));
    }
    Ok(())
}

/// What a command searches, as it is written to the folder before it begins.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SearchTask {
    pub command: String,
    /// The options on which a result depends.
    pub options: Value,
    /// Campaign and inputs.
    pub manifest: Manifest,
}

impl SearchTask {
    /// SHA-256 of all on which a result depends.
    pub fn hash(&self) -> Result<String> {
        Ok(sha256_hex(
            json(&(&self.command, &self.options, &self.manifest.config_hash))?.as_bytes(),
        ))
    }

    /// The folder of the task: `out` or, without it, a folder under `standfast-results` that is new or of this task. Writes
    /// nothing. Fails if `out` holds something else, and says by what it differs.
    pub fn folder(&self, out: Option<&Path>) -> Result<PathBuf> {
        let Some(out) = out else {
            let name = format!("{}-{}", self.command, self.manifest.campaign.name);
            return Ok(usual_folder(&name, &self.hash()?, |folder| {
                self.may_have(folder).is_ok()
            }));
        };
        self.may_have(out)?;
        Ok(out.into())
    }

    fn may_have(&self, folder: &Path) -> Result<()> {
        let other = |problem: String| Error::Parts {
            path: folder.into(),
            problem: format!("{problem}. Give a new folder, or remove this one"),
        };
        check_out(folder)?;
        if folder.join(manifest::MANIFEST).exists() {
            return Err(other("holds the result of `run`".into()));
        }
        let Some(there) = read::<Value>(&folder.join(TASK))? else {
            return match folder.join("parts").exists() {
                true => Err(other(format!(
                    "holds parts, but no {TASK} that says of what"
                ))),
                false => Ok(()),
            };
        };
        let is_own = there["command"] == self.command.as_str();
        let Some(there) = serde_json::from_value::<Self>(there)
            .ok()
            .filter(|_| is_own)
        else {
            return Err(other(format!(
                "holds something else than a search of `{}` by this version",
                self.command
            )));
        };
        if there.hash()? == self.hash()? {
            return Ok(());
        }
        let mut found = there.manifest.differences(&self.manifest);
        manifest::differences("", &self.options, &there.options, &mut found);
        Err(other(format!("holds another search: {}", found.join("; "))))
    }

    /// Writes the task to its folder, unless it is there.
    pub fn begin(&self, folder: &Path) -> Result<()> {
        let path = folder.join(TASK);
        match path.exists() {
            true => Ok(()),
            false => write_atomic(&path, json_pretty(self)?.as_bytes()),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    static GO_ON: AtomicBool = AtomicBool::new(false);

    /// A batch that watches nothing.
    pub(crate) fn quiet<'a>(folder: &'a Path, shard: Option<&str>) -> Batch<'a> {
        Batch {
            folder,
            task: "a",
            shard: shard.map(|shard| shard.parse().unwrap()),
            stop: &GO_ON,
            on_episode: &|| {},
            on_job: &|| {},
            on_wait: &|_| {},
        }
    }

    #[test]
    fn shards_know_what_one_would_know_and_no_job_runs_twice() {
        let dir = tempfile::tempdir().unwrap();
        let count = AtomicUsize::new(0);
        let job = |i: usize| {
            count.fetch_add(1, Ordering::Relaxed);
            Ok(i * i)
        };
        let squares: Vec<usize> = (0..10).map(|i| i * i).collect();
        let member = |shard| quiet(dir.path(), shard).gather("squares", 10, job).unwrap();
        let all = std::thread::scope(|scope| {
            ["1/3", "2/3", "3/3"]
                .map(|shard| scope.spawn(move || member(Some(shard))))
                .map(|one| one.join().unwrap())
        });
        assert!(all.iter().all(|gathered| *gathered == squares));
        assert_eq!(
            (member(Some("2/3")), count.load(Ordering::Relaxed)),
            (squares.clone(), 10)
        );
        assert_eq!((member(None), count.load(Ordering::Relaxed)), (squares, 20));
    }

    #[test]
    fn what_is_finished_is_kept_when_a_job_is_stopped_and_missing_shards_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let jobs = Jobs::kept_one_by_one("a", 6);
        let batch = Batch {
            stop: &stop,
            ..quiet(dir.path(), Some("2/3"))
        };
        let job = |i: usize| {
            stop.store(true, Ordering::Relaxed);
            Ok(i)
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        assert!(matches!(
            pool.install(|| batch.run(&jobs, job)),
            Err(Error::Interrupted)
        ));
        assert_eq!(batch.lacks(&jobs).len(), 1);
        stop.store(false, Ordering::Relaxed);
        batch.run(&jobs, Ok).unwrap();
        assert_eq!(
            (batch.lacks(&jobs), batch.results::<usize>(&jobs).unwrap()),
            (vec![], None)
        );
        assert_eq!(jobs.missing_shards(dir.path(), batch.shard), "1,3");
        quiet(dir.path(), None).run(&jobs, Ok).unwrap();
        assert_eq!(jobs.missing_shards(dir.path(), batch.shard), "");
        assert_eq!(batch.results(&jobs).unwrap(), Some(vec![0, 1, 2, 3, 4, 5]));
    }

    #[test]
    fn whoever_waits_can_be_stopped_and_a_damaged_part_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let on_wait = |missing: Shard| {
            assert_eq!(missing.to_string(), "2/2");
            stop.store(true, Ordering::Relaxed);
        };
        let batch = Batch {
            stop: &stop,
            on_wait: &on_wait,
            ..quiet(dir.path(), Some("1/2"))
        };
        assert!(matches!(batch.gather("a", 4, Ok), Err(Error::Interrupted)));
        for (part, problem) in [
            ("{", "EOF"),
            (
                "{\"task\": \"b\", \"found\": [1, 3]}",
                "its task is another one",
            ),
            (
                "{\"task\": \"a\", \"found\": [1]}",
                "not the results of its jobs",
            ),
            ("{\"task\": \"a\", \"found\": [1, null]}", "null"),
        ] {
            std::fs::write(dir.path().join("parts/a-2-of-2.json"), part).unwrap();
            let message = batch.gather("a", 4, Ok).unwrap_err().to_string();
            let is_named = message.contains("parts/a-2-of-2.json: is damaged")
                && message.contains("remove it");
            assert!(is_named && message.contains(problem), "{message}");
        }
    }
}
