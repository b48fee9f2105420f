//! A trial of a finished campaign, to be run again and looked at. The trial follows from the campaign and its index
//! alone.

use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::store::folder::Folder;
use crate::store::row::TrialRow;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_sim::Engine;
use standfast_sim::episode::{Disturbance, EpisodeConfig, Record};
use std::path::Path;

/// A trial with one controller, ready to run.
pub struct StoredTrial {
    pub campaign: Campaign,
    pub trial: u64,
    /// Name of the controller in the results.
    pub set: String,
    /// Names of all controllers in the results.
    pub sets: Vec<String>,
    pub robot: Robot,
    pub factory: PreparedController,
    /// The stored row; None if the campaign has not yet run this trial with this controller, or if the part is damaged.
    pub row: Option<TrialRow>,
}

impl StoredTrial {
    /// Opens trial number `trial` of the result in `folder`. If no controller is given, it takes the first that did not
    /// recover, or else the first that has the trial. It fails if there is no such trial, controller or campaign, or if
    /// an input is gone.
    pub fn open(folder: &Path, trial: u64, set: Option<&str>) -> Result<Self> {
        let result = Folder::existing(folder)?;
        let (campaign, sets) = (&result.manifest.campaign, &result.manifest.sets);
        campaign.check_trial(trial)?;
        for warning in result.manifest.told_not_kept() {
            log::warn!("{warning}");
        }
        if let Some(name) = set.filter(|name| !sets.iter().any(|set| set == name)) {
            return Err(Error::Unknown {
                what: "controller",
                name: name.into(),
                accepted: sets.join(", "),
            });
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
        let lost = sets
            .iter()
            .find(|set| rows.iter().any(|r| r.set == **set && !r.has_recovered()));
        let first = rows.first().map_or(&sets[0], |row| &row.set);
        let set = set.unwrap_or_else(|| lost.unwrap_or(first)).to_string();
        let campaign = result.campaign();
        let robot = standfast_robots::load(&campaign.robot)?;
        let settings = standfast_controllers::load(&campaign.gains_named(&set))?;
        let factory = settings.prepare(&robot, campaign.episode.control_period_s)?;
        let row = rows.into_iter().find(|row| row.set == set);
        Ok(Self {
            campaign,
            trial,
            set,
            sets: result.manifest.sets,
            robot,
            factory,
            row,
        })
    }

    pub fn engine(&self) -> Engine {
        self.campaign.episode.engine
    }

    /// Settings of the episode in `engine`, which may be another engine than that of the result. Fails if this program
    /// lacks the engine, or if the engine does not take the robot.
    pub fn config_in(&self, engine: Engine) -> Result<EpisodeConfig> {
        engine.check(&self.robot)?;
        Ok(EpisodeConfig {
            engine,
            ..self.campaign.episode
        })
    }

    /// The disturbance, which is the same at every call.
    pub fn disturbance(&self) -> Disturbance {
        trial::disturbance(&self.campaign, self.trial)
    }

    /// Describes how a record of this trial in the engine of the result differs from the stored row. It is None if the
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
        let (trial, set) = (self.trial, &self.set);
        Some(format!(
            "trial {trial} of {set} is not as it was: {now}, but {then} in the result. {why}"
        ))
    }
}
