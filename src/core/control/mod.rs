//! Our own controller: it estimates the state of the robot, decides whether to stand or to step, and moves the body
//! (paper, Fig. 11). It is one [`Controller`] among others, of the kind `cpi`: it alone knows CPI sets. It reads a
//! [`Sensed`] and writes a [`Command`], and it never names the simulation.
//!
//! One control tick ([`CpiController::tick`]) goes through three parts. The [`Estimator`] finds the posture, the COM
//! and its velocity, the ZMP and which soles are in contact. [`Balance`] applies the standing rule ([`stand`]: support
//! polygon, acting gain, desired ZMP) or, when the state lies in no gain's [CPI set](crate::lipm::cpi_set), a footwork
//! rule ([`step`]). The [`body`] turns the result into joint targets and torques. [`Account`] states the controller's
//! decision and its reason; [`Report`] is the part that others see.
//!

mod account;
mod balance;
pub mod body;
mod design;
pub mod estimate;
pub mod stand;
pub mod step;

use crate::lipm::catching::Departures;
use crate::socket::{
    Command, Controller, PreparedController, Promise, RecoveryRegion, Report, Sensed, TickError,
};
pub use account::{Account, Phase};
pub use balance::Balance;
pub use design::{Design, FootworkRules, home_polygon};
use estimate::Estimator;
use nalgebra::{Point2, Vector2};
use std::sync::Arc;

/// A controller for one robot and one gain set.
#[derive(Debug, Clone)]
pub struct CpiController {
    design: Arc<Design>,
    estimator: Estimator,
    balance: Balance,
    /// The last valid command.
    command: Command,
    /// Whether the last tick failed, so that the controller has to restart from the next sample.
    is_lost: bool,
    /// Time at which the state was first in no gain's CPI set (s).
    left_sets_at_s: Option<f64>,
}

impl CpiController {
    /// Starts with the robot at home and at rest.
    pub fn new(design: impl Into<Arc<Design>>) -> Self {
        let design = design.into();
        let estimator = Estimator::new(&design.robot, design.family.pendulum.dt);
        Self {
            balance: Balance::new(design.clone(), estimator.now()),
            estimator,
            command: design.home.clone(),
            is_lost: false,
            left_sets_at_s: None,
            design,
        }
    }

    /// Starts with the robot at rest in the sensed posture. It fails as [`restart`](Self::restart) does.
    pub fn starting_from(
        design: impl Into<Arc<Design>>,
        sensed: &Sensed,
    ) -> Result<Self, TickError> {
        let mut controller = Self::new(design);
        controller.restart(sensed)?;
        Ok(controller)
    }

    /// Starts anew, at rest in the sensed posture, for example after a fall. The world's origin is then midway between
    /// the feet, and the lowest corner of a sole is on the ground. Invalid readings are an error and change nothing.
    pub fn restart(&mut self, sensed: &Sensed) -> Result<(), TickError> {
        let robot = &self.design.robot;
        sensed.check(robot.joints.len())?;
        self.estimator.restart(robot, sensed);
        self.balance = Balance::new(self.design.clone(), self.estimator.now());
        self.is_lost = false;
        Ok(())
    }

    /// The controller's decision at the last tick, and its reason.
    pub fn account(&self) -> Account<'_> {
        self.balance.account(self.estimator.now())
    }

    /// Continues from the present state with the gain set of another design for the same robot. If a foot is in the
    /// air, the footwork rule that lifted it leads it to its landing first.
    pub fn switch_to(&mut self, design: impl Into<Arc<Design>>) {
        self.design = design.into();
        self.balance.switch_to(self.design.clone());
    }

    /// Adds `probe` (m, world frame) to the ZMP that the acting gain asks for, without changing the gain's own state.
    /// This serves to measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.balance.probe_zmp(probe);
    }

    /// Makes the first footsteps depart from the rule `[catching]`, as if the gain set said so. It must be called
    /// before these footsteps.
    pub fn depart(&mut self, departures: &Departures) {
        self.balance.depart(departures);
    }

    /// The gain set and the robot for which the controller is designed.
    pub fn design(&self) -> &Arc<Design> {
        &self.design
    }
}

impl Controller for CpiController {
    /// It does not allocate if `command` has room for the robot's joints. On an error, `command` is left as it was.
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        let robot = &*self.design.robot;
        sensed.check(robot.joints.len())?;
        if self.is_lost {
            self.restart(sensed)?;
        } else {
            self.estimator.update(robot, sensed, self.balance.in_air());
        }
        self.is_lost = true;
        self.balance.tick(&mut self.estimator, &mut self.command)?;
        self.command
            .check(self.design.robot.joints.len())
            .map_err(|_| TickError::Unsolvable)?;
        self.is_lost = false;
        if self.left_sets_at_s.is_none() && self.balance.has_left_sets() {
            self.left_sets_at_s = Some(sensed.time_s);
        }
        command.clone_from(&self.command);
        Ok(())
    }

    fn report(&self) -> Report<'_> {
        Report {
            left_sets_at_s: self.left_sets_at_s,
            promise: Some(self),
            ..self.account().report()
        }
    }

    fn fork(&self) -> Option<Box<dyn Controller>> {
        Some(Box::new(self.clone()))
    }
}

/// The states in the slowest gain's CPI set, which is the largest one.
impl Promise for CpiController {
    fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64 {
        self.account().margin_at(com, com_vel)
    }

    fn regions(&self) -> Vec<RecoveryRegion> {
        let account = self.account();
        let slices = if account.stands() {
            account.slices()
        } else {
            Vec::new()
        };
        let gains = self
            .design
            .family
            .gains
            .iter()
            .map(|gain| gain.name.clone());
        gains
            .zip(slices)
            .map(|(name, corners)| RecoveryRegion { name, corners })
            .collect()
    }
}

impl From<Design> for PreparedController {
    fn from(design: Design) -> Self {
        let family = &design.family;
        let gains = match family.gains.len() {
            1 => "one gain".into(),
            count => format!("{count} gains"),
        };
        let footsteps = if design.footwork.is_some() {
            "footsteps"
        } else {
            "no footsteps"
        };
        let about = format!("with {gains} and {footsteps}");
        let shared = Arc::new(design.clone());
        let mut factory = PreparedController::new(&family.name, about, move |_seed| {
            CpiController::new(Arc::clone(&shared))
        });
        factory.regions = family.gains.iter().map(|gain| gain.name.clone()).collect();
        factory.takes_footsteps = design.footwork.is_some();
        factory.warning = design.warning;
        factory
    }
}
