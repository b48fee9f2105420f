//! Shared by the tests: the program from outside, a page in a browser, and the closed loop.
#![allow(dead_code, reason = "each test file uses its part")]

#[path = "../../../../src/report/tests/common/browser.rs"]
pub mod browser;
#[path = "../../../../tests/common/program.rs"]
pub mod program;

use standfast::controllers;
use standfast::core::control::Design;
use standfast::core::robot::{Robot, Units};
use standfast::core::socket::PreparedController;
use standfast::sim::Push;
use standfast::sim::episode::{self, Disturbance, EpisodeConfig, Record, Tick, Until};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_standfast-paper");

/// UT-mu2, a controller prepared for it and, if the controller is of the kind `cpi`, its design.
pub struct Bench {
    pub robot: Robot,
    pub factory: PreparedController,
    design: Option<Design>,
}

impl Bench {
    pub fn new(gains: &str) -> Self {
        let robot = standfast::robots::load("ut-mu2").unwrap();
        let period_s = config(1.0).control_period_s;
        let factory = controllers::load(gains)
            .unwrap()
            .prepare(&robot, period_s)
            .unwrap();
        let design = standfast_paper::gain_set(gains)
            .ok()
            .map(|gains| Design::new(&robot, &gains, period_s).unwrap());
        Self {
            robot,
            factory,
            design,
        }
    }

    pub fn design(&self) -> &Design {
        self.design.as_ref().unwrap()
    }

    /// Runs an episode with one push, until it is decided.
    pub fn push(&self, push: Push) -> Record {
        self.run(push, 6.0, Until::Decided, |_| {})
    }

    pub fn run(
        &self,
        push: Push,
        horizon_s: f64,
        until: Until,
        mut observe: impl FnMut(&Tick),
    ) -> Record {
        let disturbance = Disturbance {
            pushes: vec![push],
            ..Disturbance::default()
        };
        episode::run(
            &self.robot,
            &self.factory,
            &config(horizon_s),
            disturbance,
            until,
            &mut observe,
        )
        .unwrap()
    }
}

pub fn config(horizon_s: f64) -> EpisodeConfig {
    EpisodeConfig {
        horizon_s,
        ..EpisodeConfig::of(&Units::of(&standfast::robots::load("ut-mu2").unwrap()))
    }
}
