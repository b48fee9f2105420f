//! What a campaign runs on: its inputs, read and checked, and its controllers. `inputs` keeps the inputs, `folder`
//! chooses the folder for the result, `unpushed` tries the controllers without a push, `trials` runs the trials one by
//! one, and `pool` has the threads for them.

mod folder;
mod inputs;
mod pool;
mod trials;
mod unpushed;

pub(crate) use folder::usual_folder;
pub(crate) use pool::{Pool, pool};
pub(crate) use trials::each_caught;

use crate::ask::bounds::check_steps;
use crate::ask::entrant::Entrant;
use crate::ask::spec::Campaign;
use crate::ask::standing_bound::StandingBound;
use crate::store::manifest::{Input, Manifest, each_once, part_trials};
use crate::store::robot_values::RobotValues;
use inputs::Inputs;
use rayon::prelude::*;
use standfast_controllers::ControllerSpec;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_files::assets::{self, InputKind};
use standfast_files::sha256_hex;
use standfast_robots::urdf::Files;
use standfast_sim::episode::EpisodeConfig;
use standfast_sim::{Engine, pendulum};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// A campaign whose inputs are read and checked. The controllers are designed later.
pub struct PreparedCampaign {
    pub manifest: Manifest,
    pub(crate) robot: Robot,
    no_step: StandingBound,
    /// The controllers in the order of the campaign, each with its engine.
    entrants: Vec<(Box<dyn ControllerSpec>, Engine)>,
    /// The inputs that are not compiled in, each by its name in the result folder.
    inputs: Vec<(String, Vec<u8>)>,
    /// The controllers that have been tried without a push.
    tried: OnceLock<Vec<PreparedController>>,
}

impl PreparedCampaign {
    /// Reads the robot and the controllers. It fails if any of them is missing or wrong, or if two controllers have the
    /// same name.
    pub fn new(campaign: &Campaign) -> Result<PreparedCampaign> {
        let files = Files::open(&campaign.robot)?.with_motors(campaign.motors.as_deref())?;
        Self::with(campaign, files)
    }

    /// As [`new`](Self::new), with the files of the campaign's robot, which are read already.
    pub fn with(campaign: &Campaign, files: Files) -> Result<PreparedCampaign> {
        let mut robot = files.load()?;
        robot.pushed = campaign.push.on(&robot, &campaign.name)?;
        for engine in campaign.different_engines() {
            engine.check(&robot)?;
        }
        check_steps(&campaign.name, &campaign.episode, &robot)?;
        let mut entries = Vec::new();
        let mut entrants = Vec::new();
        let (mut controllers, mut bases) = (Vec::new(), Vec::new());
        // The file of each controller, and the files that it needs beside it.
        let mut sources = Vec::new();
        let (mut not_kept, mut trained_otherwise) = (BTreeMap::new(), BTreeMap::new());
        for (gains, engine) in campaign.controllers.iter().zip(campaign.engines()) {
            let entrant = Entrant::split(gains);
            let entry = entrant.controller_name();
            let source = assets::open(InputKind::Controller, entry.base)?;
            let base = standfast_controllers::read(&source)?;
            sources.push((source, base.files()?));
            bases.push(base.name().to_string());
            let lacks = base.not_kept();
            if !lacks.is_empty() {
                not_kept.insert(base.name().to_string(), lacks);
            }
            if let Some(difference) = base.trained_otherwise(&robot) {
                trained_otherwise.insert(base.name().to_string(), difference);
            }
            let controller = entry.of(base)?;
            controllers.push(entrant.of(controller.name()));
            entrants.push((controller, engine));
            entries.push(entrant);
        }
        check_names(campaign, &controllers, &bases)?;
        let mut inputs = Inputs::default();
        let mut resolved = campaign.clone();
        // The robot comes first among the inputs, with settings that may have been inferred, and with its meshes.
        let extension = files.extension();
        let mut robot_files = vec![(files.settings, "toml")];
        if let Some(meshes) = files.meshes {
            robot_files.push((meshes, "meshes"));
        }
        robot_files.push((files.urdf, extension));
        resolved.robot = inputs.take(&campaign.robot, "robot", robot_files)?;
        resolved.motors = None;
        let robot_hashes: String = inputs
            .listed
            .iter()
            .map(|input| &input.sha256[..])
            .collect();
        let robot_sha256 = sha256_hex(robot_hashes.as_bytes());
        for (i, (source, beside)) in sources.into_iter().enumerate() {
            let (entry, stem) = (
                entries[i].controller_name(),
                format!("controllers/{}", bases[i]),
            );
            let file = inputs.take(entry.base, &stem, vec![(source, "toml")])?;
            resolved.controllers[i] = entries[i].of(&entry.with_base(&file));
            inputs.take_beside(entry.base, beside)?;
        }
        let totals = each_once(
            entrants
                .iter()
                .flat_map(|(controller, _)| controller.totals())
                .chain(
                    campaign
                        .push
                        .pendulum
                        .iter()
                        .flat_map(|_| &pendulum::TOTALS),
                )
                .map(|total| total.to_string()),
        );
        let mut manifest = Manifest {
            standfast: env!("CARGO_PKG_VERSION").into(),
            config_hash: String::new(),
            robot_sha256,
            engines: entrants
                .iter()
                .map(|(_, engine)| engine.with_version())
                .collect(),
            robot: None,
            part_trials: part_trials(&resolved),
            controllers,
            totals,
            inputs: inputs.listed,
            not_kept,
            trained_otherwise,
            campaign: resolved,
        };
        manifest.config_hash = manifest.hash()?;
        Ok(PreparedCampaign {
            manifest,
            no_step: StandingBound::new(&robot),
            robot,
            entrants,
            inputs: inputs.kept,
            tried: OnceLock::new(),
        })
    }

    /// Number of episodes that have to be open at once for a controller that answers to many of them together; 0 if no
    /// controller does.
    pub(crate) fn open_episodes(&self) -> usize {
        let controllers = self.entrants.iter().map(|(controller, _)| controller);
        controllers
            .map(|controller| controller.open_episodes())
            .max()
            .unwrap_or(0)
    }

    /// The settings of the episodes of an entrant, given by its number.
    pub(crate) fn episode(&self, entrant: usize) -> EpisodeConfig {
        let engine = self.entrants[entrant].1;
        EpisodeConfig {
            engine,
            ..self.manifest.campaign.episode
        }
    }

    /// Adds a controller that is no file but a part of the calling program. Its name and its tree are inputs of the
    /// result. Fails if another controller has this name.
    pub fn and(mut self, controller: Box<dyn ControllerSpec>) -> Result<PreparedCampaign> {
        let name = controller.name().to_string();
        let manifest = &mut self.manifest;
        if manifest.controllers.contains(&name) {
            return Err(Error::value(
                "the program",
                "name",
                name,
                "two controllers of this name",
                "a name of its own for each",
            ));
        }
        let sha256 = sha256_hex(controller.tree().to_string().as_bytes());
        manifest.inputs.push(Input {
            file: format!("builtin:{name}"),
            sha256,
        });
        let more = controller.totals().iter().map(|total| total.to_string());
        manifest.totals = each_once(std::mem::take(&mut manifest.totals).into_iter().chain(more));
        manifest.campaign.controllers.push(name.clone());
        manifest.controllers.push(name);
        let engine = manifest.campaign.episode.engine;
        manifest.engines.push(engine.with_version());
        manifest.config_hash = manifest.hash()?;
        self.entrants.push((controller, engine));
        Ok(self)
    }

    /// The robot by its values.
    pub fn robot_values(&self) -> RobotValues {
        RobotValues::of(&self.robot)
    }

    /// Prepares all controllers, which get the names of their entrants, and warns of dubious ones.
    pub(crate) fn factories(&self) -> Result<Vec<PreparedController>> {
        let period_s = self.manifest.campaign.episode.control_period_s;
        let factories: Vec<PreparedController> = self
            .entrants
            .par_iter()
            .zip(&self.manifest.controllers)
            .map(|((settings, _), name)| {
                let mut prepared = settings.prepare(&self.robot, period_s)?;
                prepared.name.clone_from(name);
                Ok(prepared)
            })
            .collect::<Result<_>>()?;
        for PreparedController { name, warning, .. } in &factories {
            if let Some(warning) = warning {
                log::warn!("{name}: {warning}");
            }
        }
        Ok(factories)
    }
}

/// Fails if the name of a controller cannot be the name of a file, or if two controllers have the same name.
fn check_names(campaign: &Campaign, controllers: &[String], bases: &[String]) -> Result<()> {
    for (i, (name, base)) in controllers.iter().zip(bases).enumerate() {
        if base.is_empty()
            || base.starts_with('.')
            || base.contains(|c: char| "/\\:".contains(c) || c.is_control())
        {
            return Err(Error::value(
                &campaign.controllers[i],
                "name",
                base,
                "not usable as a file name",
                "a name without /, \\ and :, not first a `.`",
            ));
        }
        if controllers[..i].contains(name) {
            return Err(Error::value(
                &campaign.controllers[i],
                "name",
                name,
                "two controllers of this name",
                "a name of its own for each",
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Overrides;
    use standfast_sim::episode::Outcome;

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
            controllers: vec!["hold".into()],
            ..Default::default()
        }
    }

    pub(crate) fn planned(set: &[&str]) -> PreparedCampaign {
        PreparedCampaign::new(&Campaign::load("smoke", &short(set)).unwrap()).unwrap()
    }

    /// The second controller has no design, so its episode panics.
    #[test]
    fn a_panic_is_the_outcome_of_the_controller_that_caused_it() {
        let gains = ["hold", "fixed"].map(String::from).to_vec();
        let plan = PreparedCampaign::new(
            &Campaign::load(
                "smoke",
                &Overrides {
                    controllers: gains,
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
            (&rows[1].controller[..], rows[1].record.outcome),
            ("fixed", Outcome::Diverged)
        );
        let cause = rows[1].record.fall_cause.as_ref().unwrap();
        assert!(cause.starts_with("panic: index out of bounds"), "{cause}");
        assert_eq!(
            (rows[1].push, rows[1].second),
            (rows[0].push, rows[0].second)
        );
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
    fn files_with_controllers_of_one_name_are_not_mixed_up_by_their_variants() {
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
                        controllers: gains,
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
