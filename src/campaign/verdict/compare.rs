//! Two finished results set beside each other, trial by trial.

use crate::campaign::ask::gate::GateSpec;
use crate::campaign::store::folder::{Folder, Manifest};
use crate::campaign::store::row::{TrialRow, parquet};
use crate::campaign::verdict::baseline::{other_push, refuse_other_trials, unlike};
use crate::campaign::verdict::gates::Gates;
use crate::campaign::verdict::set_summary::SetOrigin;
use crate::campaign::verdict::summary::{Summary, SummaryInput};
use crate::error::{Error, Result};
use crate::files::sha256_hex;
use std::path::{Path, PathBuf};

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
        summary.write(folder, &self.trials)?;
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

/// What tells a folder from another: as much of the end of its path as it takes.
fn label(path: &Path, other: &Path) -> String {
    let (ours, theirs) = (path.file_name(), other.file_name());
    match ours {
        Some(name) if ours != theirs => name.to_string_lossy().into_owned(),
        _ => path.display().to_string(),
    }
}
