//! A pushed robot, recorded tick by tick. Its readings are played back to a controller, and its commands to a plant: so
//! the controller and the plant each go through the states of the episode, while the time of the other is not measured.

use standfast::core::control::{CpiController, Design};
use standfast::core::robot::{Robot, Units};
use standfast::core::socket::{Command, Controller, Sensed};
use standfast::sim::episode::EpisodeConfig;
use standfast::sim::plant::Clock;
use standfast::sim::{Engine, Ground, Plant, Push};

/// Part of the episode in which a tick lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Before the push.
    Standing,
    /// From the push on, with no foot being moved: the gain sets that have several gains switch between them.
    Switching,
    /// A foot is being moved.
    Swing,
}

impl Phase {
    pub fn name(self) -> &'static str {
        match self {
            Self::Standing => "standing",
            Self::Switching => "switching",
            Self::Swing => "swing",
        }
    }
}

pub struct Tick {
    pub phase: Phase,
    pub sensed: Sensed,
    pub command: Command,
}

pub struct Played {
    pub robot: Robot,
    pub design: Design,
    pub clock: Clock,
    pub push: Push,
    pub ticks: Vec<Tick>,
}

/// The time steps of an episode with default settings.
pub fn clock(engine: Engine) -> Clock {
    let robot = standfast::robots::load("ut-mu2").expect("built in");
    EpisodeConfig {
        engine,
        ..EpisodeConfig::of(&Units::of(&robot))
    }
    .clock()
}

impl Played {
    /// Records an episode with ideal sensors, and with a push from behind after 0.2 s.
    pub fn new(gains: &str, impulse_n_s: f64, engine: Engine) -> Self {
        let (robot, clock) = (
            standfast::robots::load("ut-mu2").expect("built in"),
            clock(engine),
        );
        let gains = standfast::controllers::gain_set(gains).expect("built in");
        let design = Design::new(&robot, &gains, clock.control_period_s).expect("built in");
        let push = Push {
            impulse_n_s,
            start_s: 0.2,
            ..Push::default()
        };
        let home = design.home_command();
        let mut plant = Plant::on(Ground::default(), robot.clone(), clock, None, home.clone());
        let mut controller = CpiController::new(design.clone());
        let mut command = design.home_command().clone();
        let count = (0.9 / clock.control_period_s) as usize;
        let ticks = (0..count)
            .map(|_| {
                let sensed = plant.sense();
                controller.tick(&sensed, &mut command).expect("readings");
                let phase = match controller.account().stands() {
                    false => Phase::Swing,
                    true if plant.truth().time_s < push.start_s => Phase::Standing,
                    true => Phase::Switching,
                };
                plant.advance(command.clone(), &[push]);
                Tick {
                    phase,
                    sensed,
                    command: command.clone(),
                }
            })
            .collect();
        Self {
            robot,
            design,
            clock,
            push,
            ticks,
        }
    }

    /// The robot at the beginning of the episode.
    pub fn plant(&self) -> Plant {
        Plant::on(
            Ground::default(),
            self.robot.clone(),
            self.clock,
            None,
            self.design.home_command().clone(),
        )
    }
}
