//! What the controller did at a tick, and why: read by trace, film, window and judge. Nobody reaches into the controller.

use super::design::Design;
use super::estimate::Estimate;
use super::stand::{Supervisor, Support};
use super::step::Swing;
use crate::robot::{Foot, Posture};
use nalgebra::{Point2, Vector2};

/// What the controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The home posture is held.
    Posture,
    /// Some gain's set holds the state.
    Switching,
    /// No set holds the state (eq. 26), and no foot is being moved.
    OutOfSets,
    /// This foot is being moved.
    Swing(Foot),
}

impl Phase {
    pub fn name(self) -> &'static str {
        match self {
            Phase::Posture => "posture",
            Phase::Switching => "switching",
            Phase::OutOfSets => "out-of-sets",
            Phase::Swing(Foot::Left) => "swing-left",
            Phase::Swing(Foot::Right) => "swing-right",
        }
    }
}

/// The last tick, in the world as the controller estimates it.
#[derive(Debug, Clone, Copy)]
pub struct Account<'a> {
    pub phase: Phase,
    pub estimate: &'a Estimate,
    /// Wanted ZMP (m).
    pub zmp_ref: Point2<f64>,
    /// The gain that acts, index into those of the gain set, slow to fast; the last one that did while a foot is in the air. None
    /// without gains.
    pub gain: Option<usize>,
    /// Margin of the slowest gain's set, the largest, when the robot last stood: negative when no set holds the state
    /// (eq. 26), negative infinity where there is no set.
    pub margin: f64,
    /// How often a gain has started anew.
    pub switches: u32,
    /// The footstep in the air.
    pub swing: Option<&'a Swing>,
    /// Where the body is sent: the posture of the inverse kinematics.
    pub posture_ref: &'a Posture,
    pub(super) design: &'a Design,
    pub(super) supervisor: &'a Supervisor,
}

impl<'a> Account<'a> {
    /// Whether no foot is in the air: the sets are those of the support.
    pub fn stands(&self) -> bool {
        self.swing.is_none()
    }

    /// Name of the gain that acts; None where the gain set has none.
    pub fn gain_name(&self) -> Option<&'a str> {
        self.gain.map(|gain| self.design.family.gains[gain].name.as_str())
    }

    /// What the robot stands on, as estimated: not on a foot that is in the air.
    pub fn support(&self) -> Support {
        Support::of_estimate(&self.design.robot, self.estimate)
    }

    /// The margin, as [`margin`](Self::margin), of another state of the COM (world; m, m/s), e.g. the true one.
    pub fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64 {
        self.supervisor.margin_at(com, com_vel)
    }

    /// For a picture: the slice of each gain's set over the COM, at the COM velocity and ZMP when the robot last stood, slow to
    /// fast: corners in the world (m), none where the set holds no such state.
    pub fn slices(&self) -> Vec<Vec<Point2<f64>>> {
        self.supervisor.slices()
    }
}
