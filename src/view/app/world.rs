//! What is simulated live: robot, gain sets, and what disturbs the robot beside the person at the window.

use crate::assets::DEFAULT_ROBOT;
use crate::campaign::{Campaign, Overrides, ask::trial};
use crate::control::Design;
use crate::episode::{Disturbance, EpisodeConfig};
use crate::error::{Error, Result};
use crate::lipm::gains::GainSet;
use crate::robot::Robot;
use crate::sim::Ground;
use crate::view::Options;

/// Of a live view, if none are named; the first acts.
const DEFAULT_GAINS: [&str; 4] = ["catch", "paper", "switching", "hold"];

pub struct World {
    pub robot: Robot,
    /// The robot as the trial varies it.
    pub simulated: Robot,
    /// Never empty; the first acts at the start.
    pub designs: Vec<Design>,
    pub config: EpisodeConfig,
    campaign: Option<Campaign>,
    trial: Option<u64>,
}

impl World {
    /// Errors: no such robot, gain set, campaign or trial.
    pub fn new(args: &Options) -> Result<Self> {
        let campaign = match &args.campaign {
            Some(name) => Some(Campaign::load(name, &Overrides::default())?),
            None => None,
        };
        if let Some(index) = args.trial {
            let Some(campaign) = &campaign else {
                let accepted = "a trial of the result in a folder, or of --campaign";
                return Err(Error::value("command line", "--trial", index, "neither is given", accepted));
            };
            campaign.check_trial(index)?;
        }
        let named = args.robot.as_ref().or(campaign.as_ref().map(|campaign| &campaign.robot));
        let robot = Robot::load(named.map_or(DEFAULT_ROBOT, String::as_str))?;
        let config = campaign.as_ref().map_or_else(EpisodeConfig::default, |campaign| campaign.episode);
        let defaults = DEFAULT_GAINS.map(String::from);
        let names = if args.gains.is_empty() { &defaults[..] } else { &args.gains };
        let design = |name: &String| {
            let entry = campaign.as_ref().map_or_else(|| name.clone(), |campaign| campaign.gains_named(name));
            let design = Design::new(&robot, &GainSet::load(&entry)?, config.control_period_s)?;
            design.warning.iter().for_each(|warning| log::warn!("{warning}"));
            Ok(design)
        };
        let designs = names.iter().map(design).collect::<Result<Vec<_>>>()?;
        let mut world = Self { simulated: robot.clone(), robot, designs, config, campaign, trial: args.trial };
        world.simulated = world.disturbance().variation.robot(&world.robot);
        Ok(world)
    }

    /// What disturbs the robot from the start on; every call gives the same.
    pub fn disturbance(&self) -> Disturbance {
        match (&self.campaign, self.trial) {
            (Some(campaign), Some(index)) => trial::disturbance(campaign, index),
            (Some(campaign), None) => {
                Disturbance { sensor_errors: trial::sensor_errors(campaign, 0), ..Disturbance::default() }
            }
            _ => Disturbance::default(),
        }
    }

    pub fn ground(&self) -> Ground {
        Ground::new(&self.robot, &self.disturbance().variation)
    }
}
