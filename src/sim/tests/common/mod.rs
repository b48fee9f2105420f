//! Common code of the tests of the closed loop.
#![allow(dead_code, reason = "each test file uses its part")]

pub mod mirror;

use nalgebra::Vector3;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use standfast_core::control::{Account, CpiController, Design};
use standfast_core::lipm::GainSet;
use standfast_core::robot::dynamics::Dynamics;
use standfast_core::robot::{Kinematics, Robot, Units};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{self, ClosedLoop, Disturbance, EpisodeConfig, Record, Tick, Until};
use standfast_sim::noise::Normals;
use standfast_sim::{Engine, Push, SensorErrors, Truth};
use std::any::Any;
use std::sync::Arc;

/// A robot and a controller prepared for it.
pub struct Bench {
    pub robot: Robot,
    pub factory: PreparedController,
    /// The design of the controller, if the controller is a gain set.
    design: Option<Design>,
}

impl Bench {
    /// UT-mu2 with a built-in controller.
    pub fn new(gains: &str) -> Self {
        Self::with(standfast_robots::load("ut-mu2").unwrap(), gains)
    }

    pub fn with(robot: Robot, gains: &str) -> Self {
        match standfast_controllers::gain_set(gains) {
            Ok(gains) => Self::with_set(robot, &gains),
            Err(_) => {
                let factory = standfast_controllers::load(gains)
                    .unwrap()
                    .prepare(&robot, config(1.0).control_period_s)
                    .unwrap();
                Self {
                    robot,
                    factory,
                    design: None,
                }
            }
        }
    }

    pub fn with_set(robot: Robot, gains: &GainSet) -> Self {
        let design = Design::new(&robot, gains, config(1.0).control_period_s).unwrap();
        Self::with_design(robot, design)
    }

    pub fn with_design(robot: Robot, design: Design) -> Self {
        Self {
            robot,
            factory: design.clone().into(),
            design: Some(design),
        }
    }

    /// The design of the controller, which must be a gain set.
    pub fn design(&self) -> &Design {
        self.design.as_ref().unwrap()
    }

    /// Runs an episode with ideal sensors and one push, until it is decided.
    pub fn push(&self, push: Push) -> Record {
        self.run(vec![push], None, 6.0, Until::Decided, |_| {})
    }

    pub fn run(
        &self,
        pushes: Vec<Push>,
        sensor_errors: Option<SensorErrors>,
        horizon_s: f64,
        until: Until,
        mut observe: impl FnMut(&Tick),
    ) -> Record {
        let disturbance = Disturbance {
            pushes,
            sensor_errors,
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

/// The account of our own controller at a tick, which says more than its report.
pub fn account<'a>(tick: &Tick<'a>) -> Account<'a> {
    (tick.controller.unwrap() as &dyn Any)
        .downcast_ref::<CpiController>()
        .unwrap()
        .account()
}

/// The present tick of a closed loop with one controller.
pub fn ticked<T>(live: &mut ClosedLoop, see: impl Fn(&Tick) -> T) -> T {
    let mut seen = None;
    live.decide(&mut |_, tick| seen = Some(see(tick)));
    seen.unwrap()
}

pub fn config(horizon_s: f64) -> EpisodeConfig {
    let units = Units::of(&standfast_robots::load("ut-mu2").unwrap());
    EpisodeConfig {
        horizon_s,
        engine: engine(),
        ..EpisodeConfig::of(&units)
    }
}

/// The physics engine under test, which each test program names.
pub fn engine() -> Engine {
    crate::engine()
}

pub fn push(impulse_n_s: f64, heading_deg: f64) -> Push {
    Push {
        impulse_n_s,
        heading_deg,
        ..Push::default()
    }
}

/// Sensor errors with the robot's own noise, and a bias of half that size, from a seed.
pub fn sensor_errors(seed: u64) -> SensorErrors {
    SensorErrors {
        noise_scale: 1.0,
        bias_scale: 0.5,
        normal: Arc::new(Normals(ChaCha8Rng::seed_from_u64(seed))),
    }
}

/// Angular momentum about the COM (N m s), of the links without the rotors' spin.
pub fn angular_momentum(robot: &Robot, truth: &Truth) -> Vector3<f64> {
    let kinematics = Kinematics::at(robot, &truth.posture);
    let mut dynamics = Dynamics::new(robot);
    dynamics.update(robot, &kinematics, &truth.velocity);
    let row = |i: usize| dynamics.mass_matrix().column(i).dot(&truth.velocity);
    let (linear, about_base) = (
        Vector3::from_fn(|i, _| row(i)),
        Vector3::from_fn(|i, _| row(3 + i)),
    );
    about_base - (truth.com.coords - truth.posture.base.translation.vector).cross(&linear)
}
