//! Compares two finished results trial by trial.

use crate::ask::gate::GateSpec;
use crate::store::folder::Folder;
use crate::store::manifest::{Manifest, each_once};
use crate::store::row::{TrialRow, TrialsFile};
use crate::verdict::baseline::{refuse_other_trials, unlike};
use crate::verdict::controller_summary::ControllerOrigin;
use crate::verdict::gates::Gates;
use crate::verdict::summary::Summary;
use crate::verdict::trial_columns::TrialColumns;
use standfast_core::error::{Error, Result};
use standfast_files::{AtomicFile, is_same_folder, sha256_hex};
use std::collections::HashMap;
use std::io::{Write, sink};
use std::path::{Path, PathBuf};

/// Two results joined to one, as if one campaign had had the controllers of both.
pub struct Comparison {
    /// The summary of both results. Its campaign is the campaign of the first result, with the names, controllers and
    /// hashes of both. The path of an [origin](ControllerOrigin) begins with the path by which its folder was named.
    pub summary: Summary,
    /// The trials that both results have. The controllers of the first result come before those of the second.
    pub rows: TrialColumns,
    /// The two results.
    of: [Folder; 2],
}

impl Comparison {
    /// Compares two finished folders. `gates` name the controllers as the summary does. It fails if a folder is not
    /// complete, if the trials of the two are not the same, or if a gate cannot be read.
    pub fn new(a: &Folder, b: &Folder, gates: &[String]) -> Result<Comparison> {
        if is_same_folder(&a.path, &b.path) {
            let problem = "both are this folder: a result does not differ from itself";
            return Err(Error::Parts {
                path: b.path.clone(),
                problem: problem.into(),
            });
        }
        refuse_other_trials(b, &a.manifest.campaign)?;
        let controllers = [names(a, b), names(b, a)].concat();
        let (rows, _, sha256) = paired([a, b], &controllers, sink())?;
        let count = rows.trials();
        let manifest = joined(&a.manifest, &b.manifest, controllers, count, gates);
        let pairs = pairs(&a.manifest.controllers, &b.manifest.controllers);
        let mut summary = Summary::new(
            &manifest,
            &rows,
            sha256,
            &pairs,
            &Gates::new(&manifest, None)?,
        );
        summary.warnings.splice(..0, warnings(a, b, count));
        for (controller, origin) in summary
            .controllers
            .iter_mut()
            .zip([origins(a), origins(b)].concat())
        {
            controller.origin = origin;
        }
        Ok(Comparison {
            summary,
            rows,
            of: [a.clone(), b.clone()],
        })
    }

    /// Reads both results again, and writes `trials.parquet` and `summary.json`. It returns the summary as it was
    /// written, with paths that are relative to `folder`. It fails if a result has changed meanwhile, or if the folder
    /// is not writable.
    pub fn write(&self, folder: &Path) -> Result<Summary> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write {
            path: folder.into(),
            source,
        })?;
        let mut summary = self.summary.clone();
        for controller in &mut summary.controllers {
            controller.origin.campaign = seen_from(folder, Path::new(&controller.origin.campaign))
                .display()
                .to_string();
        }
        let [a, b] = &self.of;
        let to = AtomicFile::create(&folder.join("trials.parquet"))?;
        let (_, trials, sha256) = paired([a, b], &self.rows.names, to)?;
        if sha256 != summary.trials_sha256 {
            let problem = format!(
                "it or {} changed while the two were compared",
                b.path.display()
            );
            return Err(Error::Parts {
                path: a.path.clone(),
                problem,
            });
        }
        trials.commit()?;
        summary.write(folder)?;
        Ok(summary)
    }
}

/// Reads the trials that both folders have. `controllers` are the new names of their controllers, those of the first folder
/// first. The rows are written to `to` as a `trials.parquet`. Returns the columns, `to`, and the SHA-256 of the file.
fn paired<W: Write + Send>(
    [a, b]: [&Folder; 2],
    controllers: &[String],
    to: W,
) -> Result<(TrialColumns, W, String)> {
    let (names_a, names_b) = controllers.split_at(a.manifest.controllers.len());
    let renamed = |folder: &Folder, names: &[String]| {
        let controllers = folder.manifest.controllers.iter().cloned();
        let names: HashMap<String, String> = controllers.zip(names.iter().cloned()).collect();
        move |row: TrialRow| TrialRow {
            controller: names[&row.controller].clone(),
            ..row
        }
    };
    let (renamed_a, renamed_b) = (renamed(a, names_a), renamed(b, names_b));
    let totals = each_once(
        [a, b]
            .into_iter()
            .flat_map(|folder| folder.manifest.totals.clone()),
    );
    let mut columns = TrialColumns::new(controllers, &a.manifest.campaign.episode);
    let mut file = TrialsFile::new(to, &totals)?;
    for (of_a, of_b) in trials(a)?.zip(trials(b)?) {
        let (of_a, of_b) = (of_a?, of_b?);
        let rows: Vec<TrialRow> = of_a
            .into_iter()
            .map(&renamed_a)
            .chain(of_b.into_iter().map(&renamed_b))
            .collect();
        columns.push(&rows);
        file.push(rows)?;
    }
    let (to, sha256) = file.finish()?;
    Ok((columns, to, sha256))
}

/// The rows of each trial of a finished folder.
fn trials(folder: &Folder) -> Result<impl Iterator<Item = Result<Vec<TrialRow>>>> {
    Ok(folder.parts()?.flat_map(|part| match part {
        Ok(rows) => rows
            .chunk_by(|a, b| a.trial == b.trial)
            .map(|trial| Ok(trial.to_vec()))
            .collect(),
        Err(error) => vec![Err(error)],
    }))
}

/// Pairs of a controller of one result and a controller of the other. Controllers of the same name make a pair. If no
/// name is in both results, every controller of one makes a pair with every controller of the other.
fn pairs(controllers_a: &[String], controllers_b: &[String]) -> Vec<(usize, usize)> {
    let all =
        || (0..controllers_a.len()).flat_map(|i| (0..controllers_b.len()).map(move |j| (i, j)));
    let of_one_name: Vec<_> = all()
        .filter(|&(i, j)| controllers_a[i] == controllers_b[j])
        .collect();
    let pairs = if of_one_name.is_empty() {
        all().collect()
    } else {
        of_one_name
    };
    pairs
        .into_iter()
        .map(|(i, j)| (i, controllers_a.len() + j))
        .collect()
}

/// The manifest of the comparison: the manifest of the first result, with the names, controllers and hashes of both,
/// and with the number of trials that both have.
fn joined(
    a: &Manifest,
    b: &Manifest,
    controllers: Vec<String>,
    trials: u64,
    gates: &[String],
) -> Manifest {
    let both = |a: &str, b: &str| {
        if a == b {
            a.to_string()
        } else {
            format!("{a}, {b}")
        }
    };
    let mut campaign = a.campaign.clone();
    campaign.name = both(&a.campaign.name, &b.campaign.name);
    campaign.robot = both(&a.campaign.robot, &b.campaign.robot);
    campaign.trials = trials;
    campaign.stopping.until_resolved |= b.campaign.stopping.until_resolved;
    campaign.gates = GateSpec {
        require: gates.to_vec(),
        ..a.campaign.gates.clone()
    };
    Manifest {
        standfast: both(&a.standfast, &b.standfast),
        config_hash: sha256_hex(format!("{} {}", a.config_hash, b.config_hash).as_bytes()),
        robot_sha256: both(&a.robot_sha256, &b.robot_sha256),
        engines: [&a.engines[..], &b.engines].concat(),
        part_trials: a.part_trials,
        controllers,
        totals: each_once([a, b].into_iter().flat_map(|of| of.totals.clone())),
        inputs: Vec::new(),
        not_kept: [a, b]
            .into_iter()
            .flat_map(|of| of.not_kept.clone())
            .collect(),
        trained_otherwise: [a, b]
            .into_iter()
            .flat_map(|of| of.trained_otherwise.clone())
            .collect(),
        campaign,
    }
}

/// Warns of what a comparison over the first `trials` trials cannot support.
fn warnings(a: &Folder, b: &Folder, trials: u64) -> Vec<String> {
    let (of_a, of_b) = (a.trials(), b.trials());
    let [ours, theirs] = [a, b].map(|folder| &folder.manifest.campaign.gates);
    let mut warnings = Vec::new();
    if of_a != of_b {
        warnings.push(format!(
            "the results have {of_a} and {of_b} trials: only the first {trials} are compared"
        ));
    }
    warnings.extend(unlike(&a.manifest, &b.manifest));
    if (ours.confidence, ours.unresolved) != (theirs.confidence, theirs.unresolved) {
        warnings.push(
            "the results ask for gates of another confidence, or decide otherwise what is unresolved"
                .into(),
        );
    }
    warnings
}

/// The names of a folder's controllers. If the other folder has the same name, the name of the folder is added.
fn names(folder: &Folder, other: &Folder) -> Vec<String> {
    let label = label(&folder.path, &other.path);
    let mut names = folder.manifest.controllers.clone();
    for name in &mut names {
        if other.manifest.controllers.contains(name) {
            *name = format!("{name} ({label})");
        }
    }
    names
}

fn origins(folder: &Folder) -> Vec<ControllerOrigin> {
    let campaign = folder.path.join("campaign.toml").display().to_string();
    let controllers = folder.manifest.controllers.iter();
    controllers
        .map(|controller| ControllerOrigin {
            campaign: campaign.clone(),
            controller: controller.clone(),
        })
        .collect()
}

/// The path of a file, relative to a folder. Both must exist.
fn seen_from(folder: &Path, file: &Path) -> PathBuf {
    let (Ok(folder), Ok(file)) = (folder.canonicalize(), file.canonicalize()) else {
        return file.into();
    };
    pathdiff::diff_paths(&file, &folder).unwrap_or(file)
}

/// A short name by which a folder differs from another: the last part of its path or, if the last parts are the same,
/// the whole path.
fn label(path: &Path, other: &Path) -> String {
    let (ours, theirs) = (path.file_name(), other.file_name());
    match ours {
        Some(name) if ours != theirs => name.to_string_lossy().into_owned(),
        _ => path.display().to_string(),
    }
}
