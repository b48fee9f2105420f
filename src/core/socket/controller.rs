//! The interface of a controller to all code that drives, judges, stores, draws or compares it.
//!
//! A [`Controller`] reads a [`Sensed`] and writes a [`Command`] at every tick. Its [`Report`] is plain data: its
//! activity and the reason, as far as it states them. A [`PreparedController`] starts the controllers of all episodes. No code
//! above this file needs to know more of a controller, so any kind can be compared with any other.
//!
//! A controller that holds the posture of the start, in full:
//!
//! ```
//! use standfast_core::socket::{Command, Controller, Report, Sensed, TickError};
//!
//! #[derive(Clone)]
//! struct Stiff {
//!     start: Option<Vec<f64>>,
//! }
//!
//! impl Controller for Stiff {
//!     fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
//!         command.q_ref.clone_from(self.start.get_or_insert_with(|| sensed.q.clone()));
//!         Ok(())
//!     }
//!     fn report(&self) -> Report<'_> {
//!         Report::of_phase("stiff")
//!     }
//!     fn fork(&self) -> Option<Box<dyn Controller>> {
//!         Some(Box::new(self.clone()))
//!     }
//! }
//! ```

use super::{Command, CommandError, Sensed, SensedError};
use crate::robot::{Foot, Pose};
use nalgebra::{Point2, Point3, Vector2, Vector3};
use std::any::Any;
use std::fmt;

/// A controller in an episode. It starts with the robot at home and at rest.
pub trait Controller: Any + Send + Sync {
    /// Runs one control tick: reads `sensed` and writes the targets of the servos into `command`, which holds the last
    /// valid command. After an error, the last valid command holds.
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError>;

    /// The activity of the controller at the last tick, and the reason.
    fn report(&self) -> Report<'_>;

    /// A copy that continues from the present state to the same bits, so that trials with the same beginning can share
    /// it. It is None if the controller cannot be copied, or if it uses its seed; each of its episodes then runs from
    /// the start.
    fn fork(&self) -> Option<Box<dyn Controller>>;

    /// The observation of the last action: parts by name, with their numbers. It is empty if the controller does not
    /// state it.
    fn observed(&self) -> Vec<(String, Vec<f64>)> {
        Vec::new()
    }

    /// The action for an observation of these numbers, as if it were the next one of an episode. It is None if the
    /// controller takes no observations. Errors are in words.
    fn answer(&mut self, _observed: &[f64]) -> Option<Result<Vec<f64>, String>> {
        None
    }
}

/// Why a tick gave no new command.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TickError {
    /// The readings are invalid. The state of the controller has not changed.
    #[error(transparent)]
    Sensed(#[from] SensedError),
    /// The equations of motion have no solution, or no finite one. The controller restarts from the next sample.
    #[error(
        "the equations of motion have no solution for these readings; the controller restarts from the next sample"
    )]
    Unsolvable,
    /// The command is not one that servos can follow. It ends the episode.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// The controller cannot go on. It ends the episode.
    #[error("{0}")]
    Failed(String),
    /// The machine lacks something that the controller needs, such as open files. It ends the episode without an
    /// outcome.
    #[error("{0}")]
    Machine(String),
    /// The program that the controller depends on in all episodes has ended or cannot go on. It ends the episode without
    /// an outcome.
    #[error("{0}")]
    Ended(String),
    /// Somebody asked to stop while the controller was waited for. It ends the episode without an outcome.
    #[error("interrupted")]
    Interrupted,
}

impl TickError {
    /// Whether the episode ends here.
    pub fn is_final(&self) -> bool {
        !matches!(self, TickError::Sensed(_) | TickError::Unsolvable)
    }

    /// Whether the error says nothing about the controller, so that the episode has no outcome.
    pub fn is_no_outcome(&self) -> bool {
        matches!(
            self,
            TickError::Machine(_) | TickError::Ended(_) | TickError::Interrupted
        )
    }
}

/// The activity of a controller at a tick, and the reason. It borrows from the controller and allocates nothing. All
/// fields but the phase are optional, and a missing one is not shown. All places are in the world frame as the
/// controller estimates it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Report<'a> {
    /// The activity, in a word or two joined by `-`.
    pub phase: &'a str,
    /// Estimated pose of the robot's base. With it, the places below are moved to the true world for pictures.
    pub base: Option<Pose>,
    /// Estimated COM (m) and its velocity (m/s).
    pub com: Option<Point3<f64>>,
    pub com_vel: Option<Vector3<f64>>,
    /// Estimated ZMP and desired ZMP (m).
    pub zmp: Option<Point2<f64>>,
    pub zmp_ref: Option<Point2<f64>>,
    /// The footstep in the air, and the ZMP error for which it is taken (m, control frame).
    pub footstep: Option<Airborne>,
    pub zmp_error: Option<Vector2<f64>>,
    /// Name of the acting gain. With a foot in the air, it is the last acting gain.
    pub gain: Option<&'a str>,
    /// Margin of the estimated state in the slowest gain's CPI set, and whether any CPI set contains the state. None
    /// with a foot in the air, since the CPI sets are then not evaluated.
    pub cpi_margin: Option<f64>,
    pub in_cpi_set: Option<bool>,
    /// How often a gain has been started in the episode so far.
    pub gain_switches: Option<u32>,
    /// Time at which the state was first in no CPI set (s).
    pub left_sets_at_s: Option<f64>,
    /// Other numbers of this tick under names that the controller chooses, for traces.
    pub others: &'a [(String, f64)],
    /// The states from which the controller promises to recover by standing. The judge compares the promise with the
    /// outcome.
    pub promise: Option<&'a dyn Promise>,
}

impl<'a> Report<'a> {
    /// Names of the [`totals`](Self::totals).
    pub const TOTALS: [&'static str; 2] = ["gain_switches", "left_sets_at_s"];

    /// A report of the phase alone.
    pub fn of_phase(phase: &'a str) -> Self {
        Self {
            phase,
            ..Self::default()
        }
    }

    /// The numbers of this tick that have a column of their own in traces, by name of the column.
    pub fn numbers(&self) -> impl Iterator<Item = (&'a str, f64)> + use<'a> {
        let of_sets = [
            ("cpi_margin", self.cpi_margin),
            ("in_cpi_set", self.in_cpi_set.map(f64::from)),
            ("zmp_error_x_m", self.zmp_error.map(|error| error.x)),
            ("zmp_error_y_m", self.zmp_error.map(|error| error.y)),
        ];
        let others = self.others.iter().map(|(name, number)| (&**name, *number));
        of_sets
            .into_iter()
            .filter_map(|(name, number)| Some((name, number?)))
            .chain(others)
    }

    /// The numbers of the episode so far, by name of their column in results. The last ones before a fall are kept.
    pub fn totals(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let totals = [self.gain_switches.map(f64::from), self.left_sets_at_s];
        let named = Self::TOTALS.into_iter().zip(totals);
        named.filter_map(|(name, total)| Some((name, total?)))
    }
}

/// A foot in the air, and the pose of its sole at the planned landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Airborne {
    pub foot: Foot,
    pub landing: Pose,
}

/// The states from which a controller promises to recover without a footstep.
pub trait Promise: fmt::Debug + Sync {
    /// The margin of a state of the COM (m and m/s, world frame) among the promised states: 1 for rest at home, 0 at
    /// the border, negative outside, and negative infinity if no states are promised now.
    fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64;

    /// For pictures: places of the COM from which, at its present velocity, the controller promises to recover. The
    /// regions are in the order of [`PreparedController::regions`].
    fn regions(&self) -> Vec<RecoveryRegion>;
}

/// Places of the COM from which a controller recovers by standing.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryRegion {
    /// Name of what acts there, such as a gain.
    pub name: String,
    /// Corners, counter-clockwise (m, world frame); none if there is no such place.
    pub corners: Vec<Point2<f64>>,
}

/// A controller prepared for a robot and a control period. All its episodes share it.
pub struct PreparedController {
    /// Name of the controller in tables and results.
    pub name: String,
    /// A description that follows the name and a comma: "which keeps its posture".
    pub about: String,
    /// A warning about the controller.
    pub warning: Option<String>,
    /// Names of the regions of the promise, the largest first. There are none without a promise.
    pub regions: Vec<String>,
    /// Whether it may lift its feet.
    pub takes_footsteps: bool,
    /// Time after which it does the same again without a push, if it marches (s).
    pub stride_s: Option<f64>,
    start: Box<dyn Fn(u64) -> Box<dyn Controller> + Send + Sync>,
}

impl PreparedController {
    /// The factory of a controller that makes no promise and may take footsteps. `start` gets a seed, which differs in
    /// every trial.
    pub fn new<C: Controller>(
        name: impl Into<String>,
        about: impl Into<String>,
        start: impl Fn(u64) -> C + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            warning: None,
            regions: Vec::new(),
            takes_footsteps: true,
            stride_s: None,
            start: Box::new(move |seed| Box::new(start(seed))),
        }
    }

    /// Starts a controller with the robot at home and at rest. Its random numbers follow from the seed.
    pub fn start(&self, seed: u64) -> Box<dyn Controller> {
        (self.start)(seed)
    }

    /// Whether the controllers can be copied at the start. If so, they have no hidden memory.
    pub fn can_be_copied(&self) -> bool {
        self.start(0).fork().is_some()
    }
}

impl fmt::Debug for PreparedController {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Factory({})", self.name)
    }
}
