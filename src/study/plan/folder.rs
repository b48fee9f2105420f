//! Chooses the folder for the result of a campaign. A folder keeps to what it was begun with.

use super::PreparedCampaign;
use crate::store::folder::Folder;
use crate::store::manifest::{MANIFEST, Manifest};
use crate::store::part::PartLabel;
use standfast_core::error::{Error, Result};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

impl PreparedCampaign {
    /// The folder for the result: `out` if it is given, else a folder under `standfast-results` that is new or belongs
    /// to this campaign. Writes nothing. Fails if `out` holds something else.
    pub fn folder(&self, out: Option<&Path>) -> Result<Folder> {
        let Manifest {
            campaign,
            config_hash,
            ..
        } = &self.manifest;
        let usual = || {
            usual_folder(&campaign.name, config_hash, |path| {
                self.may_have(path).unwrap_or(false)
            })
        };
        let path = out.map_or_else(usual, Path::to_path_buf);
        if !self.may_have(&path)? {
            let advice = out.map_or("", |_| ". Give a new folder, or remove this one");
            let differences = self.differences(&path);
            let problem = format!("holds the result of another campaign: {differences}{advice}");
            return Err(Error::Parts { path, problem });
        }
        let begun = match Folder::open(&path).ok().flatten() {
            Some(folder) => folder.manifest,
            None => self.begun_by(&self.labels(&path)),
        };
        let manifest = Manifest {
            part_trials: begun.part_trials,
            ..self.manifest.clone()
        };
        Ok(Folder {
            path,
            manifest,
            unpacked: None,
        })
    }

    /// Whether a folder is new or belongs to this campaign.
    fn may_have(&self, path: &Path) -> Result<bool> {
        match Folder::open(path) {
            Err(_) if !self.labels(path).is_empty() => Ok(true),
            folder => Ok(folder?
                .is_none_or(|folder| folder.manifest.config_hash == self.manifest.config_hash)),
        }
    }

    /// The labels of this campaign's parts in a folder whose manifest is lost. The manifest will be written again.
    fn labels(&self, path: &Path) -> Vec<PartLabel> {
        if path.join(MANIFEST).exists() {
            return Vec::new();
        }
        let mut labels = Folder::labels(path).unwrap_or_default();
        labels.retain(|label| label.config_hash == self.manifest.config_hash);
        labels
    }

    /// What tells the campaign in a folder from this one.
    fn differences(&self, path: &Path) -> String {
        const MOST: usize = 5;
        let differences = match Folder::open(path) {
            Ok(Some(folder)) => folder.manifest.differences(&self.manifest),
            _ => Vec::new(),
        };
        match differences.len() {
            0 => "its configuration differs".into(),
            count if count > MOST => {
                let more = count - MOST;
                format!("{}; and {more} more", differences[..MOST].join("; "))
            }
            _ => differences.join("; "),
        }
    }

    /// The manifest with which a folder was begun that has these parts.
    fn begun_by(&self, labels: &[PartLabel]) -> Manifest {
        let mut begun = self.manifest.clone();
        if let Some(part_trials) = labels
            .iter()
            .filter_map(|label| NonZeroU64::new(label.trials))
            .max()
        {
            begun.part_trials = part_trials;
        }
        // A single last part may be a short one, so it does not tell the size of the others.
        if begun.check("").is_ok() {
            begun
        } else {
            self.manifest.clone()
        }
    }
}

/// A folder under `standfast-results` that is named after what it holds or, if that folder may not be taken, after the hash
/// of the configuration, too.
pub(crate) fn usual_folder(name: &str, hash: &str, may_have: impl Fn(&Path) -> bool) -> PathBuf {
    let results = Path::new("standfast-results");
    let plain = results.join(name);
    match may_have(&plain) {
        true => plain,
        false => results.join(format!("{name}-{}", &hash[..8])),
    }
}
