//! Compares two finished results trial by trial.

use crate::ask::entrant::Entrant;
use crate::store::folder::Folder;
use crate::store::manifest::{Manifest, each_once};
use crate::store::row::{TrialRow, TrialsFile};
use crate::verdict::baseline::{refuse_other_trials, unlike};
use crate::verdict::controller_summary::ControllerOrigin;
use crate::verdict::gates::Gates;
use crate::verdict::pairs::every_pair;
use crate::verdict::placement;
use crate::verdict::summary::Summary;
use crate::verdict::trial_columns::TrialColumns;
use standfast_core::error::{Error, Result};
use standfast_files::{AtomicFile, is_same_folder, sha256_hex};
use standfast_sim::Engine;
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
    of: [Side; 2],
}

/// One of the two results.
struct Side {
    folder: Folder,
    /// Its entrants that are compared.
    entrants: Vec<Compared>,
}

/// An entrant that is compared.
struct Compared {
    /// Its place in its result.
    place: usize,
    engine: Engine,
    /// Its name in the comparison.
    name: String,
}

impl Comparison {
    /// Compares two finished folders. `gates` name the controllers as the summary does. Of a [packed](Folder::is_packed)
    /// result, only entrants in an engine of the other result are compared. It fails if a folder is not complete, if the
    /// trials of the two are not the same, if the robot of a packed result has other joints, or if a gate cannot be read.
    pub fn new(a: &Folder, b: &Folder, gates: &[String]) -> Result<Comparison> {
        if a.is_packed() && !b.is_packed() {
            return Self::new(b, a, gates);
        }
        if is_same_folder(&a.path, &b.path) || a.name() == b.name() {
            let problem = "both are this folder: a result does not differ from itself";
            return Err(Error::Parts {
                path: b.name().into(),
                problem: problem.into(),
            });
        }
        refuse_other_trials(b, &a.manifest.campaign)?;
        let of = [Side::new(a, b)?, Side::new(b, a)?];
        let mut warnings = warnings(&of)?;
        let (rows, _, sha256) = paired(&of, sink())?;
        let count = rows.trials();
        if a.trials() != b.trials() {
            warnings.insert(
                0,
                format!(
                    "the results have {} and {} trials: only the first {count} are compared",
                    a.trials(),
                    b.trials()
                ),
            );
        }
        let manifest = joined(&of, count, gates);
        let mut summary = Summary::new(
            &manifest,
            &rows,
            sha256,
            &pairs(&of),
            &Gates::new(&manifest, None)?,
        );
        summary.warnings.splice(..0, warnings);
        if b.is_packed() {
            let (own, theirs) = summary.controllers.split_at(of[0].entrants.len());
            summary.headline = placement::of(own, theirs, &summary.pairs, &b.name());
        }
        for (controller, origin) in summary
            .controllers
            .iter_mut()
            .zip(of.iter().flat_map(Side::origins))
        {
            controller.origin = origin;
        }
        Ok(Comparison { summary, rows, of })
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
        let origins = summary
            .controllers
            .iter_mut()
            .map(|controller| &mut controller.origin);
        for origin in origins.filter(|origin| !origin.is_packed) {
            origin.campaign = seen_from(folder, Path::new(&origin.campaign))
                .display()
                .to_string();
        }
        let to = AtomicFile::create(&folder.join("trials.parquet"))?;
        let (_, trials, sha256) = paired(&self.of, to)?;
        if sha256 != summary.trials_sha256 {
            let [a, b] = &self.of.each_ref().map(|side| &side.folder.path);
            let problem = format!("it or {} changed while the two were compared", b.display());
            return Err(Error::Parts {
                path: a.to_path_buf(),
                problem,
            });
        }
        trials.commit()?;
        summary.write(folder)?;
        Ok(summary)
    }
}

/// The summary of the entrants of a result in one engine, which have the names of their controllers.
pub fn in_engine(folder: &Folder, engine: Engine) -> Result<Summary> {
    let mut side = Side::of(folder, |own| own == engine)?;
    side.name_controllers_alone();
    let sides = [side];
    let (rows, _, sha256) = paired(&sides, sink())?;
    let manifest = joined(&sides, rows.trials(), &[]);
    let pairs = every_pair(manifest.controllers.len());
    let gates = Gates::new(&manifest, None)?;
    Ok(Summary::new(&manifest, &rows, sha256, &pairs, &gates))
}

impl Side {
    /// The result `folder`, beside the result `other`. It fails if no engine is in both and this one is packed.
    fn new(folder: &Folder, other: &Folder) -> Result<Side> {
        let theirs = other.manifest.campaign.engines();
        let is_packed = folder.is_packed();
        let mut side = Side::of(folder, |engine| !is_packed || theirs.contains(&engine))?;
        if is_packed {
            side.name_controllers_alone();
        }
        let label = label(&folder.path, &other.path);
        for Compared { name, .. } in &mut side.entrants {
            let mut others = other.manifest.controllers.iter();
            let is_theirs = others
                .any(|own| own == name || is_packed && Entrant::split(own).controller == name);
            if is_theirs && (is_packed || !other.is_packed()) {
                *name = format!("{name} ({label})");
            }
        }
        Ok(side)
    }

    /// The entrants of a result in the engines that are wanted. It fails if there are none.
    fn of(folder: &Folder, is_wanted: impl Fn(Engine) -> bool) -> Result<Side> {
        let manifest = &folder.manifest;
        let mut entrants = Vec::new();
        for (place, engine) in manifest.campaign.engines().into_iter().enumerate() {
            let name = manifest.controllers[place].clone();
            entrants.push(Compared {
                place,
                engine,
                name,
            });
        }
        entrants.retain(|entrant| is_wanted(entrant.engine));
        if entrants.is_empty() {
            return Err(Error::Parts {
                path: folder.path.clone(),
                problem: "it has no trial in the engine of the other result".into(),
            });
        }
        Ok(Side {
            folder: folder.clone(),
            entrants,
        })
    }

    /// Leaves the engine out of the names of the entrants, if it is the same for all.
    fn name_controllers_alone(&mut self) {
        let engine = self.entrants[0].engine;
        if self.entrants.iter().all(|entrant| entrant.engine == engine) {
            for Compared { name, .. } in &mut self.entrants {
                *name = Entrant::split(name).controller.into();
            }
        }
    }

    fn names(&self) -> impl Iterator<Item = String> {
        self.entrants.iter().map(|entrant| entrant.name.clone())
    }

    /// Name and version of the engine of each entrant.
    fn engines(&self) -> impl Iterator<Item = String> {
        let engines = &self.folder.manifest.engines;
        self.entrants
            .iter()
            .map(|entrant| engines[entrant.place].clone())
    }

    /// The name of an entrant in its own result.
    fn own_name(&self, entrant: &Compared) -> &String {
        &self.folder.manifest.controllers[entrant.place]
    }

    fn origins(&self) -> impl Iterator<Item = ControllerOrigin> {
        let campaign = match self.folder.is_packed() {
            true => self.folder.name(),
            false => self.folder.path.join("campaign.toml").display().to_string(),
        };
        self.entrants.iter().map(move |entrant| ControllerOrigin {
            campaign: campaign.clone(),
            controller: self.own_name(entrant).clone(),
            is_packed: self.folder.is_packed(),
        })
    }

    /// The rows of each trial, with the names of the comparison and without the entrants that are not compared.
    fn trials(&self) -> Result<impl Iterator<Item = Result<Vec<TrialRow>>>> {
        let entrants = self.entrants.iter();
        let names: HashMap<&String, &String> = entrants
            .map(|entrant| (self.own_name(entrant), &entrant.name))
            .collect();
        let renamed = move |row: TrialRow| {
            let controller = names.get(&row.controller)?.to_string();
            Some(TrialRow { controller, ..row })
        };
        let trials = trials(&self.folder)?;
        Ok(trials.map(move |rows| Ok(rows?.into_iter().filter_map(&renamed).collect())))
    }
}

/// Reads the trials that all results have. The rows are written to `to` as a `trials.parquet`. Returns the columns, `to`,
/// and the SHA-256 of the file.
fn paired<W: Write + Send>(of: &[Side], to: W) -> Result<(TrialColumns, W, String)> {
    let names: Vec<String> = of.iter().flat_map(Side::names).collect();
    let mut columns = TrialColumns::new(&names, &of[0].folder.manifest.campaign.episode);
    let mut file = TrialsFile::new(to, &totals(of))?;
    let mut trials = of.iter().map(Side::trials).collect::<Result<Vec<_>>>()?;
    'trials: loop {
        let mut rows = Vec::new();
        for trials in &mut trials {
            match trials.next() {
                Some(of_side) => rows.extend(of_side?),
                None => break 'trials,
            }
        }
        columns.push(&rows);
        file.push(rows)?;
    }
    let (to, sha256) = file.finish()?;
    Ok((columns, to, sha256))
}

/// The totals that controllers of any result report.
fn totals(of: &[Side]) -> Vec<String> {
    each_once(
        of.iter()
            .flat_map(|side| side.folder.manifest.totals.clone()),
    )
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
/// name is in both results, every controller of one makes a pair with every controller of the other. If the second is
/// packed, every controller of the first makes a pair with every other one of the first, and with every one of the second
/// in its engine.
fn pairs([a, b]: &[Side; 2]) -> Vec<(usize, usize)> {
    let is_packed = a.folder.is_packed() || b.folder.is_packed();
    let of_one_name: Vec<_> = every(a, b)
        .filter(|(i, j)| a.own_name(&a.entrants[*i]) == b.own_name(&b.entrants[*j]))
        .collect();
    let own = every_pair(a.entrants.len()).into_iter();
    let pairs = match (is_packed, of_one_name.is_empty()) {
        (true, _) => {
            let across = every(a, b)
                .filter(|(i, j)| a.entrants[*i].engine == b.entrants[*j].engine)
                .map(|(i, j)| (i, a.entrants.len() + j));
            return own.chain(across).collect();
        }
        (false, true) => every(a, b).collect(),
        (false, false) => of_one_name,
    };
    pairs
        .into_iter()
        .map(|(i, j)| (i, a.entrants.len() + j))
        .collect()
}

fn every(a: &Side, b: &Side) -> impl Iterator<Item = (usize, usize)> {
    let of_b = b.entrants.len();
    (0..a.entrants.len()).flat_map(move |i| (0..of_b).map(move |j| (i, j)))
}

/// The manifest of the comparison: the manifest of the first result, with the names, controllers and hashes of all,
/// and with the number of trials that all have.
fn joined(of: &[Side], trials: u64, gates: &[String]) -> Manifest {
    let all: Vec<&Manifest> = of.iter().map(|side| &side.folder.manifest).collect();
    let listed = |text: fn(&Manifest) -> &String| {
        each_once(all.iter().map(|manifest| text(manifest).clone())).join(", ")
    };
    let mut campaign = all[0].campaign.clone();
    campaign.name = listed(|manifest| &manifest.campaign.name);
    campaign.robot = listed(|manifest| &manifest.campaign.robot);
    campaign.trials = trials;
    campaign.stopping.until_resolved = all
        .iter()
        .any(|manifest| manifest.campaign.stopping.until_resolved);
    campaign.gates.require = gates.to_vec();
    // Of a packed result nobody can run the controllers, so nothing is told of their files.
    let with_files = of
        .iter()
        .filter(|side| !side.folder.is_packed())
        .map(|side| &side.folder.manifest);
    let hashes: Vec<&str> = all.iter().map(|manifest| &*manifest.config_hash).collect();
    Manifest {
        standfast: listed(|manifest| &manifest.standfast),
        config_hash: sha256_hex(hashes.join(" ").as_bytes()),
        robot_sha256: listed(|manifest| &manifest.robot_sha256),
        engines: of.iter().flat_map(Side::engines).collect(),
        part_trials: all[0].part_trials,
        controllers: of.iter().flat_map(Side::names).collect(),
        totals: totals(of),
        robot: all.iter().find_map(|manifest| manifest.robot.clone()),
        inputs: Vec::new(),
        not_kept: with_files
            .clone()
            .flat_map(|manifest| manifest.not_kept.clone())
            .collect(),
        trained_otherwise: with_files
            .flat_map(|manifest| manifest.trained_otherwise.clone())
            .collect(),
        campaign,
    }
}

/// Warns of what a comparison cannot support. It fails if one of the results is packed and their robots have other joints.
fn warnings([a, b]: &[Side; 2]) -> Result<Vec<String>> {
    let (mut ours, mut theirs) = (a.folder.manifest.clone(), b.folder.manifest.clone());
    let mut warnings = Vec::new();
    if a.folder.is_packed() || b.folder.is_packed() {
        let differences = a
            .folder
            .robot_values()?
            .differences(&b.folder.robot_values()?);
        warnings.extend(differences.warning(&b.folder.name())?);
        // Their files need not be the same, and the engines are those of the entrants that are compared.
        theirs.robot_sha256.clone_from(&ours.robot_sha256);
        theirs.campaign.robot.clone_from(&ours.campaign.robot);
        theirs.config_hash.clear();
        (ours.engines, theirs.engines) = (a.engines().collect(), b.engines().collect());
        ours.engines.sort();
        theirs.engines.sort();
    }
    warnings.extend(unlike(&ours, &theirs));
    let [ours, theirs] = [ours, theirs].map(|manifest| manifest.campaign.gates);
    if (ours.confidence, ours.unresolved) != (theirs.confidence, theirs.unresolved) {
        warnings.push(
            "the results ask for gates of another confidence, or decide otherwise what is unresolved"
                .into(),
        );
    }
    Ok(warnings)
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
