//! Stores a part of a result: the rows of one block of trials, in a CSV file with all digits of its floats. A small
//! marker is written after it, with row count, range of trials, configuration hash and content hash. A part is complete
//! only if all four match.
//!
//! Parts do not depend on threads, shards, hosts or interruptions: a finished campaign always has the same bytes. Parts
//! may depend on the build of the program, which the marker names. A campaign that ends when decided stops some
//! controllers early. Then a part has only the other controllers, and its marker names them.

use crate::ask::spec::Campaign;
use crate::store::row::{TrialRow, read_csv, write_csv};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::assets::read;
use standfast_files::{build_id, json, sha256_hex, write_atomic};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Largest size of a file that is read (bytes). Parts are far smaller.
const MOST_BYTES: u64 = 100_000_000;

/// The files of a part, whether it is complete or not.
pub struct PartFile<'a> {
    /// Path without the extension.
    pub stem: PathBuf,
    pub trials: Range<u64>,
    /// Names of the controllers, in the order of the campaign.
    pub sets: &'a [String],
    pub config_hash: &'a str,
    /// The planned number of trials of a campaign that ends when decided. The looks follow from it.
    pub planned_trials: Option<u64>,
    /// The campaign of the part, against which its rows are checked.
    pub campaign: &'a Campaign,
}

/// The marker beside the rows of a part. It states what the part has to contain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Build of the program that wrote the part ([`build_id`]).
    pub build: String,
    first_trial: u64,
    /// Number of trials in the part.
    pub trials: u64,
    rows: usize,
    /// Names of the controllers in the part. It is None if the part has all controllers of the campaign.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sets: Option<Vec<String>>,
    pub config_hash: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_trials: Option<u64>,
    sha256: String,
}

impl Marker {
    /// The marker at this path. It is None if the file cannot be read.
    pub fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice(&read(path, MOST_BYTES).ok()?).ok()
    }
}

impl PartFile<'_> {
    /// Writes the part, then its marker. `rows` must be sorted by trial, then by controller. All trials of the part
    /// must have rows of the same controllers.
    pub fn write(&self, rows: &[TrialRow]) -> Result<()> {
        let path = self.path("csv");
        let bytes = write_csv(rows).map_err(|e| Error::Write {
            path: path.clone(),
            source: std::io::Error::other(e),
        })?;
        write_atomic(&path, &bytes)?;
        write_atomic(
            &self.path("json"),
            json(&self.marker(build_id(), &self.held_by(rows), &bytes))?.as_bytes(),
        )
    }

    /// Reads the rows, sorted by trial and then by controller. It fails if the part is missing or damaged, belongs to
    /// another campaign, or has an impossible row.
    pub fn rows(&self) -> Result<Vec<TrialRow>> {
        let (content, sets) = self.content()?;
        self.checked(&content, &sets)
    }

    /// The error in the rows of a complete part. It is None if there is no error, or if the part is missing or damaged.
    pub fn contradiction(&self) -> Option<Error> {
        let (content, sets) = self.content().ok()?;
        self.checked(&content, &sets).err()
    }

    /// The rows of a complete part. It fails if the rows belong to other trials, or if a row is impossible: a hash
    /// shows an accident, but whoever changes a row can compute a new hash. The drawn quantities of a trial follow from
    /// the campaign, so they are compared to the bit.
    fn checked(&self, content: &[u8], sets: &[&String]) -> Result<Vec<TrialRow>> {
        let [csv, marker] = ["csv", "json"].map(|extension| self.path(extension));
        let refused = |problem: String| {
            let [csv, marker] =
                [&csv, &marker].map(|path| path.file_name().unwrap_or_default().display());
            let advice = format!("To have its trials run again, remove {csv} and {marker}");
            self.damaged(format!(
                "{problem}. {advice}, and give the command that began the campaign again"
            ))
        };
        let rows = read_csv(content).map_err(|e| refused(e.to_string()))?;
        let expected = self
            .trials
            .clone()
            .flat_map(|trial| sets.iter().map(move |&set| (trial, set)));
        if !rows.iter().map(|row| (row.trial, &row.set)).eq(expected) {
            return Err(refused(
                "its rows are not those of its trials and sets, each once and in order".into(),
            ));
        }
        for of_trial in rows.chunk_by(|a, b| a.trial == b.trial) {
            let drawn = TrialRow::drawn(self.campaign, of_trial[0].trial);
            for row in of_trial {
                row.check_drawn(&drawn, self.campaign.seed)
                    .map_err(refused)?;
                row.check(&self.campaign.episode).map_err(refused)?;
            }
        }
        Ok(rows)
    }

    /// For each controller of the campaign, whether the part is complete and has rows of the controller.
    pub fn holds(&self) -> Vec<bool> {
        let held = self.content().map_or(Vec::new(), |(_, sets)| sets);
        self.sets.iter().map(|set| held.contains(&set)).collect()
    }

    /// The controllers that have rows in `rows`, in the order of the campaign.
    fn held_by(&self, rows: &[TrialRow]) -> Vec<&String> {
        self.sets
            .iter()
            .filter(|set| rows.iter().any(|row| row.set == **set))
            .collect()
    }

    fn path(&self, extension: &str) -> PathBuf {
        self.stem.with_extension(extension)
    }

    fn damaged(&self, problem: String) -> Error {
        Error::Parts {
            path: self.path("csv"),
            problem,
        }
    }

    fn marker(&self, build: &str, sets: &[&String], content: &[u8]) -> Marker {
        let trials = self.trials.end - self.trials.start;
        let holds_all = sets.len() == self.sets.len();
        Marker {
            build: build.into(),
            first_trial: self.trials.start,
            trials,
            rows: trials as usize * sets.len(),
            sets: (!holds_all).then(|| sets.iter().map(|set| set.to_string()).collect()),
            config_hash: self.config_hash.into(),
            planned_trials: self.planned_trials,
            sha256: sha256_hex(content),
        }
    }

    /// The content of a complete part, and its controllers in the order of the campaign.
    fn content(&self) -> Result<(Vec<u8>, Vec<&String>)> {
        let bytes = read(&self.path("json"), MOST_BYTES)
            .map_err(|e| self.damaged(format!("its marker cannot be read: {e}")))?;
        let content =
            read(&self.path("csv"), MOST_BYTES).map_err(|e| self.damaged(e.to_string()))?;
        let marker: Marker = serde_json::from_slice(&bytes)
            .map_err(|e| self.damaged(format!("its marker is damaged: {e}")))?;
        let sets: Vec<&String> = self
            .sets
            .iter()
            .filter(|set| marker.sets.as_ref().is_none_or(|held| held.contains(set)))
            .collect();
        if marker == self.marker(&marker.build, &sets, &content) {
            Ok((content, sets))
        } else {
            Err(self.damaged("does not match its marker".into()))
        }
    }
}
