//! What the controller did at a tick, and why. Traces, films, the window and the referee read it.

use super::design::Design;
use super::estimate::Estimate;
use super::stand::{Supervisor, Support};
use super::step::Swing;
use crate::robot::{Foot, Posture};
use nalgebra::{Point2, Vector2};

/// What the controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// It holds the home posture.
    Posture,
    /// It stands, and the state lies in the CPI set of at least one gain.
    Switching,
    /// It stands, and the state lies in no gain's CPI set (eq. 26).
    OutOfSets,
    /// It moves this foot.
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

/// The last tick, in the world frame as the controller estimates it.
#[derive(Debug, Clone, Copy)]
pub struct Account<'a> {
    pub phase: Phase,
    pub estimate: &'a Estimate,
    /// Desired ZMP (m).
    pub zmp_ref: Point2<f64>,
    /// Index of the acting gain, from slow to fast; with a foot in the air, of the last one. None without gains.
    pub gain: Option<usize>,
    /// Margin of the state in the slowest gain's CPI set, which is the largest set, when the robot last stood. It is
    /// negative when no set contains the state (eq. 26), and negative infinity when there is no set.
    pub margin: f64,
    /// How often a gain has been started from the estimated state.
    pub switches: u32,
    /// The footstep in the air.
    pub swing: Option<&'a Swing>,
    /// The posture from inverse kinematics to which the body is sent.
    pub posture_ref: &'a Posture,
    pub(super) design: &'a Design,
    pub(super) supervisor: &'a Supervisor,
}

impl<'a> Account<'a> {
    /// Whether the robot stands, with no foot being moved. Only then do the CPI sets belong to the present support.
    pub fn stands(&self) -> bool {
        self.swing.is_none()
    }

    /// Name of the acting gain; None if the gain set has no gains.
    pub fn gain_name(&self) -> Option<&'a str> {
        self.gain.map(|gain| self.design.family.gains[gain].name.as_str())
    }

    /// The estimated support. A foot in the air does not count.
    pub fn support(&self) -> Support {
        Support::of_estimate(&self.design.robot, self.estimate)
    }

    /// The [`margin`](Self::margin) for another state of the COM (m and m/s, world frame), for example the true one.
    pub fn margin_at(&self, com: Point2<f64>, com_vel: Vector2<f64>) -> f64 {
        self.supervisor.margin_at(com, com_vel)
    }

    /// For pictures: the slice of each gain's CPI set over COM positions, at the COM velocity and ZMP when the robot
    /// last stood, from slow to fast. Each is a list of corners (m, world), empty where the set contains no such state.
    pub fn slices(&self) -> Vec<Vec<Point2<f64>>> {
        self.supervisor.slices()
    }
}
