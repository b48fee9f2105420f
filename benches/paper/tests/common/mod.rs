//! Shared by the tests: the program from outside, a page in a browser, and the closed loop.
#![allow(dead_code, reason = "each test file uses its part")]

#[path = "../../../../tests/common/browser.rs"]
pub mod browser;
#[path = "../../../../tests/common/program.rs"]
pub mod program;

use standfast::control::Design;
use standfast::episode::{self, Disturbance, EpisodeConfig, Record, Tick, Until};
use standfast::lipm::GainSet;
use standfast::robot::{Robot, Units};
use standfast::sim::Push;

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_standfast-paper");

/// UT-mu2 and a gain set designed for it.
pub struct Bench {
    pub robot: Robot,
    pub design: Design,
}

impl Bench {
    pub fn new(gains: &str) -> Self {
        let robot = Robot::load("ut-mu2").unwrap();
        let design = Design::new(&robot, &GainSet::load(gains).unwrap(), config(1.0).control_period_s).unwrap();
        Self { robot, design }
    }

    /// Runs an episode with one push, until it is decided.
    pub fn push(&self, push: Push) -> Record {
        self.run(push, 6.0, Until::Decided, |_| {})
    }

    pub fn run(&self, push: Push, horizon_s: f64, until: Until, mut observe: impl FnMut(&Tick)) -> Record {
        let disturbance = Disturbance { pushes: vec![push], ..Disturbance::default() };
        episode::run(&self.robot, &self.design, &config(horizon_s), disturbance, until, &mut observe)
    }
}

pub fn config(horizon_s: f64) -> EpisodeConfig {
    EpisodeConfig { horizon_s, ..EpisodeConfig::of(&Units::of(&Robot::load("ut-mu2").unwrap())) }
}
