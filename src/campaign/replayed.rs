//! A trial of a finished campaign, to be run again and looked at: it follows from the campaign and its number alone.

use crate::campaign::{Campaign, Folder, Overrides, Row, trial};
use crate::control::Design;
use crate::episode::{Disturbance, EpisodeConfig, Outcome, Record};
use crate::error::{Error, Result};
use crate::lipm::gains::GainSet;
use crate::robot::Robot;
use std::path::Path;

/// A trial of one gain set, ready to run.
pub struct Replayed {
    pub campaign: Campaign,
    pub trial: u64,
    /// Name of the gain set in the results.
    pub set: String,
    pub robot: Robot,
    pub design: Design,
    /// As the campaign found it; None where it has not come so far, or its part is damaged.
    pub row: Option<Row>,
}

impl Replayed {
    /// Opens trial number `trial` of the result in `folder`. Without a set it is the first that did not recover, else the
    /// first of all. Errors: no such trial or set, no campaign in that folder, or an input of it that is gone.
    pub fn open(folder: &Path, trial: u64, set: Option<&str>) -> Result<Self> {
        let found = Folder::existing(folder)?;
        let (campaign, sets) = (&found.manifest.campaign, &found.manifest.sets);
        if trial >= campaign.trials {
            let accepted = format!("0 to {}", campaign.trials.saturating_sub(1));
            return Err(Error::value("arguments", "--trial", trial, "the campaign has no such trial", accepted));
        }
        if let Some(name) = set.filter(|name| !sets.iter().any(|set| set == name)) {
            return Err(Error::Unknown { what: "gain set", name: name.into(), accepted: sets.join(", ") });
        }
        let block = (0..found.blocks()).find(|&block| found.range(block).1 > trial);
        let mut rows = block.and_then(|block| found.read(block).ok()).unwrap_or_default();
        rows.retain(|row| row.trial == trial);
        let lost = sets.iter().find(|set| rows.iter().any(|r| r.set == **set && r.outcome != Outcome::Recovered));
        let set = set.unwrap_or_else(|| lost.unwrap_or(&sets[0])).to_string();
        let file = folder.join("campaign.toml");
        let campaign = Campaign::load(&file.display().to_string(), &Overrides::default())?;
        let robot = Robot::load(&campaign.robot)?;
        let gains = GainSet::load(&campaign.gains_named(&set))?;
        let design = Design::new(&robot, &gains, campaign.episode.control_period_s)?;
        let row = rows.into_iter().find(|row| row.set == set);
        Ok(Self { campaign, trial, set, robot, design, row })
    }

    /// How long it lasts, and by what it is judged.
    pub fn config(&self) -> &EpisodeConfig {
        &self.campaign.episode
    }

    /// What disturbs the robot; every call gives the same.
    pub fn disturbance(&self) -> Disturbance {
        trial::disturbance(&self.campaign, self.trial)
    }

    /// What to tell of a record of this trial that is not what the campaign found; None if it is the same.
    pub fn difference(&self, record: &Record) -> Option<String> {
        let row = self.row.as_ref()?;
        let same = row.outcome == record.outcome && row.end_s.to_bits() == record.end_s.to_bits();
        let told = |outcome: Outcome, end_s: f64| format!("{outcome:?} at {end_s} s").to_lowercase();
        let [now, then] = [told(record.outcome, record.end_s), told(row.outcome, row.end_s)];
        (!same).then(|| format!("trial {} of {}: {now}, but {then} in the result: it was made by another build of standfast, or its inputs have changed", self.trial, self.set))
    }
}
