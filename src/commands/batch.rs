//! What the searches of many jobs have in common (`limit`, `ceiling`, `card`): threads, shard and folder, how far they
//! are, what is kept and what is missing.

use super::arguments::{MOST_THREADS, count};
use super::interrupt::{STOP, say_what_is_kept};
use super::progress::Progress;
use super::terminal::{note, print};
use serde_json::json;
use standfast_core::error::Result;
use standfast_files::write_atomic;
use standfast_study::Shard;
use standfast_study::batch::{Batch, Jobs, SearchTask};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct BatchArgs {
    /// Number of threads, or 0 for one on each core
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = count::<usize>(0..=MOST_THREADS))]
    pub threads: usize,
    /// Run only part K of N (1/N to N/N); the one that ends last writes the result
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Folder for the result
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

impl BatchArgs {
    /// Runs the jobs of this shard that a folder lacks. Returns the result or, if parts of other shards are missing, says
    /// which, and returns None. `what` are the jobs, `prepare` is called before the folder is made, and `run` is given what
    /// runs the jobs.
    pub fn search<T>(
        &self,
        task: &SearchTask,
        folder: &Path,
        jobs: &Jobs,
        what: &'static str,
        prepare: impl FnOnce() -> Result<()>,
        run: impl FnOnce(&Batch) -> Result<Option<T>>,
    ) -> Result<Option<T>> {
        let hash = task.hash()?;
        let (all, lacking) = (
            jobs.parts_of(self.shard),
            jobs.lacking(folder, self.shard).len(),
        );
        let there = all - lacking;
        let path = folder.display();
        if lacking == 0 {
            note(&format!(
                "{path}: all {all} {what} are there; nothing is computed again"
            ));
        } else {
            prepare()?;
            task.begin(folder)?;
            note(&match there {
                0 => format!("{path}: keeps what is finished"),
                _ => format!("{path}: goes on, {there} of {all} {what} are there"),
            });
        }
        let progress = (lacking > 0).then(|| Progress::of(all as u64, there as u64, what));
        let batch = Batch {
            folder,
            task: &hash,
            shard: self.shard,
            stop: &STOP,
            on_episode: &|| progress.iter().for_each(Progress::episode),
            on_job: &|| progress.iter().for_each(Progress::tick),
            on_wait: &|_| {},
        };
        let found = run(&batch);
        progress.iter().for_each(Progress::finish);
        let found = say_what_is_kept(found, what)?;
        if found.is_none() {
            let missing = jobs.missing_shards(folder, self.shard);
            if self.json {
                let told =
                    json!({ "folder": folder, "complete": false, "missing_shards": missing });
                print(&standfast_report::json(&told))?;
            } else {
                note(&format!(
                    "{path}: shards {missing} are missing; the one that ends last writes the result"
                ));
            }
        }
        Ok(found)
    }
}

/// Writes a file of a result, unless it is there as it would be written.
pub fn write_once(path: &Path, bytes: &[u8]) -> Result<()> {
    if std::fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    write_atomic(path, bytes)?;
    note(&format!("written: {}", path.display()));
    Ok(())
}
