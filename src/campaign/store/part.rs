//! A part of a result: the rows of one block of trials in a CSV file (floats with all digits). Written after it is a
//! small marker with row count, range of trials, configuration hash and content hash. A part is complete only if all of
//! these match. Parts do not depend on threads, shards or hosts, so all histories of interruptions end in the same
//! bytes.

use crate::campaign::store::row::TrialRow;
use crate::error::{Error, Result};
use crate::files::{json, sha256_hex, write_atomic};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::{fs, path::PathBuf};

/// A part, complete or not.
pub struct PartFile<'a> {
    /// Path without the extension.
    pub stem: PathBuf,
    pub trials: Range<u64>,
    /// Names of the gain sets, in the order of the campaign.
    pub sets: &'a [String],
    pub config_hash: &'a str,
}

/// Marker of a complete part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Marker {
    first_trial: u64,
    trials: u64,
    rows: usize,
    config_hash: String,
    sha256: String,
}

impl PartFile<'_> {
    /// Writes the part, then its marker. `rows` must be sorted by trial, then by set.
    pub fn write(&self, rows: &[TrialRow]) -> Result<()> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        let path = self.path("csv");
        let fail = |e: csv::Error| Error::Write { path: path.clone(), source: std::io::Error::other(e) };
        for row in rows {
            csv.serialize(row).map_err(fail)?;
        }
        let bytes = csv.into_inner().map_err(|e| fail(e.into_error().into()))?;
        write_atomic(&path, &bytes)?;
        write_atomic(&self.path("json"), json(&self.marker(rows.len(), &bytes))?.as_bytes())
    }

    /// Reads the rows. It fails if the part is missing, damaged, or of another campaign.
    pub fn rows(&self) -> Result<Vec<TrialRow>> {
        let content = self.content()?;
        let rows: Result<Vec<TrialRow>, _> = csv::Reader::from_reader(content.as_slice()).deserialize().collect();
        let rows = rows.map_err(|e| self.damaged(e.to_string()))?;
        let expected = self.trials.clone().flat_map(|trial| self.sets.iter().map(move |set| (trial, set)));
        if rows.iter().map(|row| (row.trial, &row.set)).eq(expected) {
            Ok(rows)
        } else {
            Err(self.damaged("its rows are not those of its trials and sets, each once and in order".into()))
        }
    }

    /// Whether the part is there as it was written.
    pub fn is_complete(&self) -> bool {
        self.content().is_ok()
    }

    fn path(&self, extension: &str) -> PathBuf {
        self.stem.with_extension(extension)
    }

    fn damaged(&self, problem: String) -> Error {
        Error::Parts { path: self.path("csv"), problem }
    }

    fn marker(&self, rows: usize, content: &[u8]) -> Marker {
        Marker {
            first_trial: self.trials.start,
            trials: self.trials.end - self.trials.start,
            rows,
            config_hash: self.config_hash.into(),
            sha256: sha256_hex(content),
        }
    }

    /// Content of a complete part.
    fn content(&self) -> Result<Vec<u8>> {
        let marker =
            fs::read(self.path("json")).map_err(|e| self.damaged(format!("its marker cannot be read: {e}")))?;
        let content = fs::read(self.path("csv")).map_err(|e| self.damaged(e.to_string()))?;
        let found: Marker =
            serde_json::from_slice(&marker).map_err(|e| self.damaged(format!("its marker is damaged: {e}")))?;
        let rows = (self.trials.end - self.trials.start) as usize * self.sets.len();
        if found == self.marker(rows, &content) {
            Ok(content)
        } else {
            Err(self.damaged("does not match its marker".into()))
        }
    }
}
