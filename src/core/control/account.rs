//! The controller's decision at a tick, and its reason. Traces, films, the window and the referee read it.

use super::design::Design;
use super::estimate::Estimate;
use super::stand::{Supervisor, Support};
use super::step::Swing;
use crate::robot::{Foot, Posture};
use crate::socket::{Airborne, Report};
use nalgebra::{Point2, Vector2};

/// The activity of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
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
    /// Index of the acting gain, from slow to fast. With a foot in the air, it is the index of the last acting gain.
    pub gain: usize,
    /// Margin of the state in the slowest gain's CPI set, which is the largest set, when the robot last stood. It is
    /// negative when no CPI set contains the state (eq. 26), and negative infinity when there is no CPI set.
    pub margin: f64,
    /// Number of times that a gain has been started from the estimated state.
    pub switches: u32,
    /// The footstep in the air.
    pub swing: Option<&'a Swing>,
    /// The posture from inverse kinematics to which the body is sent.
    pub posture_ref: &'a Posture,
    pub(super) design: &'a Design,
    pub(super) supervisor: &'a Supervisor,
}

impl<'a> Account<'a> {
    /// The account for readers that know no CPI sets.
    pub fn report(&self) -> Report<'a> {
        let (estimate, stands) = (self.estimate, self.stands());
        Report {
            phase: self.phase.name(),
            base: Some(estimate.posture.base),
            com: Some(estimate.com),
            com_vel: Some(estimate.com_vel),
            zmp: Some(estimate.zmp),
            zmp_ref: Some(self.zmp_ref),
            footstep: self.swing.map(|swing| Airborne {
                foot: swing.footstep.foot,
                landing: swing.to,
            }),
            zmp_error: self.swing.map(|swing| swing.footstep.zmp_error),
            gain: Some(self.gain_name()),
            cpi_margin: stands.then_some(self.margin),
            in_cpi_set: stands.then_some(self.phase == Phase::Switching),
            gain_switches: Some(self.switches),
            ..Report::default()
        }
    }

    /// Whether the robot stands, with no foot being moved. Only then do the CPI sets belong to the present support.
    pub fn stands(&self) -> bool {
        self.swing.is_none()
    }

    /// Name of the acting gain.
    pub fn gain_name(&self) -> &'a str {
        &self.design.family.gains[self.gain].name
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
    /// last stood, from slow to fast. Each is a list of corners (m, world), empty where the CPI set contains no such
    /// state.
    pub fn slices(&self) -> Vec<Vec<Point2<f64>>> {
        self.supervisor.slices()
    }
}
