//! The controller: it estimates the state of the robot, decides whether to stand or to step, and moves the body (paper,
//! Fig. 11). It reads a [`Sensed`] and writes a [`Command`], and it never names the simulation.
//!
//! One control tick ([`Controller::tick`]) goes through three parts. The [`Estimator`] finds the posture, the COM and
//! its velocity, the ZMP and which soles are in contact. [`Balance`] applies the standing rule ([`stand`]: support
//! polygon, acting gain, desired ZMP) or, when the state lies in no gain's [CPI set](crate::lipm::cpi_set), a footwork
//! rule ([`step`]). The [`body`] turns the result into joint targets and torques. [`Account`] tells what the controller
//! did and why.
//!
//! Together with the modules below it, the controller is a library of its own (`default-features = false`), for another
//! simulator or for a real robot. In this example the joints reach their targets at once and the robot stands still:
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
//!     // Encoders, the IMU averaged over the past period, and mean wrenches under the soles in sole axes.
//!     let sensed = Sensed {
//!         q: command.q_ref.clone(),
//!         imu: Imu::over(period_s, UnitQuaternion::identity(), [Vector3::zeros(); 2], Vector3::zeros()),
//!         soles: PerFoot::from_fn(|_| Wrench { force: half_weight, moment: Vector3::zeros() }),
//!     };
//!     // The controller refuses readings that are out of range; `command` then keeps its last valid content.
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
pub use design::{Design, FootworkRules, home_polygon};
pub use error::TickError;
use estimate::{Estimate, Estimator};
use nalgebra::Vector2;
use std::sync::Arc;

/// A controller for one robot and one gain set.
#[derive(Debug, Clone)]
pub struct Controller {
    design: Arc<Design>,
    estimator: Estimator,
    balance: Balance,
    /// The last valid command.
    command: Command,
    /// Whether the last tick failed, so that the controller has to restart from the next sample.
    is_lost: bool,
}

impl Controller {
    /// Starts with the robot at home and at rest.
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

    /// Starts with the robot at rest in the sensed posture. It fails as [`restart`](Self::restart) does.
    pub fn starting_from(design: impl Into<Arc<Design>>, sensed: &Sensed) -> Result<Self, TickError> {
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
        self.balance = Balance::new(self.design.clone(), &self.estimator.now);
        self.is_lost = false;
        Ok(())
    }

    /// Runs one control tick: reads `sensed` and writes what the servos are to do into `command`. It does not allocate
    /// if `command` has room for the robot's joints. On an error, `command` is left as it was.
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

    /// What the controller did at the last tick, and why.
    pub fn account(&self) -> Account<'_> {
        self.balance.account(&self.estimator.now)
    }

    /// Continues from the present state with the gain set of another design for the same robot. If a foot is in the
    /// air, the footwork rule that lifted it leads it to its landing first.
    pub fn switch_to(&mut self, design: impl Into<Arc<Design>>) {
        self.design = design.into();
        self.balance.switch_to(self.design.clone());
    }

    /// Adds `probe` (m, world frame) to the ZMP that the acting gain asks for, without changing the gain's own state.
    /// It serves to measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.balance.probe_zmp(probe);
    }
}
