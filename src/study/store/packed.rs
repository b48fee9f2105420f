//! Packed results, as baselines to give away: the rows of all trials in few files, and the values of the robot. They have
//! no file of robot and controllers, so nobody can run or replay their trials.

use crate::store::folder::Folder;
use crate::store::manifest::MOST_PART_TRIALS;
use crate::store::robot_values::RobotValues;
use crate::store::row::TrialRow;
use standfast_core::error::{Error, Result};
use standfast_files::assets::{self, Source};
use standfast_robots::urdf::Files;
use std::num::NonZeroU64;
use std::path::Path;

impl Folder {
    /// Whether the result is packed.
    pub fn is_packed(&self) -> bool {
        self.manifest.robot.is_some()
    }

    /// Fails if the result is packed. `what` cannot be done with it.
    pub fn refuse_packed(&self, what: &str) -> Result<()> {
        match self.is_packed() {
            true => Err(Error::Parts {
                path: self.name().into(),
                problem: format!(
                    "is packed, without files of robot and controllers: it cannot be {what}"
                ),
            }),
            false => Ok(()),
        }
    }

    /// The robot of the trials by its values, from the files in the folder or, if the result is packed, as they were
    /// then. It fails if they cannot be read.
    pub fn robot_values(&self) -> Result<RobotValues> {
        match &self.manifest.robot {
            Some(values) => Ok(values.clone()),
            None => Ok(RobotValues::of(
                &Files::open(&self.campaign().robot)?.robot()?,
            )),
        }
    }

    /// The campaign as a file that asks for the same trials. It names neither robot nor controllers, no gate, and no end
    /// before its last trial.
    pub fn trials_asked(&self) -> Result<Source> {
        let mut campaign = self.manifest.campaign.clone();
        campaign.trials = self.trials();
        let mut asked: toml::Table = assets::parse_toml(&Source {
            file: self.name(),
            text: campaign.to_toml()?,
        })?;
        for key in ["robot", "controllers", "gates", "stopping"] {
            asked.remove(key);
        }
        Ok(Source {
            file: format!("builtin:{}", self.name()),
            text: asked.to_string(),
        })
    }

    /// Packs a finished result. It fails if the result is not complete, or if `to` is not a new or empty folder.
    pub fn pack(&self, to: &Path) -> Result<Folder> {
        if Folder::open(to).map_or(true, |there| there.is_some()) {
            return Err(Error::Parts {
                path: to.into(),
                problem: "a packed result goes to a new or an empty folder".into(),
            });
        }
        let mut manifest = self.manifest.clone();
        manifest.robot = Some(self.robot_values()?);
        if !manifest.campaign.stopping.until_resolved {
            let part_trials = manifest.campaign.trials.min(MOST_PART_TRIALS);
            manifest.part_trials = NonZeroU64::new(part_trials).unwrap_or(NonZeroU64::MIN);
        }
        let packed = Folder {
            path: to.into(),
            manifest,
            unpacked: None,
        };
        let parts = self.parts()?;
        let mut waiting: Vec<TrialRow> = Vec::new();
        let mut block = 0;
        for part in parts {
            for row in part? {
                if row.trial == packed.range(block).1 {
                    packed.part(block).write(&std::mem::take(&mut waiting))?;
                    block += 1;
                }
                waiting.push(row);
            }
        }
        packed.part(block).write(&waiting)?;
        if let Some(controller_trials) = self.controller_trials().filter(|_| self.has_stopped()) {
            packed.stop_at(&controller_trials)?;
        }
        packed.create()?;
        Ok(packed)
    }
}
