//! A result folder: a part for each finished block of trials, and a manifest.

use crate::ask::spec::Campaign;
use crate::store::compiled_in;
use crate::store::manifest::{MANIFEST, Manifest};
use crate::store::part::{PartFile, PartLabel};
use crate::store::row::TrialRow;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_files::assets::read;
use standfast_files::{build_id, is_temporary, json, write_atomic};
use standfast_stats::sequential::look_from;
use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::ops::Range;
use std::sync::Arc;
use std::{fs, path::Path, path::PathBuf};
use tempfile::TempDir;

/// Files that are made from the parts.
pub const RESULT_FILES: [&str; 6] = [
    "summary.json",
    "trials.parquet",
    "report.html",
    "summary.md",
    "junit.xml",
    "success.svg",
];

/// Names that a run creates before its first part is written.
const BEGUN: [&str; 3] = ["parts", "inputs", "campaign.toml"];

/// Largest size of a `parts/stopped.json` that is read (bytes).
const MOST_BYTES: u64 = 1_000_000;

/// Subfolder with the pages that show trials, `trial-*.html`.
pub const REPLAYS: &str = "replays";

/// `parts/stopped.json`: the number of trials at which a campaign was decided and ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Stopped {
    trials: u64,
    config_hash: String,
    /// Number of trials of each controller. It is None if all controllers have `trials` trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    controller_trials: Option<Vec<u64>>,
}

/// A result folder with its manifest.
#[derive(Debug, Clone)]
pub struct Folder {
    pub path: PathBuf,
    pub manifest: Manifest,
    /// The folder for a result that is compiled in, which is removed with the last copy.
    pub(crate) unpacked: Option<Arc<TempDir>>,
}

impl Folder {
    /// Opens a folder. It is None if the folder does not exist or is empty. It fails if the folder has other content.
    pub fn open(path: &Path) -> Result<Option<Folder>> {
        let fail = |field: &str, at: &Path, problem: &str, accepted: &str| {
            Err(Error::option(field, at.display(), problem, accepted))
        };
        let accepted = "a folder, which is new, empty, or holds the result of a campaign";
        let empty = match fs::read_dir(path) {
            Ok(mut entries) => entries.next().is_none(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && path.is_symlink() => {
                return fail(
                    "result folder",
                    path,
                    "it is a link to what does not exist",
                    accepted,
                );
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => true,
            Err(e) if e.kind() == std::io::ErrorKind::NotADirectory => {
                return fail("result folder", path, "it is a file", accepted);
            }
            Err(source) => {
                return Err(Error::Read {
                    path: path.into(),
                    source,
                });
            }
        };
        if empty {
            return Ok(None);
        }
        let parts = fs::read_dir(path.join("parts"))
            .into_iter()
            .flatten()
            .flatten();
        for part in parts.map(|entry| entry.path()) {
            if part.is_dir() {
                return fail(
                    "part of a result",
                    &part,
                    "it is a folder",
                    "a file; remove the folder",
                );
            }
            if part.extension().is_some_and(|extension| extension == "csv") {
                return fail(
                    "part of a result",
                    &part,
                    "it was written by a former version of standfast, whose results this one does not read",
                    "a new folder",
                );
            }
        }
        if path.join(MANIFEST).exists() {
            return Ok(Some(Folder {
                path: path.into(),
                manifest: Manifest::read(path)?,
                unpacked: None,
            }));
        }
        if Self::labels(path)?.is_empty() {
            return Ok(None);
        }
        Err(Error::LostManifest(path.into()))
    }

    /// The labels of the parts in a folder, which can be read without a manifest. There are none if a run failed before
    /// its first part. It fails if the folder has other content.
    pub fn labels(path: &Path) -> Result<Vec<PartLabel>> {
        let parts = path.join("parts");
        let mut labels = Vec::new();
        if parts.is_dir() {
            for name in names_in(&parts)? {
                if name.to_str().is_some_and(|name| name.starts_with("part-")) {
                    labels.extend(PartLabel::read(&parts.join(name)));
                }
            }
        }
        // A run creates `parts` first. If that is missing, a `campaign.toml` is a file of the user.
        if labels.is_empty()
            && !names_in(path)?.iter().all(|name| {
                (parts.is_dir() && BEGUN.iter().any(|ours| name == ours)) || is_temporary(name)
            })
        {
            let problem =
                "is not the folder of a campaign: it has no parts/campaign.json, and holds other files".into();
            return Err(Error::Parts {
                path: path.into(),
                problem,
            });
        }
        Ok(labels)
    }

    /// Opens the folder of a campaign or, if there is none of this name, the packed result that is compiled in. It fails if there is no such folder, or if it
    /// does not hold a campaign.
    pub fn existing(path: &Path) -> Result<Folder> {
        if !path.exists()
            && let Some((unpacked, path)) = compiled_in::unpacked(path)?
        {
            let manifest = Manifest::read(&path)?;
            return Ok(Folder {
                path,
                manifest,
                unpacked: Some(Arc::new(unpacked)),
            });
        }
        Folder::open(path)?.ok_or_else(|| Error::Parts {
            path: path.into(),
            problem: format!(
                "there is no such folder, or it is empty; give the result folder of `standfast run`, or one of {}",
                compiled_in::names().collect::<Vec<_>>().join(", ")
            ),
        })
    }

    /// Its name in sentences: that of what is compiled in, or its path.
    pub fn name(&self) -> String {
        match (&self.unpacked, self.path.file_name()) {
            (Some(_), Some(name)) => name.display().to_string(),
            _ => self.path.display().to_string(),
        }
    }

    /// The builds of the program that made the parts ([`build_id`]).
    pub fn builds(&self) -> BTreeSet<String> {
        Self::labels(&self.path)
            .unwrap_or_default()
            .into_iter()
            .map(|label| label.build)
            .collect()
    }

    /// Whether parts in the folder were made by another build of the program than this one.
    pub fn is_of_another_build(&self) -> bool {
        self.builds().iter().any(|build| build != build_id())
    }

    /// Whether the manifest in the folder differs from this one in its gates, its margin or its number of trials.
    pub fn asks_anew(&self) -> bool {
        Folder::open(&self.path)
            .ok()
            .flatten()
            .is_some_and(|stored| stored.manifest != self.manifest)
    }

    /// Number of trials in the result. It is the number of the campaign or, if the campaign ended early, the number at
    /// its decision.
    pub fn trials(&self) -> u64 {
        self.stopped()
            .map_or(self.manifest.campaign.trials, |stopped| stopped.trials)
    }

    /// Number of trials of each controller in the result. It is None if the campaign ends when decided and has not
    /// ended yet.
    pub fn controller_trials(&self) -> Option<Vec<u64>> {
        let Manifest {
            campaign,
            controllers,
            ..
        } = &self.manifest;
        let of_all = |trials: u64| vec![trials; controllers.len()];
        match self.stopped() {
            Some(stopped) => Some(
                stopped
                    .controller_trials
                    .unwrap_or_else(|| of_all(stopped.trials)),
            ),
            None => (!campaign.stopping.until_resolved).then(|| of_all(campaign.trials)),
        }
    }

    /// Whether the campaign was decided and has ended.
    pub fn has_stopped(&self) -> bool {
        self.stopped().is_some()
    }

    fn stopped(&self) -> Option<Stopped> {
        let Manifest {
            campaign,
            controllers,
            config_hash,
            ..
        } = &self.manifest;
        if !campaign.stopping.until_resolved {
            return None;
        }
        let stopped: Stopped =
            serde_json::from_slice(&read(&self.stopped_path(), MOST_BYTES).ok()?).ok()?;
        let is_end = |trials: u64| trials == look_from(trials);
        let are_ends = match &stopped.controller_trials {
            Some(controller_trials) => {
                controller_trials.len() == controllers.len()
                    && controller_trials.iter().max() == Some(&stopped.trials)
                    && controller_trials.iter().all(|trials| is_end(*trials))
            }
            None => true,
        };
        (stopped.config_hash == *config_hash
            && stopped.trials <= campaign.trials
            && is_end(stopped.trials)
            && are_ends)
            .then_some(stopped)
    }

    /// Writes that the campaign was decided and has ended, with the number of trials of each controller.
    pub fn stop_at(&self, controller_trials: &[u64]) -> Result<()> {
        let trials = controller_trials.iter().copied().max().unwrap_or_default();
        let are_same = controller_trials
            .iter()
            .all(|of_controller| *of_controller == trials);
        let config_hash = self.manifest.config_hash.clone();
        let stopped = Stopped {
            trials,
            config_hash,
            controller_trials: (!are_same).then(|| controller_trials.to_vec()),
        };
        write_atomic(&self.stopped_path(), json(&stopped)?.as_bytes())
    }

    fn stopped_path(&self) -> PathBuf {
        self.path.join("parts/stopped.json")
    }

    /// Number of blocks in the result.
    pub fn blocks(&self) -> u64 {
        self.trials().div_ceil(self.manifest.part_trials.get())
    }

    /// The number of the first trial of a block, and the number after its last one.
    pub fn range(&self, block: u64) -> (u64, u64) {
        let trials = self.manifest.part_trials.get();
        (
            block * trials,
            ((block + 1) * trials).min(self.manifest.campaign.trials),
        )
    }

    /// The blocks that are not complete, in order.
    pub fn missing(&self) -> Vec<u64> {
        let controller_trials = self.controller_trials();
        (0..self.blocks())
            .filter(|&block| match &controller_trials {
                Some(controller_trials) => self.lacks(block, controller_trials).contains(&true),
                // If the campaign has not ended, it is not known which controllers a part must have.
                None => !self.part(block).holds().contains(&true),
            })
            .collect()
    }

    /// For each controller, whether a block is still to be run, if the controllers have these numbers of trials.
    pub fn lacks(&self, block: u64, controller_trials: &[u64]) -> Vec<bool> {
        let (first, _) = self.range(block);
        let holds = self.part(block).holds();
        controller_trials
            .iter()
            .zip(holds)
            .map(|(&trials, is_there)| first < trials && !is_there)
            .collect()
    }

    /// Fails if complete parts have impossible rows, with a problem for each such part.
    pub fn check_rows(&self) -> Result<()> {
        let blocks = (0..self.blocks()).into_par_iter();
        Error::all(
            blocks
                .filter_map(|block| self.part(block).contradiction())
                .collect(),
        )
    }

    /// The part of a block, whether it is complete or not.
    pub fn part(&self, block: u64) -> PartFile<'_> {
        let path = self.path.join(format!("parts/part-{block:06}.parquet"));
        let (first, end) = self.range(block);
        let Manifest {
            controllers,
            totals,
            config_hash,
            campaign,
            ..
        } = &self.manifest;
        PartFile {
            path,
            trials: first..end,
            controllers,
            totals,
            config_hash,
            campaign,
        }
    }

    /// Writes the manifest. It fails if the folder is not writable.
    pub fn create(&self) -> Result<()> {
        self.manifest.write(&self.path)
    }

    /// The rows of one part after the other, by trial and then by controller in the order of the campaign. Each part is
    /// read when it is due. It fails if a part is missing or damaged, or if the campaign ends when decided and has not
    /// ended.
    pub fn parts(&self) -> Result<impl Iterator<Item = Result<Vec<TrialRow>>>> {
        let missing = self.missing();
        if !missing.is_empty() {
            return Err(self.incomplete(format!(
                "{} of {} parts are missing or damaged (trials {})",
                missing.len(),
                self.blocks(),
                self.trials_of(&missing),
            )));
        }
        let Some(controller_trials) = self.controller_trials() else {
            return Err(self.incomplete("it was stopped before its end".into()));
        };
        Ok((0..self.blocks()).map(move |block| self.rows_of(block..block + 1, &controller_trials)))
    }

    fn incomplete(&self, problem: String) -> Error {
        Error::Incomplete {
            path: self.path.clone(),
            problem,
            asks_for_baseline: self.asks_for_baseline(),
        }
    }

    /// The rows of these blocks. Rows beyond the number of trials of their controller are left out. It fails if a part
    /// is missing or damaged.
    pub fn rows_of(&self, blocks: Range<u64>, controller_trials: &[u64]) -> Result<Vec<TrialRow>> {
        let mut rows = blocks
            .map(|block| self.part(block).rows())
            .collect::<Result<Vec<_>>>()?
            .concat();
        let of_controller: HashMap<&String, &u64> = self
            .manifest
            .controllers
            .iter()
            .zip(controller_trials)
            .collect();
        rows.retain(|row| {
            of_controller
                .get(&row.controller)
                .is_some_and(|trials| row.trial < **trials)
        });
        Ok(rows)
    }

    /// The campaign with its inputs as seen from the working folder.
    pub fn campaign(&self) -> Campaign {
        self.manifest.campaign.clone().seen_from(&self.path)
    }

    /// Writes `campaign.toml`, with which the campaign can be run again.
    pub fn write_campaign(&self) -> Result<()> {
        write_atomic(
            &self.path.join("campaign.toml"),
            self.manifest.campaign.to_toml()?.as_bytes(),
        )
    }

    /// The ranges of the trials of some blocks, as text such as `0-49, 75-99`.
    pub fn trials_of(&self, blocks: &[u64]) -> String {
        joined(blocks.iter().map(|&block| self.range(block))).join(", ")
    }

    /// Whether a gate compares with a baseline, which commands on this folder then need.
    pub fn asks_for_baseline(&self) -> bool {
        let Manifest {
            campaign,
            controllers,
            ..
        } = &self.manifest;
        campaign.gates.ask_for_baseline(controllers)
    }

    /// Removes temporary files of programs that ended while they were writing. No program may be at work in the folder.
    pub fn remove_unfinished(&self) -> Result<()> {
        for folder in ["", "parts", "inputs", "inputs/controllers", REPLAYS] {
            let Ok(entries) = fs::read_dir(self.path.join(folder)) else {
                continue;
            };
            for entry in entries.flatten() {
                if entry.path().is_file() && is_temporary(&entry.file_name()) {
                    remove(&entry.path())?;
                }
            }
        }
        Ok(())
    }

    /// Removes the files that were made from the parts, before the parts change.
    pub fn remove_result(&self) -> Result<()> {
        remove(&self.stopped_path())?;
        for name in RESULT_FILES {
            remove(&self.path.join(name))?;
        }
        let Ok(pages) = fs::read_dir(self.path.join(REPLAYS)) else {
            return Ok(());
        };
        for page in pages.flatten() {
            if page.path().is_file() && page.file_name().to_string_lossy().starts_with("trial-") {
                remove(&page.path())?;
            }
        }
        Ok(())
    }
}

/// Writes ranges as `3` or `7-9`, and joins neighbours. Each is given by its first number and the number after its last
/// one. They are in order.
pub fn joined(ranges: impl IntoIterator<Item = (u64, u64)>) -> Vec<String> {
    let mut joined: Vec<(u64, u64)> = Vec::new();
    for (first, end) in ranges {
        match joined.last_mut() {
            Some(last) if last.1 == first => last.1 = end,
            _ => joined.push((first, end)),
        }
    }
    joined
        .into_iter()
        .map(|(first, end)| match end - first {
            1 => first.to_string(),
            _ => format!("{first}-{}", end - 1),
        })
        .collect()
}

/// The names of what lies in a folder.
fn names_in(folder: &Path) -> Result<Vec<OsString>> {
    let names: std::io::Result<_> = fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| Ok(entry?.file_name())).collect());
    names.map_err(|source| Error::Read {
        path: folder.into(),
        source,
    })
}

/// Removes a file if it exists.
fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(Error::Write {
            path: path.into(),
            source,
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::ask::spec::Overrides;
    use crate::fixtures::campaign;
    use crate::fixtures::manifest;

    use crate::fixtures::record;
    use standfast_sim::Profile;
    use standfast_sim::episode::Outcome;
    use std::num::NonZeroU64;

    pub(crate) fn folder(path: &Path) -> Folder {
        let names = ["hold", "fixed"];
        let overrides = Overrides {
            trials: Some(60),
            controllers: names.map(String::from).to_vec(),
            ..Overrides::default()
        };
        let part_trials = NonZeroU64::new(25).unwrap();
        let mut manifest = Manifest {
            part_trials,
            ..manifest(&names, overrides)
        };
        manifest.config_hash = manifest.hash().unwrap();
        Folder {
            path: path.into(),
            manifest,
            unpacked: None,
        }
    }

    /// A new folder of a campaign with three blocks. These blocks are written.
    fn written(blocks: &[u64]) -> (tempfile::TempDir, Folder) {
        let dir = tempfile::tempdir().unwrap();
        let folder = folder(dir.path());
        for block in blocks {
            folder.part(*block).write(&rows(&folder, *block)).unwrap();
        }
        (dir, folder)
    }

    fn rows(folder: &Folder, block: u64) -> Vec<TrialRow> {
        let (first, end) = folder.range(block);
        let outcomes = [
            Outcome::Fell,
            Outcome::Recovered,
            Outcome::Diverged,
            Outcome::Failed,
            Outcome::TimedOut,
        ];
        let campaign = &folder.manifest.campaign;
        let mut rows = Vec::new();
        for trial in first..end {
            for controller in ["hold", "fixed"] {
                rows.push(TrialRow {
                    controller: controller.into(),
                    record: record(outcomes[trial as usize % 5]),
                    ..TrialRow::drawn(campaign, trial)
                });
            }
        }
        rows
    }

    #[test]
    fn a_missing_part_and_a_foreign_one_are_noticed() {
        let (dir, mut folder) = written(&[0, 1, 2]);
        fs::remove_file(dir.path().join("parts/part-000001.parquet")).unwrap();
        fs::copy(
            dir.path().join("parts/part-000000.parquet"),
            dir.path().join("parts/part-000002.parquet"),
        )
        .unwrap();
        assert_eq!(folder.missing(), [1, 2]);
        folder.manifest.config_hash = "other".into();
        assert_eq!(folder.missing(), [0, 1, 2]);
    }

    #[test]
    fn a_flipped_byte_is_noticed() {
        let (dir, folder) = written(&[0, 1, 2]);
        let part = dir.path().join("parts/part-000001.parquet");
        let mut bytes = fs::read(&part).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(&part, bytes).unwrap();
        assert_eq!(folder.missing(), [1]);
        let message = folder.part(1).rows().unwrap_err().to_string();
        assert!(
            message.contains("part-000001.parquet: is damaged"),
            "{message}"
        );
    }

    /// Writes the first part with a change in its first row that has this outcome, and returns the message of the
    /// error.
    fn contradicted(folder: &Folder, outcome: Outcome, change: impl Fn(&mut TrialRow)) -> String {
        let mut rows = rows(folder, 0);
        change(
            rows.iter_mut()
                .find(|row| row.record.outcome == outcome)
                .unwrap(),
        );
        folder.part(0).write(&rows).unwrap();
        let read = folder
            .parts()
            .and_then(|parts| parts.collect::<Result<Vec<_>>>());
        let errors = [read.unwrap_err(), folder.check_rows().unwrap_err()];
        assert_eq!(errors.each_ref().map(Error::exit_code), [3, 3]);
        let [message, told_by_status] = errors.map(|error| error.to_string());
        assert_eq!(message, told_by_status);
        let advice = "To have its trials run again, remove part-000000.parquet";
        assert!(
            message.contains("part-000000.parquet: trial ") && message.contains(advice),
            "{message}"
        );
        message
    }

    /// The hash matches, so a forger made it anew. Each case makes a single change, in a row with the outcome
    /// that the change contradicts.
    #[test]
    fn a_row_that_contradicts_itself_is_refused() {
        let (_dir, folder) = written(&[1, 2]);
        type RowContradiction = (&'static str, Outcome, fn(&mut TrialRow));
        let changes: [RowContradiction; 10] = [
            ("fell_at_s = 1.5", Outcome::Fell, |r| {
                r.record.outcome = Outcome::Recovered
            }),
            ("outcome = broke", Outcome::Fell, |r| {
                r.record.outcome = Outcome::Broke
            }),
            ("fell_at_s = (none)", Outcome::Recovered, |r| {
                r.record.outcome = Outcome::Fell
            }),
            ("settled_at_s = (none)", Outcome::TimedOut, |r| {
                r.record.outcome = Outcome::Recovered
            }),
            ("settled_at_s = 0.1", Outcome::Recovered, |r| {
                r.record.settled_at_s = Some(0.1)
            }),
            ("fall_cause = (none)", Outcome::Fell, |r| {
                r.record.fall_cause = None
            }),
            ("home_at_s = 1", Outcome::Fell, |r| {
                r.record.home_at_s = Some(1.0)
            }),
            ("end_s = 1000", Outcome::TimedOut, |r| r.record.end_s = 1e3),
            ("peak_tilt_deg = 170", Outcome::Recovered, |r| {
                r.record.peak_tilt_deg = 170.0
            }),
            ("peak_slip_m = -0.1", Outcome::TimedOut, |r| {
                r.record.peak_slip_m = -0.1
            }),
        ];
        for (expected, outcome, change) in changes {
            let message = contradicted(&folder, outcome, change);
            assert!(
                message.contains(" of hold: ") && message.contains(expected),
                "{expected}: {message}"
            );
            assert!(
                message.contains(": cannot be in an episode that "),
                "{message}"
            );
        }
    }

    /// The drawn quantities follow from the seed and the trial's number, so a change of a single bit is noticed.
    #[test]
    fn a_row_with_another_push_or_variation_than_its_trial_draws_is_refused() {
        let (_dir, mut folder) = written(&[]);
        let campaign = campaign(
            "smoke",
            &[
                "second_push={impulse_n_s={uniform=[1, 2]}, after_s=0.2}",
                "variations.friction={uniform=[0.5, 1]}",
            ],
        );
        folder.manifest.campaign = Campaign {
            trials: 60,
            ..campaign
        };
        for block in [1, 2] {
            folder.part(block).write(&rows(&folder, block)).unwrap();
        }
        let a_bit_more = |value: f64| f64::from_bits(value.to_bits() + 1);
        type DrawnChange<'a> = (&'static str, &'a dyn Fn(&mut TrialRow));
        let changes: [DrawnChange; 12] = [
            ("impulse_n_s", &|r| r.push.impulse_n_s = 0.001),
            ("impulse_n_s", &|r| r.push.impulse_n_s = f64::NAN),
            ("impulse_n_s", &|r| {
                r.push.impulse_n_s = a_bit_more(r.push.impulse_n_s)
            }),
            ("heading_deg", &|r| r.push.heading_deg = 1e300),
            ("height_m", &|r| r.push.height_m = -0.0),
            ("duration_s", &|r| r.push.duration_s = -1.0),
            ("start_s", &|r| r.push.start_s = a_bit_more(r.push.start_s)),
            ("profile", &|r| r.push.profile = Profile::HalfSine),
            ("second_impulse_n_s", &|r| {
                r.second.second_impulse_n_s = None
            }),
            ("second_start_s", &|r| {
                r.second.second_start_s = r.second.second_start_s.map(a_bit_more)
            }),
            ("friction", &|r| {
                r.variation.friction = r.variation.friction.map(a_bit_more)
            }),
            ("delay_s", &|r| r.variation.delay_s = Some(0.01)),
        ];
        for (column, change) in changes {
            let message = contradicted(&folder, Outcome::Fell, change);
            let seed = folder.manifest.campaign.seed;
            let told = format!("is not what seed {seed} draws for this trial; accepted: ");
            assert!(
                message.contains(&format!(" of hold: {column} = ")) && message.contains(&told),
                "{message}"
            );
        }
        // The parts are of another seed, with labels that state this one.
        folder.manifest.campaign.seed += 1;
        assert!(
            folder
                .check_rows()
                .unwrap_err()
                .to_string()
                .starts_with("3 problems")
        );
    }

    #[test]
    fn what_cannot_be_written_is_told_at_the_start() {
        let (dir, folder) = written(&[0]);
        fs::create_dir(folder.path.join("parts/part-000001.parquet")).unwrap();
        let message = Folder::open(&folder.path).unwrap_err().to_string();
        assert!(
            message.contains("part-000001.parquet: it is a folder; accepted: a file"),
            "{message}"
        );
        #[cfg(unix)]
        {
            let link = dir.path().join("link");
            std::os::unix::fs::symlink("nowhere", &link).unwrap();
            let message = Folder::open(&link).unwrap_err().to_string();
            assert!(
                message.contains("it is a link to what does not exist"),
                "{message}"
            );
        }
    }

    /// A run that failed before its first part leaves a folder that counts as empty. The labels of parts state their
    /// campaign. A folder with other content is not opened.
    #[test]
    fn a_folder_without_a_manifest_is_told_by_its_parts() {
        let dir = tempfile::tempdir().unwrap();
        assert!(
            [dir.path(), &dir.path().join("new")]
                .into_iter()
                .all(|path| Folder::open(path).unwrap().is_none())
        );
        fs::create_dir_all(dir.path().join("parts")).unwrap();
        fs::write(dir.path().join("parts/.tmp-a"), "{").unwrap();
        assert!(Folder::open(dir.path()).unwrap().is_none());
        fs::write(dir.path().join("thesis.tex"), "").unwrap();
        assert!(Folder::open(dir.path()).is_err());
        let folder = folder(dir.path());
        folder.part(0).write(&rows(&folder, 0)).unwrap();
        let error = Folder::open(dir.path()).unwrap_err();
        assert!(matches!(error, Error::LostManifest(_)), "{error}");
        let labels = Folder::labels(dir.path()).unwrap();
        assert_eq!(
            (labels.len(), &labels[0].config_hash),
            (1, &folder.manifest.config_hash)
        );
        assert_eq!(labels[0].trials, 25);
        fs::write(dir.path().join("parts/part-000001.csv"), "trial").unwrap();
        let message = Folder::open(dir.path()).unwrap_err().to_string();
        assert!(
            message.contains("by a former version of standfast"),
            "{message}"
        );
    }
}
