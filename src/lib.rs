//! How hard can a humanoid be pushed before it falls, and which controller makes it stand better?
//!
//! A URDF ([`robots`]) becomes a Rapier multibody with PD servos ([`sim`]). Our controller ([`core::control`]) implements the
//! switching control of the COG-ZMP inverted pendulum by maximal CPI sets of Yamamoto and Nakamura ([`core::lipm`]); it is one
//! among other kinds ([`controllers`]). An [episode](sim::episode) closes the loop between robot and controller. A
//! [campaign](study) draws random pushes and counts how many the robot recovers from, and a [`report`] tells of it.
//!
//! The [`guide`] says how to use it and what has been measured.
//!
//! Quantities are in SI units and f64, and in the world frame unless a type says otherwise: x forward, y left, z up.
//! Heading 0 pushes forward, and 90 degrees to the left.
//!
//! # The controller alone
//!
//! The controller is a library of its own, the crate `standfast-core`, for another simulator or for a real robot. In this
//! example the joints reach their targets at once and the robot stands still:
//!
//! ```
//! use standfast::core::control::{CpiController, Design, Phase};
//! use standfast::controllers::gain_set;
//! use standfast::core::robot::PerFoot;
//! use standfast::core::socket::{Command, Controller, Imu, Sensed, Wrench};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let period_s = 0.002;
//! let robot = standfast_robots::load("ut-mu2")?;
//! let design = Design::new(&robot, &gain_set("catch")?, period_s)?;
//! let mut controller = CpiController::new(design);
//! let mut command = Command::hold(&robot.home_rad);
//! let half_weight = Vector3::new(0.0, 0.0, 0.5 * robot.weight_n());
//! for k in 0..100 {
//!     // Encoders, the IMU averaged over the past period, and mean wrenches under the soles in sole axes.
//!     let sensed = Sensed {
//!         time_s: f64::from(k) * period_s,
//!         q: command.q_ref.clone(),
//!         dq: vec![0.0; robot.joints.len()],
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
//!
//! # A controller of your own
//!
//! A program of your own can put a controller of its own on trial, beside the built-in ones and under the same pushes:
//!
//! ```
//! use standfast::study::{Campaign, Overrides, PreparedCampaign, run::run_all};
//! use standfast::controllers::Own;
//! use standfast::core::socket::{Command, Controller, PreparedController, Report, Sensed, TickError};
//!
//! /// Holds the posture of the start, with an angular velocity of the ankles against that of the trunk.
//! #[derive(Clone)]
//! struct Damped(Command, Vec<usize>, f64);
//!
//! impl Controller for Damped {
//!     fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
//!         command.clone_from(&self.0);
//!         self.1.iter().for_each(|&ankle| command.tau_ff[ankle] += self.2 * sensed.imu.gyro.y);
//!         Ok(())
//!     }
//!     fn report(&self) -> Report<'_> {
//!         Report::of_phase("standing")
//!     }
//!     fn fork(&self) -> Option<Box<dyn Controller>> {
//!         Some(Box::new(self.clone()))
//!     }
//! }
//!
//! # fn main() -> standfast::Result<()> {
//! let gain = 0.5;
//! let ours = Own::new("ankles", toml::toml! { gain = 0.5 }, move |robot, _period_s| {
//!     let ankles = (0..robot.joints.len()).filter(|&i| robot.joints[i].name.contains("ankle_flexion"));
//!     let damped = Damped(robot.home_command(), ankles.collect(), gain);
//!     Ok(PreparedController::new("ankles", "with damped ankles", move |_seed| damped.clone()))
//! });
//! let overrides = Overrides { controllers: vec!["hold".into(), "fixed".into()], ..Overrides::default() };
//! let plan = PreparedCampaign::new(&Campaign::load("smoke", &overrides)?)?.and(ours)?;
//! # let folder = tempfile::tempdir().unwrap();
//! # let out = folder.path().join("result");
//! for one in &run_all(&plan, &out)?.controllers {
//!     println!("{} recovers from {} of {} pushes", one.name, one.count.recovered, one.count.trials);
//! }
//! # assert_eq!(standfast::study::Folder::existing(&out)?.manifest.controllers[2], "ankles");
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

pub mod commands;
pub mod guide;
pub mod leaves;

pub use standfast_controllers as controllers;
pub use standfast_core as core;
pub use standfast_core::{Error, Result};
pub use standfast_files as files;
pub use standfast_report as report;
pub use standfast_robots as robots;
pub use standfast_scene as scene;
pub use standfast_sim as sim;
pub use standfast_stats as stats;
pub use standfast_study as study;
