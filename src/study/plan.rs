//! What a campaign runs on: its inputs, read and checked, the folder for the result, and the trials one by one.

use crate::ask::bounds::check_steps;
use crate::ask::spec::Campaign;
use crate::ask::standing_bound::StandingBound;
use crate::ask::trial;
use crate::store::folder::Folder;
use crate::store::manifest::{Input, MANIFEST, Manifest, each_once, part_trials};
use crate::store::part::Marker;
use crate::store::row::{Repeats, TrialRow};
use rayon::ThreadPool;
use rayon::prelude::*;
use standfast_controllers::ControllerSpec;
use standfast_controllers::variant::ControllerName;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{PreparedController, Robot};
use standfast_files::assets::{self, InputKind, Source};
use standfast_files::{sha256_hex, write_atomic};
use standfast_robots::urdf::Files;
use standfast_sim::Engine;
use standfast_sim::episode::unpushed::UnpushedEpisode;
use standfast_sim::episode::{ClosedLoop, Disturbance, Outcome, Record, caught};
use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::path::Path;
use std::time::Instant;

/// A controller that cannot be copied runs every 50th trial twice, to see whether the trial repeats to the bit.
const TRIED_AGAIN: u64 = 50;

/// A campaign whose inputs are read and checked. The controllers are designed later.
pub struct PreparedCampaign {
    pub manifest: Manifest,
    pub(crate) robot: Robot,
    no_step: StandingBound,
    controllers: Vec<Box<dyn ControllerSpec>>,
    /// The inputs that are not compiled in, each by its name in the result folder.
    inputs: Vec<(String, Vec<u8>)>,
}

impl PreparedCampaign {
    /// Reads the robot and the controllers. It fails if any of them is missing or wrong, or if two controllers have the
    /// same name.
    pub fn new(campaign: &Campaign) -> Result<PreparedCampaign> {
        Self::with(campaign, Files::open(&campaign.robot)?)
    }

    /// As [`new`](Self::new), with the files of the campaign's robot, which are read already.
    pub fn with(campaign: &Campaign, files: Files) -> Result<PreparedCampaign> {
        let engine = campaign.episode.engine;
        let robot = files.load()?;
        engine.check(&robot)?;
        check_steps(&campaign.name, &campaign.episode, &robot)?;
        let entries: Vec<ControllerName> = campaign
            .gains
            .iter()
            .map(|gains| ControllerName::split(gains))
            .collect();
        let (mut sources, mut beside) = (Vec::new(), Vec::new());
        let mut controllers = Vec::new();
        let (mut sets, mut not_kept) = (Vec::new(), BTreeMap::new());
        for entry in &entries {
            let source = assets::open(InputKind::Controller, entry.base)?;
            let base = standfast_controllers::read(&source)?;
            sources.push((base.name().to_string(), source));
            beside.push(base.files()?);
            let lacks = base.not_kept();
            if !lacks.is_empty() {
                not_kept.insert(base.name().to_string(), lacks);
            }
            let controller = entry.of(base)?;
            sets.push(controller.name().to_string());
            controllers.push(controller);
        }
        check_names(campaign, &sets, &sources)?;
        let (mut inputs, mut resolved) = (Inputs::default(), campaign.clone());
        // The robot comes first among the inputs, with settings that may have been inferred, and with its meshes.
        let robot_files = [
            Some((files.settings, "toml")),
            files.meshes.map(|meshes| (meshes, "meshes")),
        ];
        let robot_files = robot_files
            .into_iter()
            .flatten()
            .chain([(files.urdf, "urdf")]);
        resolved.robot = inputs.take(&campaign.robot, "robot", robot_files)?;
        let robot_sha256 = sha256_hex(
            inputs
                .listed
                .iter()
                .map(|input| input.sha256.as_str())
                .collect::<String>()
                .as_bytes(),
        );
        for (((gains, entry), (base, source)), files) in resolved
            .gains
            .iter_mut()
            .zip(&entries)
            .zip(sources)
            .zip(beside)
        {
            *gains = entry.with_base(&inputs.take(
                entry.base,
                &format!("gains/{base}"),
                [(source, "toml")],
            )?);
            inputs.take_beside(entry.base, files)?;
        }
        let totals = each_once(
            controllers
                .iter()
                .flat_map(|controller| controller.totals())
                .map(|total| total.to_string()),
        );
        let standfast = env!("CARGO_PKG_VERSION").to_string();
        let engine = engine.with_version();
        let mut manifest = Manifest {
            standfast,
            config_hash: String::new(),
            robot_sha256,
            engine,
            part_trials: part_trials(&resolved),
            planned_trials: resolved.trials,
            sets,
            totals,
            inputs: inputs.listed,
            not_kept,
            campaign: resolved,
        };
        manifest.config_hash = manifest.hash()?;
        Ok(PreparedCampaign {
            manifest,
            no_step: StandingBound::new(&robot),
            robot,
            controllers,
            inputs: inputs.kept,
        })
    }

    /// Adds a controller that is no file but a part of the calling program. Its name and its tree are inputs of the
    /// result. Fails if another controller has this name.
    pub fn and(mut self, controller: Box<dyn ControllerSpec>) -> Result<PreparedCampaign> {
        let (name, manifest) = (controller.name().to_string(), &mut self.manifest);
        if manifest.sets.contains(&name) {
            let accepted = "a name of its own for each";
            return Err(Error::value(
                "the program",
                "name",
                name,
                "two controllers of this name",
                accepted,
            ));
        }
        let sha256 = sha256_hex(controller.tree().to_string().as_bytes());
        manifest.inputs.push(Input {
            file: format!("builtin:{name}"),
            sha256,
        });
        let more = controller.totals().iter().map(|total| total.to_string());
        manifest.totals = each_once(std::mem::take(&mut manifest.totals).into_iter().chain(more));
        manifest.campaign.gains.push(name.clone());
        manifest.sets.push(name);
        manifest.config_hash = manifest.hash()?;
        self.controllers.push(controller);
        Ok(self)
    }

    /// The folder for the result: `out` if it is given, else a folder under `standfast-results` that is new or belongs
    /// to this campaign. Writes nothing. Fails if `out` holds something else.
    pub fn folder(&self, out: Option<&Path>) -> Result<Folder> {
        let manifest = &self.manifest;
        let hash = &manifest.config_hash;
        // The markers of this campaign's parts in a folder whose manifest is lost. The manifest will be written again.
        let markers = |path: &Path| -> Vec<Marker> {
            let markers = if path.join(MANIFEST).exists() {
                Ok(Vec::new())
            } else {
                Folder::markers(path)
            };
            markers
                .unwrap_or_default()
                .into_iter()
                .filter(|marker| marker.config_hash == *hash)
                .collect()
        };
        let own = |path: &Path| match Folder::open(path) {
            Err(_) if !markers(path).is_empty() => Ok(true),
            found => Ok(found?.is_none_or(|found| found.manifest.config_hash == *hash)),
        };
        let path = match out {
            Some(path) => path.to_path_buf(),
            None => {
                let results = Path::new("standfast-results");
                let name = match manifest.campaign.episode.engine {
                    Engine::Rapier => manifest.campaign.name.clone(),
                    other => format!("{}-{}", manifest.campaign.name, other.name()),
                };
                let (plain, hashed) = (
                    results.join(&name),
                    results.join(format!("{name}-{}", &hash[..8])),
                );
                if own(&plain).unwrap_or(false) {
                    plain
                } else {
                    hashed
                }
            }
        };
        if !own(&path)? {
            const MOST: usize = 5;
            let there = Folder::open(&path).ok().flatten();
            let differ = there
                .map(|there| there.manifest.differences(manifest))
                .unwrap_or_default();
            let more = if differ.len() > MOST {
                format!("; and {} more", differ.len() - MOST)
            } else {
                String::new()
            };
            let differ = match &differ[..] {
                [] => "its configuration differs".into(),
                some => some[..some.len().min(MOST)].join("; ") + &more,
            };
            let advice = out.map_or("", |_| ". Give a new folder, or remove this one");
            let problem = format!("holds the result of another campaign: {differ}{advice}");
            return Err(Error::Parts { path, problem });
        }
        // A folder keeps to what it was begun with.
        let begun = match Folder::open(&path).ok().flatten() {
            Some(found) => found.manifest,
            None => {
                let markers = markers(&path);
                let part_trials = markers
                    .iter()
                    .filter_map(|marker| NonZeroU64::new(marker.trials))
                    .max();
                let part_trials = part_trials.unwrap_or(manifest.part_trials);
                let planned_trials = markers.iter().find_map(|marker| marker.planned_trials);
                let planned_trials = planned_trials.unwrap_or(manifest.planned_trials);
                let begun = Manifest {
                    part_trials,
                    planned_trials,
                    ..manifest.clone()
                };
                // A single last part may be a short one, so it does not tell the size of the others.
                if begun.check("").is_ok() {
                    begun
                } else {
                    manifest.clone()
                }
            }
        };
        let Manifest {
            part_trials,
            planned_trials,
            ..
        } = begun;
        Ok(Folder {
            path,
            manifest: Manifest {
                part_trials,
                planned_trials,
                ..manifest.clone()
            },
        })
    }

    /// Prepares all controllers, and warns of dubious ones.
    pub(crate) fn factories(&self) -> Result<Vec<PreparedController>> {
        let period_s = self.manifest.campaign.episode.control_period_s;
        let prepared = self
            .controllers
            .par_iter()
            .map(|settings| settings.prepare(&self.robot, period_s));
        let factories: Vec<PreparedController> = prepared.collect::<Result<_>>()?;
        for PreparedController { name, warning, .. } in &factories {
            warning
                .iter()
                .for_each(|warning| log::warn!("{name}: {warning}"));
        }
        Ok(factories)
    }

    /// Prepares all controllers, and runs an episode without a push with each. Fails if a robot falls in its episode,
    /// because recovery rates of a robot that falls without a push would mean nothing. `untried` leaves the episodes
    /// out.
    pub(crate) fn tried_factories(&self, untried: bool) -> Result<Vec<PreparedController>> {
        let (factories, campaign) = (self.factories()?, &self.manifest.campaign);
        if untried || campaign.synthetic {
            return Ok(factories);
        }
        let lost = |factory: &PreparedController| {
            let alone = UnpushedEpisode::run(
                &self.robot,
                factory,
                &campaign.episode,
                trial::as_designed(campaign),
            )?;
            let falls = || Error::Falls {
                name: factory.name.clone(),
                how: alone.how_lost(&self.robot),
            };
            Ok(alone.is_lost().then(falls))
        };
        Error::all(
            factories
                .par_iter()
                .map(lost)
                .collect::<Result<Vec<_>>>()?
                .into_iter()
                .flatten()
                .collect(),
        )?;
        Ok(factories)
    }

    /// The beginning of the episodes of all controllers, if all trials begin alike.
    pub(crate) fn opening<'a>(
        &'a self,
        factories: &'a [PreparedController],
    ) -> Option<ClosedLoop<'a>> {
        let campaign = &self.manifest.campaign;
        trial::begin_alike(campaign).then(|| {
            let disturbance = trial::disturbance(campaign, 0);
            let push_s = disturbance.pushes[0].start_s;
            ClosedLoop::new(&self.robot, factories, &campaign.episode, disturbance).before(push_s)
        })
    }

    /// Runs the episodes of a trial with some controllers, given by their numbers in ascending order. The episodes
    /// continue `opening`, if there is one. Errors are those of [`ClosedLoop::finish`].
    pub(crate) fn records(
        &self,
        factories: &[PreparedController],
        opening: Option<&ClosedLoop>,
        disturbance: Disturbance,
        sets: &[usize],
    ) -> Result<Vec<Record>> {
        if let Some(shared) =
            opening.and_then(|opening| opening.with(sets, disturbance.pushes.clone()))
        {
            return shared.finish();
        }
        let factories = sets.iter().map(|&set| &factories[set]);
        ClosedLoop::new(
            &self.robot,
            factories,
            &self.manifest.campaign.episode,
            disturbance,
        )
        .finish()
    }

    /// The time that a trial takes with all controllers on one core of this machine (s). It is measured on up to 8
    /// trials, and no new trial begins after half a second.
    pub fn seconds_a_trial(&self) -> Result<f64> {
        const SAMPLE: u64 = 8;
        const LONG_S: f64 = 0.5;
        let (factories, all): (_, Vec<usize>) =
            (self.factories()?, (0..self.manifest.sets.len()).collect());
        let (start, mut trials) = (Instant::now(), 0);
        while trials == 0
            || trials < SAMPLE.min(self.manifest.campaign.trials)
                && start.elapsed().as_secs_f64() < LONG_S
        {
            self.rows(&factories, None, trials, &all)?;
            trials += 1;
        }
        Ok(start.elapsed().as_secs_f64() / trials as f64)
    }

    /// The rows of a trial with some controllers, given by their numbers in ascending order. Errors are those of
    /// [`records`](Self::records).
    pub(super) fn rows(
        &self,
        factories: &[PreparedController],
        opening: Option<&ClosedLoop>,
        trial: u64,
        sets: &[usize],
    ) -> Result<Vec<TrialRow>> {
        let Manifest {
            campaign,
            sets: names,
            ..
        } = &self.manifest;
        let (pushes, variation) = (
            trial::pushes(campaign, trial),
            trial::variation(campaign, trial),
        );
        let no_step_n_s = self.no_step.impulse_n_s(pushes[0].heading_deg);
        let hardness = pushes[0].impulse_n_s / no_step_n_s.unwrap_or(1.0);
        let records = match campaign.synthetic {
            true => sets
                .iter()
                .map(|&set| trial::synthetic(campaign, trial, set, hardness))
                .collect(),
            false => each_caught(sets, |sets| {
                self.records(
                    factories,
                    opening,
                    trial::disturbance(campaign, trial),
                    sets,
                )
            })?,
        };
        let row = |(&set, record): (&usize, Record)| {
            let repeats = self.repeats(factories, trial, set, &record)?;
            Ok(TrialRow {
                repeats,
                ..TrialRow::new(trial, &names[set], &pushes, no_step_n_s, variation, record)
            })
        };
        sets.iter().zip(records).map(row).collect()
    }

    /// Whether a second run of a trial with a controller has the same record. It is None if there was no second run.
    /// There is one only in every [`TRIED_AGAIN`]th trial, and only for controllers that cannot be copied, because
    /// their memory is hidden.
    fn repeats(
        &self,
        factories: &[PreparedController],
        trial: u64,
        set: usize,
        record: &Record,
    ) -> Result<Option<Repeats>> {
        let campaign = &self.manifest.campaign;
        if campaign.synthetic
            || !trial.is_multiple_of(TRIED_AGAIN)
            || factories[set].can_be_copied()
        {
            return Ok(None);
        }
        let again =
            caught(|| self.records(factories, None, trial::disturbance(campaign, trial), &[set]));
        // As text, since NaN is not equal to itself.
        let is_same = match again {
            Ok(again) => format!("{:?}", again?[0]) == format!("{record:?}"),
            Err(_panic) => false,
        };
        Ok(Some(if is_same { Repeats::Yes } else { Repeats::No }))
    }

    /// Writes the manifest and all that is needed to run the campaign again: `campaign.toml` and the inputs.
    pub(super) fn identify(&self, folder: &Folder) -> Result<()> {
        folder.create()?;
        for (name, bytes) in &self.inputs {
            let path = folder.path.join(name);
            write_atomic(&path, bytes)?;
            if bytes.starts_with(b"#!") || bytes.starts_with(b"\x7fELF") {
                make_executable(&path)?;
            }
        }
        if self
            .controllers
            .iter()
            .any(|controller| controller.is_program())
        {
            standfast_controllers::permission::note(&folder.path, &self.inputs);
        }
        folder.write_campaign()
    }
}

/// The records that `run` gives of some controllers. If one of them panics, all are run again, each alone, and the
/// record of the one that panics is `Diverged`, with the panic as its cause. Errors are those of `run`.
pub(super) fn each_caught<T: Copy>(
    controllers: &[T],
    run: impl Fn(&[T]) -> Result<Vec<Record>>,
) -> Result<Vec<Record>> {
    let failed = |panic| Record {
        outcome: Outcome::Diverged,
        fall_cause: Some(panic),
        ..Record::default()
    };
    let alone = |one: &T| {
        caught(|| run(&[*one])).map_or_else(|panic| Ok(failed(panic)), |ran| Ok(ran?.remove(0)))
    };
    caught(|| run(controllers)).unwrap_or_else(|_| controllers.iter().map(alone).collect())
}

/// Lets a copy of a program be started.
fn make_executable(path: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(path, mode).map_err(|source| Error::Write {
            path: path.into(),
            source,
        })?;
    }
    Ok(())
}

/// A pool of `threads` threads; 0 means one for each core.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let remedy = "raise the limit of processes and threads (`ulimit -u`), or take fewer --threads";
    pool.map_err(|e| Error::Machine(format!("the threads cannot be started: {e}; {remedy}")))
}

/// Fails if the name of a controller cannot be the name of a file, or if two controllers have the same name.
fn check_names(campaign: &Campaign, sets: &[String], bases: &[(String, Source)]) -> Result<()> {
    for (i, (name, (base, _))) in sets.iter().zip(bases).enumerate() {
        if base.is_empty()
            || base.starts_with('.')
            || base.contains(|c: char| "/\\:".contains(c) || c.is_control())
        {
            let accepted = "a name without /, \\ and :, not first a `.`";
            return Err(Error::value(
                &campaign.gains[i],
                "name",
                base,
                "not usable as a file name",
                accepted,
            ));
        }
        if sets[..i].contains(name) {
            let problem = "two controllers of this name";
            return Err(Error::value(
                &campaign.gains[i],
                "name",
                name,
                problem,
                "a name of its own for each",
            ));
        }
    }
    Ok(())
}

/// The files that a campaign reads. They are kept, so that it can be run again from its folder.
#[derive(Default)]
struct Inputs {
    /// All files, in the order in which they are hashed.
    listed: Vec<Input>,
    /// The files that are not compiled in, each by its name in the result folder.
    kept: Vec<(String, Vec<u8>)>,
}

impl Inputs {
    /// Takes the files of one input, each given with its extension. Returns the name that the campaign in the
    /// folder has for it: the original one if the input is compiled in, else that of its last file.
    fn take<'a>(
        &mut self,
        original: &str,
        stem: &str,
        files: impl IntoIterator<Item = (Source, &'a str)>,
    ) -> Result<String> {
        let mut name = original.to_string();
        for (source, extension) in files {
            let sha256 = sha256_hex(source.text.as_bytes());
            if source.is_builtin() {
                self.listed.push(Input {
                    file: source.file,
                    sha256,
                });
                continue;
            }
            name = format!("inputs/{stem}.{extension}");
            self.listed.push(Input {
                file: name.clone(),
                sha256,
            });
            if !self.keep(&name, source.text.into_bytes()) {
                let (set, problem) = (
                    stem.trim_start_matches("gains/"),
                    "another file has a controller of this name",
                );
                return Err(Error::value(
                    original,
                    "name",
                    set,
                    problem,
                    "a name of its own for each",
                ));
            }
        }
        Ok(name)
    }

    /// Takes the files that the controller `original` needs, so that they lie beside its own.
    fn take_beside(&mut self, original: &str, files: Vec<(String, Vec<u8>)>) -> Result<()> {
        for (file, bytes) in files {
            let name = format!("inputs/gains/{file}");
            self.listed.push(Input {
                file: name.clone(),
                sha256: sha256_hex(&bytes),
            });
            if !self.keep(&name, bytes) {
                let problem = "another controller needs another file of this name";
                return Err(Error::value(
                    original,
                    "file",
                    file,
                    problem,
                    "a name of its own for each",
                ));
            }
        }
        Ok(())
    }

    /// Keeps a file. Variants of one controller share one file. Returns false if another file has this name.
    fn keep(&mut self, name: &str, bytes: Vec<u8>) -> bool {
        match self.kept.iter().find(|(kept, _)| kept == name) {
            Some((_, kept)) => *kept == bytes,
            None => {
                self.kept.push((name.into(), bytes));
                true
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Overrides;

    /// 30 trials of 0.4 s, with these values set.
    fn short(set: &[&str]) -> Overrides {
        let short = [
            "episode.horizon_s=0.4",
            "episode.judge.standing_time_s=0.1",
            "push.start_s=0.05",
        ];
        let set = short.iter().chain(set).map(|s| s.to_string()).collect();
        Overrides {
            set,
            trials: Some(30),
            gains: vec!["hold".into()],
            ..Default::default()
        }
    }

    pub(crate) fn planned(set: &[&str]) -> PreparedCampaign {
        PreparedCampaign::new(&Campaign::load("smoke", &short(set)).unwrap()).unwrap()
    }

    /// The second controller has no design, so its episode panics.
    #[test]
    fn a_panic_is_the_outcome_of_the_set_that_caused_it() {
        let gains = ["hold", "fixed"].map(String::from).to_vec();
        let plan = PreparedCampaign::new(
            &Campaign::load(
                "smoke",
                &Overrides {
                    gains,
                    ..short(&[])
                },
            )
            .unwrap(),
        )
        .unwrap();
        let factories = plan.factories().unwrap();
        let rows = plan.rows(&factories[..1], None, 3, &[0, 1]).unwrap();
        assert_eq!(rows[0], plan.rows(&factories, None, 3, &[0]).unwrap()[0]);
        assert_eq!(
            (&rows[1].set[..], rows[1].record.outcome),
            ("fixed", Outcome::Diverged)
        );
        let cause = rows[1].record.fall_cause.as_ref().unwrap();
        assert!(cause.starts_with("panic: index out of bounds"), "{cause}");
        assert_eq!(rows[1].pushes(), rows[0].pushes());
    }

    #[test]
    fn the_hash_is_of_what_changes_a_result() {
        let hash = |plan: &PreparedCampaign| plan.manifest.config_hash.clone();
        assert_eq!(hash(&planned(&[])), hash(&planned(&[])));
        for change in [
            "seed=5",
            "push.height_m=0.01",
            "sensors.bias_scale=0.4",
            "name=other",
            "episode.horizon_s=2",
        ] {
            assert_ne!(hash(&planned(&[change])), hash(&planned(&[])), "{change}");
        }
    }

    #[test]
    fn files_with_sets_of_one_name_are_not_mixed_up_by_their_variants() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
        for (name, margin) in [("a.toml", 0.001), ("b.toml", 0.002)] {
            let text = format!(
                "name = 'mine'\nzmp_margin = {margin}\n[[gains]]\nname = 'a'\nx = [1, 1, 5]\ny = [1, 1, 5]\n"
            );
            std::fs::write(path(name), text).unwrap();
        }
        let plan = |second: &str| {
            let gains = vec![
                path("a.toml") + ":zmp_margin=0.2",
                path(second) + ":zmp_margin=0.4",
            ];
            PreparedCampaign::new(
                &Campaign::load(
                    "smoke",
                    &Overrides {
                        gains,
                        ..Default::default()
                    },
                )
                .unwrap(),
            )
        };
        assert_eq!(plan("a.toml").unwrap().inputs.len(), 1);
        let message = plan("b.toml").err().unwrap().to_string();
        assert!(
            message.contains("b.toml: name = mine: another file"),
            "{message}"
        );
    }
}
