//! The controller: estimate, then stand or step, then body (paper, Fig. 11). It sees [`Sensed`] and answers with a [`Command`]; it
//! never names the simulation.
//!
//! One tick ([`Controller::tick`]): [`Estimator`] (COM, its velocity, ZMP, contact) -> [`Balance`]: the standing rule
//! ([`stand`]: support, gain, wanted ZMP) or, when no set holds the state, a footwork rule ([`step`]) -> [`body`] (joint
//! targets and torques). What it did, and why, says its [`Account`].
//!
//! With what is below it the controller is a library of its own (`default-features = false`): for another simulator, or a robot.
//! Here the robot is one whose joints go where they are sent, standing still:
//!
//! ```
//! use standfast::control::{Controller, Design, Phase};
//! use standfast::lipm::GainSet;
//! use standfast::robot::{Command, GRAVITY, Imu, PerFoot, Robot, Sensed, Wrench};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let period_s = 0.002;
//! let robot = Robot::load("ut-mu2")?;
//! let design = Design::new(&robot, &GainSet::load("catch")?, period_s)?;
//! let mut controller = Controller::new(design);
//! let mut command = Command::hold(&robot.home_rad);
//! let half_weight = Vector3::new(0.0, 0.0, 0.5 * robot.mass() * GRAVITY);
//! for _ in 0..100 {
//!     // Encoders, the IMU over the period that ends, and mean wrenches under the soles, in their axes.
//!     let sensed = Sensed {
//!         q: command.q_ref.clone(),
//!         imu: Imu::over(period_s, UnitQuaternion::identity(), [Vector3::zeros(); 2], Vector3::zeros()),
//!         soles: PerFoot::from_fn(|_| Wrench { force: half_weight, moment: Vector3::zeros() }),
//!     };
//!     // A reading that cannot be is refused; the last good command then stands.
//!     if let Err(error) = controller.tick(&sensed, &mut command) {
//!         eprintln!("{error}");
//!     }
//! }
//! let account = controller.account();
//! assert_eq!(account.phase, Phase::Switching);
//! println!("{}: margin {:.2}, ZMP wanted at {}", account.phase.name(), account.margin, account.zmp_ref);
//! # Ok(())
//! # }
//! ```

mod account;
mod balance;
pub mod body;
mod design;
mod error;
pub mod estimate;
pub mod stand;
pub mod step;

use crate::robot::{Command, Sensed};
pub use account::{Account, Phase};
pub use balance::Balance;
pub use design::{Design, home_polygon};
pub use error::TickError;
use estimate::{Estimate, Estimator};
use nalgebra::Vector2;
use std::sync::Arc;

/// A controller, of one robot and gain set.
#[derive(Debug)]
pub struct Controller {
    design: Arc<Design>,
    estimator: Estimator,
    balance: Balance,
    /// The last good command.
    command: Command,
    /// Its state is of no use.
    is_lost: bool,
}

impl Controller {
    /// For a robot that is at home, at rest.
    pub fn new(design: impl Into<Arc<Design>>) -> Self {
        let design = design.into();
        let start = Estimate::at_home(&design.robot);
        Self {
            balance: Balance::new(design.clone(), &start),
            estimator: Estimator::new(&design.robot, design.family.pendulum.dt, start),
            command: design.home.clone(),
            is_lost: false,
            design,
        }
    }

    /// For a robot at rest in the posture that is sensed, wherever that is. Errors: as for [`restart`](Self::restart).
    pub fn starting_from(design: impl Into<Arc<Design>>, sensed: &Sensed) -> Result<Self, TickError> {
        let mut controller = Self::new(design);
        controller.restart(sensed)?;
        Ok(controller)
    }

    /// Starts anew from the posture that is sensed, at rest: after a fall, say. The middle of the feet is then over the world's
    /// origin, the lowest corner of a sole on the ground. Errors: what was sensed cannot be; nothing has changed then.
    pub fn restart(&mut self, sensed: &Sensed) -> Result<(), TickError> {
        let robot = &self.design.robot;
        sensed.check(robot.joints.len())?;
        self.estimator.restart(robot, sensed);
        self.balance = Balance::new(self.design.clone(), &self.estimator.now);
        self.is_lost = false;
        Ok(())
    }

    /// One control tick: what the sensors read, and what the servos are to do. Does not allocate if `command` has room for the
    /// robot's joints. Errors leave `command` as it is.
    pub fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        let robot = &*self.design.robot;
        sensed.check(robot.joints.len())?;
        if self.is_lost {
            self.restart(sensed)?;
        } else {
            self.estimator.update(robot, sensed, self.balance.in_air());
        }
        self.is_lost = true;
        self.balance.tick(&mut self.estimator.now, &mut self.command)?;
        if !self.command.is_finite() {
            return Err(TickError::Unsolvable);
        }
        self.is_lost = false;
        command.clone_from(&self.command);
        Ok(())
    }

    /// What was done at the last tick, and why.
    pub fn account(&self) -> Account<'_> {
        self.balance.account(&self.estimator.now)
    }

    /// Goes on with the gain set of another design for the same robot, from the state reached. A foot in the air is led to its
    /// landing by the rule that lifted it.
    pub fn switch_to(&mut self, design: impl Into<Arc<Design>>) {
        self.design = design.into();
        self.balance.switch_to(self.design.clone());
    }

    /// Adds to what the acting gain wants of the ZMP (m, world), behind its back: to measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.balance.probe_zmp(probe);
    }
}
