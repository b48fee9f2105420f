//! The world of the window: robot, controllers, and the disturbances other than those by the user.

use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_scene::Stage;
use standfast_sim::Ground;
use standfast_sim::episode::{Disturbance, EpisodeConfig};
use standfast_study::{Campaign, ask::trial};

/// What the window simulates.
pub struct LiveSetup {
    pub robot: Robot,
    /// The robot as varied by the trial.
    pub simulated: Robot,
    /// The controllers, at least one, among which the user chooses that of the solid robot.
    pub factories: Vec<PreparedController>,
    /// The settings of one or two entrants: the first is the first controller and solid, and the second is the second
    /// controller and a ghost.
    pub configs: Vec<EpisodeConfig>,
    /// The campaign whose sensor noise is used; None for ideal sensors.
    campaign: Option<Campaign>,
    /// Its trial whose robot, ground, noise and pushes are used.
    trial: Option<u64>,
}

impl LiveSetup {
    /// The fields mean what their names say; `trial` is one of `campaign`.
    pub fn new(
        robot: Robot,
        factories: Vec<PreparedController>,
        configs: Vec<EpisodeConfig>,
        campaign: Option<Campaign>,
        trial: Option<u64>,
    ) -> Self {
        let mut world = Self {
            simulated: robot.clone(),
            robot,
            factories,
            configs,
            campaign,
            trial,
        };
        world.simulated = world.disturbance().variation.robot(&world.robot);
        world
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

    /// Robot, ground and pendulum as they are drawn.
    pub fn stage(&self) -> Stage<'_> {
        let Disturbance {
            variation, pushes, ..
        } = self.disturbance();
        let ground = Ground::new(&self.robot, &variation);
        Stage::new(&self.simulated, ground).with_pendulum(&pushes)
    }
}
