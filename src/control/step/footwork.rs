//! The life cycle of a footwork rule, and what it goes by.

use super::swing::Swing;
use crate::control::body::Body;
use crate::control::design::Design;
use crate::control::error::TickError;
use crate::control::estimate::Estimate;
use crate::control::stand::Support;
use crate::robot::{Command, Foot};
use nalgebra::{Point2, Vector2};
use std::fmt::Debug;

/// A footwork rule; how it leads the foot that is in the air is its own.
pub trait Footwork: Debug + Send + Sync {
    /// Asked at every tick at which no set holds the state and no foot is in the air: the footstep to begin with, if any.
    fn lift(&mut self, now: &StepState, body: &mut Body) -> Option<Swing>;

    /// A tick with a foot in the air: moves `body`, may lead `swing` elsewhere, and writes the command. Returns the wanted ZMP,
    /// world (m). Errors: the equations of the body have no solution.
    fn swing(
        &mut self,
        now: &StepState,
        swing: &mut Swing,
        body: &mut Body,
        command: &mut Command,
    ) -> Result<Point2<f64>, TickError>;

    /// Whether the foot has landed, or is not waited for any more; None: neither.
    fn landing(&self, now: &Estimate, swing: &Swing) -> Option<Landing> {
        if swing.has_landed(now.load_n[swing.footstep.foot]) {
            Some(Landing::OnGround)
        } else {
            swing.is_overdue().then_some(Landing::GivenUp)
        }
    }
}

/// How a swing ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Landing {
    /// The foot carries.
    OnGround,
    /// It is late for good: a contact may tell where it is.
    GivenUp,
}

/// What a footwork rule goes by.
#[derive(Debug, Clone, Copy)]
pub struct StepState<'a> {
    pub design: &'a Design,
    pub estimate: &'a Estimate,
    /// The ZMP error of the slowest gain Delta p_Z (m), control frame.
    pub zmp_error: Vector2<f64>,
    /// For how long no set has held the state (s).
    pub out_of_sets_s: f64,
    /// None before the first footstep.
    pub last_landing: Option<LastLanding>,
}

/// The foot that landed last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastLanding {
    pub foot: Foot,
    /// For how long the robot has stood since (s); 0 in the tick of the landing, which belongs to the footstep that ends.
    pub ago_s: f64,
}

impl StepState<'_> {
    /// What the robot stands on.
    pub(super) fn support(&self) -> Support {
        Support::of_estimate(&self.design.robot, self.estimate)
    }

    /// Whether no set has held the state for `patience_s`, and the last landing is `pause_s` ago (s).
    pub(super) fn has_waited(&self, patience_s: f64, pause_s: f64) -> bool {
        let stands =
            self.last_landing.is_none_or(|landing| landing.ago_s > 0.0 && self.has_passed(landing.ago_s, pause_s));
        stands && self.has_passed(self.out_of_sets_s, patience_s)
    }

    /// Whether `time_s` is over after `elapsed_s`, a sum of ticks.
    pub(super) fn has_passed(&self, elapsed_s: f64, time_s: f64) -> bool {
        elapsed_s >= time_s - 0.5 * self.design.family.pendulum.dt
    }
}
