//! A trial of a finished campaign, to be run again and looked at. The trial follows from the campaign and its index
//! alone.

use crate::ask::entrant::Entrant;
use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::store::folder::Folder;
use crate::store::row::TrialRow;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{Disturbance, EpisodeConfig, EpisodeRun, Record};
use std::path::Path;

/// A trial with one controller, ready to run.
pub struct StoredTrial {
    pub campaign: Campaign,
    pub trial: u64,
    /// Name of the controller in the results.
    pub controller: String,
    /// Names of all controllers in the results.
    pub controllers: Vec<String>,
    pub robot: Robot,
    pub factory: PreparedController,
    /// Settings of the episode, with the engine of the entrant.
    pub config: EpisodeConfig,
    /// The stored row; None if the campaign has not yet run this trial with this controller, or if the part is damaged.
    pub row: Option<TrialRow>,
}

impl StoredTrial {
    /// Opens trial number `trial` of the result in `folder`. A controller of the result may be given in any engine,
    /// such as `catch@mujoco`. If none is given, it takes the first that did not recover, or else the first that has the
    /// trial. It fails if there is no such trial, controller or campaign, if an
    /// input is gone, or if this program lacks the engine.
    pub fn open(folder: &Path, trial: u64, controller: Option<&str>) -> Result<Self> {
        let result = Folder::existing(folder)?;
        result.refuse_packed("replayed")?;
        let (campaign, controllers) = (&result.manifest.campaign, &result.manifest.controllers);
        campaign.check_trial(trial)?;
        for warning in result.manifest.warnings() {
            log::warn!("{warning}");
        }
        let block = (0..result.blocks()).find(|&block| result.range(block).1 > trial);
        let mut rows = match block.map(|block| result.part(block)) {
            // A part that is not there yet has no row. A part that is there must be right.
            Some(part) => part.rows().or_else(|e| {
                if part.holds().contains(&true) {
                    Err(e)
                } else {
                    Ok(Vec::new())
                }
            })?,
            None => Vec::new(),
        };
        rows.retain(|row| row.trial == trial);
        let lost = controllers.iter().find(|controller| {
            rows.iter()
                .any(|r| r.controller == **controller && !r.has_recovered())
        });
        let first = rows.first().map_or(&controllers[0], |row| &row.controller);
        let controller = controller
            .unwrap_or_else(|| lost.unwrap_or(first))
            .to_string();
        let asked = Entrant::split(&controller);
        let place = controllers.iter().position(|name| *name == controller);
        let of_controller = || {
            let mut entrants = controllers.iter().map(|name| Entrant::split(name));
            entrants.position(|entrant| entrant.controller == asked.controller)
        };
        let Some(entrant) = place.or_else(|| asked.engine.and_then(|_| of_controller())) else {
            return Err(Error::Unknown {
                what: "controller",
                name: controller,
                accepted: controllers.join(", "),
            });
        };
        let campaign = result.campaign();
        let engine = asked.engine.unwrap_or(campaign.engines()[entrant]);
        let config = EpisodeConfig {
            engine,
            ..campaign.episode
        };
        let mut robot = standfast_robots::load(&campaign.robot)?;
        robot.pushed = campaign.push.on(&robot, "campaign.toml")?;
        engine.check(&robot)?;
        let settings =
            standfast_controllers::load(Entrant::split(&campaign.controllers[entrant]).controller)?;
        let mut factory = settings.prepare(&robot, config.control_period_s)?;
        factory.name.clone_from(&controller);
        let row = rows.into_iter().find(|row| row.controller == controller);
        Ok(Self {
            campaign,
            trial,
            controller,
            controllers: result.manifest.controllers,
            robot,
            factory,
            config,
            row,
        })
    }

    /// Robot, controller and settings of the episode.
    pub fn episode(&self) -> EpisodeRun<'_> {
        EpisodeRun {
            robot: &self.robot,
            factory: &self.factory,
            config: &self.config,
        }
    }

    /// The disturbance, which is the same at every call.
    pub fn disturbance(&self) -> Disturbance {
        trial::disturbance(&self.campaign, self.trial)
    }

    /// Describes how a record of this trial differs from the stored row. It is None if the
    /// two agree, or if there is no row.
    pub fn difference(&self, record: &Record) -> Option<String> {
        let row = self.row.as_ref()?;
        let bits = |time_s: Option<f64>| time_s.map(f64::to_bits);
        if (row.record.outcome, row.record.end_s.to_bits())
            == (record.outcome, record.end_s.to_bits())
            && bits(record.fell_at_s) == bits(row.record.fell_at_s)
            && bits(record.settled_at_s) == bits(row.record.settled_at_s)
        {
            return None;
        }
        let [now, then] = [record, &row.record]
            .map(|record| format!("{} at {:.3} s", record.outcome.name(), record.end_s));
        let why = match self.factory.can_be_copied() {
            true => "The result was made by another build of standfast, or its inputs have changed",
            false => {
                "The controller does not repeat itself, its inputs have changed, or the result was made by another build \
                 of standfast"
            }
        };
        let (trial, controller) = (self.trial, &self.controller);
        Some(format!(
            "trial {trial} of {controller} is not as it was: {now}, but {then} in the result. {why}"
        ))
    }
}
