//! Two results set beside each other, trial by trial: an earlier one as the baseline of gates, or two finished folders.
//!
//! A comparison of that kind stands on the trials being the same: seed, what is drawn, judge, and every push to the bit.

use crate::campaign::store::parts::{Folder, Manifest, parquet, write_result};
use crate::campaign::verdict::gate_spec::GateSpec;
use crate::campaign::verdict::gates::Gates;
use crate::campaign::verdict::summary::{SetOrigin, Summary, SummaryInput};
use crate::campaign::{Campaign, TrialRow, ask::trial};
use crate::error::{Error, Result};
use crate::files::sha256_hex;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Differences of two campaigns that an error names.
const SHOWN: usize = 4;

/// An earlier result with the same pushes.
pub struct Baseline {
    manifest: Manifest,
    rows: Vec<TrialRow>,
}

/// Which result was the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineId {
    pub name: String,
    /// Version of the program.
    pub standfast: String,
    pub config_hash: String,
    pub trials: u64,
}

impl Baseline {
    /// Errors: no complete result, or of other trials than those of `ours`.
    pub fn open(path: &Path, ours: &Manifest) -> Result<Baseline> {
        let folder = Folder::existing(path)?;
        let campaign = &ours.campaign;
        refuse_other_trials(&folder, campaign)?;
        let rows = folder.rows()?;
        for row in &rows {
            let (pushes, variation) = (trial::pushes(campaign, row.trial), trial::variation(campaign, row.trial));
            if row.pushes() != pushes || row.variation() != variation {
                return Err(other_push(path, row.trial));
            }
        }
        Ok(Baseline { manifest: folder.manifest, rows })
    }

    pub fn sets(&self) -> &[String] {
        &self.manifest.sets
    }

    pub fn trials(&self) -> u64 {
        (self.rows.len() / self.manifest.sets.len()) as u64
    }

    /// What a report says of it.
    pub fn told(&self) -> BaselineId {
        let Manifest { standfast, config_hash, campaign, .. } = &self.manifest;
        let (name, trials) = (campaign.name.clone(), self.trials());
        BaselineId { name, standfast: standfast.clone(), config_hash: config_hash.clone(), trials }
    }

    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Whether it ended when decided: then its count of trials has to do with its outcomes.
    pub fn is_sequential(&self) -> bool {
        self.manifest.campaign.stopping.until_resolved
    }

    /// In the order of trials, from 0.
    pub fn rows_of(&self, set: &str) -> Vec<&TrialRow> {
        self.rows.iter().filter(|row| row.set == set).collect()
    }
}

/// Two results as one: what a campaign with the gain sets of both would have given.
pub struct Comparison {
    /// Of the first, with the name, sets, count of trials and hashes of both.
    pub manifest: Manifest,
    /// The trials that both have; sorted by trial, then by set, those of the first before those of the second.
    pub rows: Vec<TrialRow>,
    /// The rows, as `trials.parquet`.
    trials: Vec<u8>,
    /// Pairs of sets, one of each result: of the same name or, if no name is in both, every one.
    pub pairs: Vec<(usize, usize)>,
    pub gates: Gates,
    /// Of each set; paths as those of the folders.
    pub origins: Vec<SetOrigin>,
    pub warnings: Vec<String>,
}

impl Comparison {
    /// Sets two finished folders beside each other; `gates` are in the names of [`Comparison::manifest`]. Errors: a folder is
    /// not complete, their trials are not the same, or a gate cannot be read.
    pub fn new(a: &Folder, b: &Folder, gates: &[String]) -> Result<Comparison> {
        if is_same_folder(&a.path, &b.path) {
            let problem = "both are this folder: a result does not differ from itself";
            return Err(Error::Parts { path: b.path.clone(), problem: problem.into() });
        }
        refuse_other_trials(b, &a.manifest.campaign)?;
        let (rows_a, rows_b) = (a.rows()?, b.rows()?);
        let (sets_a, sets_b) = (&a.manifest.sets, &b.manifest.sets);
        let sets = [names(a, b), names(b, a)].concat();
        let mut rows = Vec::new();
        for (of_a, of_b) in rows_a.chunks_exact(sets_a.len()).zip(rows_b.chunks_exact(sets_b.len())) {
            let (ours, theirs) = (&of_a[0], &of_b[0]);
            if ours.pushes() != theirs.pushes() || ours.variation() != theirs.variation() {
                return Err(other_push(&b.path, ours.trial));
            }
            rows.extend(
                of_a.iter().chain(of_b).zip(&sets).map(|(row, set)| TrialRow { set: set.clone(), ..row.clone() }),
            );
        }
        let place = |i: usize| sets_a.len() + i;
        let of_one_name: Vec<(usize, usize)> = (sets_a.iter().enumerate())
            .filter_map(|(i, set)| Some((i, place(sets_b.iter().position(|other| other == set)?))))
            .collect();
        let every = || (0..sets_a.len()).flat_map(|i| (0..sets_b.len()).map(move |j| (i, place(j)))).collect();
        let pairs = if of_one_name.is_empty() { every() } else { of_one_name };
        let trials = (rows.len() / sets.len()) as u64;
        let mut warnings = Vec::new();
        if a.trials() != b.trials() {
            let (of_a, of_b) = (a.trials(), b.trials());
            warnings.push(format!("the results have {of_a} and {of_b} trials: only the first {trials} are compared"));
        }
        let (in_a, in_b) = (&a.manifest, &b.manifest);
        warnings.extend(unlike(in_a, in_b));
        let both = |a: &str, b: &str| if a == b { a.to_string() } else { format!("{a}, {b}") };
        let mut campaign = in_a.campaign.clone();
        campaign.name = both(&in_a.campaign.name, &in_b.campaign.name);
        campaign.robot = both(&in_a.campaign.robot, &in_b.campaign.robot);
        campaign.trials = trials;
        campaign.stopping.until_resolved |= in_b.campaign.stopping.until_resolved;
        let (ours, theirs) = (&in_a.campaign.gates, &in_b.campaign.gates);
        if (ours.confidence, ours.unresolved) != (theirs.confidence, theirs.unresolved) {
            warnings
                .push("the results ask for gates of another confidence, or decide otherwise what is unresolved".into());
        }
        campaign.gates = GateSpec { require: gates.to_vec(), ..ours.clone() };
        let manifest = Manifest {
            standfast: both(&in_a.standfast, &in_b.standfast),
            config_hash: sha256_hex(format!("{} {}", in_a.config_hash, in_b.config_hash).as_bytes()),
            build: both(&in_a.build, &in_b.build),
            robot_sha256: both(&in_a.robot_sha256, &in_b.robot_sha256),
            sets,
            campaign,
        };
        let gates = Gates::new(&manifest, None)?;
        let trials = parquet(&rows)?;
        Ok(Comparison { gates, manifest, rows, trials, pairs, origins: [origins(a), origins(b)].concat(), warnings })
    }

    /// What they say of each other.
    pub fn summary(&self) -> Summary {
        let Self { manifest, rows, pairs, gates, .. } = self;
        let trials_sha256 = sha256_hex(&self.trials);
        let mut summary = Summary::new(SummaryInput { manifest, rows, trials_sha256, pairs, gates });
        summary.warnings.splice(..0, self.warnings.iter().cloned());
        for (set, origin) in summary.sets.iter_mut().zip(&self.origins) {
            set.origin = origin.clone();
        }
        summary
    }

    /// Writes `trials.parquet` and `summary.json`, and gives the summary as it is then: with paths of the two results as
    /// they are from that folder.
    pub fn write(&self, mut summary: Summary, folder: &Path) -> Result<Summary> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
        for set in &mut summary.sets {
            set.origin.campaign = seen_from(folder, Path::new(&set.origin.campaign)).display().to_string();
        }
        write_result(folder, &self.trials, &summary)?;
        Ok(summary)
    }
}

/// Names of a folder's sets; those that the other one has too, with the folder's.
fn names(folder: &Folder, other: &Folder) -> Vec<String> {
    let label = label(&folder.path, &other.path);
    let is_shared = |set: &String| other.manifest.sets.contains(set);
    let name = |set: &String| if is_shared(set) { format!("{set} ({label})") } else { set.clone() };
    folder.manifest.sets.iter().map(name).collect()
}

fn origins(folder: &Folder) -> Vec<SetOrigin> {
    let campaign = folder.path.join("campaign.toml").display().to_string();
    let origin = |gains: &String| SetOrigin { campaign: campaign.clone(), gains: gains.clone() };
    folder.manifest.sets.iter().map(origin).collect()
}

/// Whether two paths lead to the same place.
pub fn is_same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The path of a file as it is from a folder; both exist.
fn seen_from(folder: &Path, file: &Path) -> PathBuf {
    let (Ok(folder), Ok(file)) = (folder.canonicalize(), file.canonicalize()) else { return file.into() };
    pathdiff::diff_paths(&file, &folder).unwrap_or(file)
}

/// What makes two results hard to compare, beside their trials: they differ in more than gains, or in nothing.
pub fn unlike(a: &Manifest, b: &Manifest) -> Vec<String> {
    let robots = [a, b].map(|m| format!("{} ({:.8})", m.campaign.robot, m.robot_sha256));
    let versions = [a, b].map(|m| m.standfast.clone());
    let differ = |(what, [of_a, of_b]): (&str, [String; 2])| {
        (of_a != of_b).then(|| format!("the {what} differ: {of_a} and {of_b}"))
    };
    let differences = [("robots", robots), ("versions of standfast", versions)].into_iter().filter_map(differ);
    let same = "both were made from the same inputs: only another build can have made a difference";
    differences.chain((a.config_hash == b.config_hash).then(|| same.to_string())).collect()
}

/// Every pair of so many sets, the earlier one first.
pub fn every_pair(sets: usize) -> Vec<(usize, usize)> {
    (0..sets).flat_map(|a| (a + 1..sets).map(move |b| (a, b))).collect()
}

/// What tells a folder from another: as much of the end of its path as it takes.
fn label(path: &Path, other: &Path) -> String {
    let (ours, theirs) = (path.file_name(), other.file_name());
    match ours {
        Some(name) if ours != theirs => name.to_string_lossy().into_owned(),
        _ => path.display().to_string(),
    }
}

/// Errors: the trials of `folder` are drawn or judged otherwise than those of `campaign`.
fn refuse_other_trials(folder: &Folder, campaign: &Campaign) -> Result<()> {
    let mut found = Vec::new();
    differences("", &drawn(campaign), &drawn(&folder.manifest.campaign), &mut found);
    if found.is_empty() {
        return Ok(());
    }
    let more = match found.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!("; and {more} more differ"),
    };
    found.truncate(SHOWN);
    let problem = format!("its trials are others, so nothing can be paired: {}{more}", found.join("; "));
    Err(Error::Parts { path: folder.path.clone(), problem })
}

fn other_push(path: &Path, trial: u64) -> Error {
    let problem = format!("trial {trial} met another push, robot or ground, though the campaigns say the same");
    Error::Parts { path: path.into(), problem: problem + ": another version drew it otherwise" }
}

/// All of a campaign that says what its trials are and how they are judged.
fn drawn(campaign: &Campaign) -> Value {
    serde_json::json!({
        "seed": campaign.seed,
        "push": campaign.push,
        "second_push": campaign.second_push,
        "variations": campaign.variations,
        "sensors": campaign.sensors,
        "episode": campaign.episode,
    })
}

/// The values that differ, each with its dotted key.
fn differences(key: &str, here: &Value, there: &Value, found: &mut Vec<String>) {
    match (here, there) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            for (name, value) in a {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                differences(&key, value, &b[name], found);
            }
        }
        _ if here == there => {}
        _ => found.push(format!("{key} is {there} there and {here} here")),
    }
}
