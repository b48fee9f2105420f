//! The world of the window: robot, controllers, and the disturbances other than those by the user.

use crate::Options;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_core::socket::PreparedController;
use standfast_files::assets::DEFAULT_ROBOT;
use standfast_sim::Ground;
use standfast_sim::episode::{Disturbance, EpisodeConfig};
use standfast_study::{Campaign, Overrides, ask::trial, check_steps};

/// Controllers if none are named. The first acts at the start.
const DEFAULT_GAINS: [&str; 4] = ["catch", "paper", "switching", "hold"];

/// Robot, controllers and settings.
pub struct LiveSetup {
    pub robot: Robot,
    /// The robot as varied by the trial.
    pub simulated: Robot,
    /// The controllers, at least one. The first acts at the start.
    pub factories: Vec<PreparedController>,
    pub config: EpisodeConfig,
    /// The settings with the engine of a ghost.
    pub ghost_config: Option<EpisodeConfig>,
    campaign: Option<Campaign>,
    trial: Option<u64>,
}

impl LiveSetup {
    /// Loads all inputs that the options name. Fails if a robot, controller, campaign or trial does not exist or is not
    /// accepted, or if an engine is missing or does not take the robot.
    pub fn new(args: &Options) -> Result<Self> {
        let campaign = match &args.campaign {
            Some(name) => Some(Campaign::load(
                name,
                &Overrides {
                    robot: args.robot.clone(),
                    ..Overrides::default()
                },
            )?),
            None => None,
        };
        if let Some(index) = args.trial {
            let Some(campaign) = &campaign else {
                let accepted =
                    "a trial of --campaign; `standfast replay DIR --trial I` shows one of a result";
                return Err(Error::option(
                    "--trial",
                    index,
                    "no campaign is given",
                    accepted,
                ));
            };
            campaign.check_trial(index)?;
        }
        let named = args
            .robot
            .as_ref()
            .or(campaign.as_ref().map(|campaign| &campaign.robot));
        let robot = standfast_robots::load(named.map_or(DEFAULT_ROBOT, String::as_str))?;
        let mut config = campaign.as_ref().map_or_else(
            || EpisodeConfig::of(&Units::of(&robot)),
            |campaign| campaign.episode,
        );
        config.engine = args.engines.first().copied().unwrap_or(config.engine);
        let ghost_config = args
            .engines
            .get(1)
            .map(|&engine| EpisodeConfig { engine, ..config });
        for config in std::iter::once(&config).chain(&ghost_config) {
            config.engine.check(&robot)?;
            check_steps("command line", config, &robot)?;
        }
        let defaults = DEFAULT_GAINS.map(String::from);
        let names = if args.gains.is_empty() {
            &defaults[..]
        } else {
            &args.gains
        };
        let mut factories = Vec::new();
        for name in names {
            let entry = campaign
                .as_ref()
                .map_or_else(|| name.clone(), |campaign| campaign.gains_named(name));
            let factory =
                standfast_controllers::load(&entry)?.prepare(&robot, config.control_period_s)?;
            if let Some(warning) = &factory.warning {
                log::warn!("{warning}");
            }
            factories.push(factory);
        }
        let mut world = Self {
            simulated: robot.clone(),
            robot,
            factories,
            config,
            ghost_config,
            campaign,
            trial: args.trial,
        };
        world.simulated = world.disturbance().variation.robot(&world.robot);
        Ok(world)
    }

    /// The disturbances from the start on, the same at every call.
    pub fn disturbance(&self) -> Disturbance {
        match (&self.campaign, self.trial) {
            (Some(campaign), Some(index)) => trial::disturbance(campaign, index),
            (Some(campaign), None) => Disturbance {
                sensor_errors: trial::sensor_errors(campaign, 0),
                ..Disturbance::default()
            },
            _ => Disturbance::default(),
        }
    }

    pub fn ground(&self) -> Ground {
        Ground::new(&self.robot, &self.disturbance().variation)
    }
}
