//! Stores a part of a result: the rows of one block of trials, as the columns of one Parquet file. The metadata of the file
//! state the trials, the configuration hash of the campaign, and a hash of the file. A part is complete only if all of
//! this matches.
//!
//! Parts do not depend on threads, shards, hosts or interruptions: a finished campaign always has the same bytes. Parts
//! may depend on the build of the program, which the metadata name. A campaign that ends when decided stops some
//! controllers early. Then a part has only the other controllers, and its metadata name them.

use crate::ask::spec::Campaign;
use crate::store::row::{TrialRow, columns, rows};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::assets::read;
use standfast_files::columns::{is_whole, read_parquet, sealed_bytes, texts};
use standfast_files::{build_id, json, write_atomic};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Largest size of a file that is read (bytes). Parts are far smaller.
const MOST_BYTES: u64 = 100_000_000;
/// The key of the label in the metadata of a part.
const LABEL: &str = "part";

/// The file of a part, whether it is complete or not.
pub struct PartFile<'a> {
    pub path: PathBuf,
    pub trials: Range<u64>,
    /// Names of the controllers, in the order of the campaign.
    pub controllers: &'a [String],
    /// Names of the totals of the controllers, which are columns.
    pub totals: &'a [String],
    pub config_hash: &'a str,
    /// The campaign of the part, against which its rows are checked.
    pub campaign: &'a Campaign,
}

/// What a part states of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartLabel {
    /// Build of the program that wrote the part ([`build_id`]).
    pub build: String,
    first_trial: u64,
    /// Number of trials in the part.
    pub trials: u64,
    /// Names of the controllers in the part. It is None if the part has all controllers of the campaign.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    controllers: Option<Vec<String>>,
    pub config_hash: String,
}

impl PartLabel {
    /// The label of the part at this path. It is None if the file cannot be read or is damaged.
    pub fn read(path: &Path) -> Option<Self> {
        let bytes = read(path, MOST_BYTES)
            .ok()
            .filter(|bytes| is_whole(bytes))?;
        Self::of(&texts(bytes).ok()?).ok()
    }

    fn of(texts: &BTreeMap<String, String>) -> serde_json::Result<Self> {
        serde_json::from_str(texts.get(LABEL).map_or("", String::as_str))
    }
}

impl PartFile<'_> {
    /// Writes the part. `rows` must be sorted by trial, then by controller. All trials of the part must have rows of the
    /// same controllers.
    pub fn write(&self, rows: &[TrialRow]) -> Result<()> {
        let label = json(&self.label(build_id(), &self.held_by(rows)))?;
        let bytes = sealed_bytes(&columns(rows, self.totals), &[(LABEL, label)]);
        let bytes = bytes.map_err(|e| Error::Write {
            path: self.path.clone(),
            source: std::io::Error::other(e),
        })?;
        write_atomic(&self.path, &bytes)
    }

    /// Reads the rows, sorted by trial and then by controller. It fails if the part is missing or damaged, belongs to
    /// another campaign, or has an impossible row.
    pub fn rows(&self) -> Result<Vec<TrialRow>> {
        let (bytes, controllers) = self.whole()?;
        self.checked(bytes, &controllers)
    }

    /// The error in the rows of a complete part. It is None if there is no error, or if the part is missing or damaged.
    pub fn contradiction(&self) -> Option<Error> {
        let (bytes, controllers) = self.whole().ok()?;
        self.checked(bytes, &controllers).err()
    }

    /// The rows of a complete part. It fails if the rows belong to other trials, or if a row is impossible: a hash
    /// shows an accident, but whoever changes a row can compute a new hash. The drawn quantities of a trial follow from
    /// the campaign, so they are compared to the bit. The columns become rows for this, since most rules are about several
    /// columns of one trial.
    fn checked(&self, bytes: Vec<u8>, controllers: &[&String]) -> Result<Vec<TrialRow>> {
        let refused = |problem: String| {
            let name = self.path.file_name().unwrap_or_default().display();
            let advice = format!("To have its trials run again, remove {name}");
            self.damaged(format!(
                "{problem}. {advice}, and give the command that began the campaign again"
            ))
        };
        let table = read_parquet(bytes).map_err(|e| refused(e.to_string()))?;
        let rows = rows(table, self.totals).map_err(refused)?;
        let expected = self.trials.clone().flat_map(|trial| {
            controllers
                .iter()
                .map(move |&controller| (trial, controller))
        });
        if !rows
            .iter()
            .map(|row| (row.trial, &row.controller))
            .eq(expected)
        {
            return Err(refused(
                "its rows are not those of its trials and controllers, each once and in order"
                    .into(),
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
        let held = self
            .whole()
            .map_or(Vec::new(), |(_, controllers)| controllers);
        self.controllers
            .iter()
            .map(|controller| held.contains(&controller))
            .collect()
    }

    /// The controllers that have rows in `rows`, in the order of the campaign.
    fn held_by(&self, rows: &[TrialRow]) -> Vec<&String> {
        self.controllers
            .iter()
            .filter(|controller| rows.iter().any(|row| row.controller == **controller))
            .collect()
    }

    fn damaged(&self, problem: String) -> Error {
        Error::Parts {
            path: self.path.clone(),
            problem,
        }
    }

    fn label(&self, build: &str, controllers: &[&String]) -> PartLabel {
        let holds_all = controllers.len() == self.controllers.len();
        PartLabel {
            build: build.into(),
            first_trial: self.trials.start,
            trials: self.trials.end - self.trials.start,
            controllers: (!holds_all).then(|| {
                controllers
                    .iter()
                    .map(|controller| controller.to_string())
                    .collect()
            }),
            config_hash: self.config_hash.into(),
        }
    }

    /// The bytes of a complete part, and its controllers in the order of the campaign.
    fn whole(&self) -> Result<(Vec<u8>, Vec<&String>)> {
        let bytes = read(&self.path, MOST_BYTES).map_err(|e| self.damaged(e.to_string()))?;
        let is_damaged = |problem: &str| self.damaged(format!("is damaged: {problem}"));
        if !is_whole(&bytes) {
            return Err(is_damaged("it does not match its hash"));
        }
        let texts = texts(bytes.clone()).map_err(|e| is_damaged(&e.to_string()))?;
        let label = PartLabel::of(&texts).map_err(|e| is_damaged(&format!("its label: {e}")))?;
        let mut controllers = Vec::new();
        for controller in self.controllers {
            let held = label.controllers.as_ref();
            if held.is_none_or(|held| held.contains(controller)) {
                controllers.push(controller);
            }
        }
        if label != self.label(&label.build, &controllers) {
            return Err(self.damaged("is the part of other trials or of another campaign".into()));
        }
        Ok((bytes, controllers))
    }
}
