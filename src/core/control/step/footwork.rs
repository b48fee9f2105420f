//! The life cycle of a footwork rule, and the state from which it decides.

use super::swing::Swing;
use crate::control::body::Body;
use crate::control::design::Design;
use crate::control::estimate::Estimate;
use crate::control::stand::Support;
use crate::lipm::catching::Departures;
use crate::robot::{Foot, PerFoot, Pose};
use crate::socket::{Command, TickError};
use nalgebra::{Point2, Vector2};
use std::fmt::Debug;

/// A footwork rule. How a rule leads a foot through the air is its own matter.
pub trait Footwork: Debug + Send + Sync {
    /// A copy that continues from the present state.
    fn copy(&self) -> Box<dyn Footwork>;

    /// Makes the first footsteps depart from the rule. A rule that cannot depart ignores the call.
    fn depart(&mut self, _departures: &Departures) {}

    /// Returns the footstep to begin now, if any. It is called at every tick with the state in no CPI set and no foot
    /// in the air.
    fn lift(&mut self, now: &StepState, body: &mut Body) -> Option<Swing>;

    /// Desired place of the COM of a robot that stands, from the point midway between its feet (m, world frame). It is
    /// called at every tick with no foot in the air. `margin` is the margin of the state in the slowest gain's CPI set.
    fn lean(&mut self, _now: &StepState, _margin: f64) -> Vector2<f64> {
        Vector2::zeros()
    }

    /// Returns the footstep that a robot at ease is to begin now, if any. It is called at every tick with the state in
    /// a CPI set and no foot in the air.
    fn lift_at_ease(&mut self, _now: &StepState, _body: &mut Body) -> Option<Swing> {
        None
    }

    /// Runs a tick with a foot in the air: moves `body`, writes the command, and may change where `swing` lands.
    /// Returns the desired ZMP (m, world frame). Fails if the equations of motion have no solution.
    fn swing(
        &mut self,
        now: &StepState,
        swing: &mut Swing,
        body: &mut Body,
        command: &mut Command,
    ) -> Result<Point2<f64>, TickError>;

    /// Time after a landing during which the COM reference follows the estimate (s).
    fn impact_s(&self, _design: &Design) -> f64 {
        0.0
    }

    /// Poses to which the soles are led while no foot swings (world frame).
    fn standing_soles(&self, now: &StepState) -> PerFoot<Pose> {
        now.estimate.footholds
    }

    /// How the swing ends at this tick; None if it goes on.
    fn landing(&self, now: &Estimate, swing: &Swing) -> Option<Landing> {
        if swing.has_landed(now.load_n[swing.footstep.foot] > now.contact_load_n[0]) {
            Some(Landing::OnGround)
        } else {
            swing.is_overdue().then_some(Landing::GivenUp)
        }
    }
}

impl Clone for Box<dyn Footwork> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// How a swing ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Landing {
    /// The foot carries load.
    OnGround,
    /// The foot is so late that the swing ends without a landing. Its contact may be detected later.
    GivenUp,
}

/// The state from which a footwork rule decides.
#[derive(Debug, Clone, Copy)]
pub struct StepState<'a> {
    pub design: &'a Design,
    pub estimate: &'a Estimate,
    /// The slowest gain's ZMP error, Delta p_Z in the paper (m), control frame.
    pub zmp_error: Vector2<f64>,
    /// Time for which the state has been in no CPI set (s).
    pub out_of_sets_s: f64,
    /// None before the first footstep.
    pub last_landing: Option<LastLanding>,
}

/// The foot that landed last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastLanding {
    pub foot: Foot,
    /// Time for which the robot has stood since the landing (s); 0 in the tick of the landing itself.
    pub ago_s: f64,
}

impl StepState<'_> {
    /// The support of the robot.
    pub(super) fn support(&self) -> Support {
        Support::of_estimate(&self.design.robot, self.estimate)
    }

    /// Whether the state has been in no CPI set for `patience_s` (s), and the last landing is `pause_s` (s) ago.
    pub(super) fn has_waited(&self, patience_s: f64, pause_s: f64) -> bool {
        let stands = self
            .last_landing
            .is_none_or(|landing| landing.ago_s > 0.0 && self.has_passed(landing.ago_s, pause_s));
        stands && self.has_passed(self.out_of_sets_s, patience_s)
    }

    /// Whether `elapsed_s`, a sum of control periods, has reached `time_s` (s).
    pub(super) fn has_passed(&self, elapsed_s: f64, time_s: f64) -> bool {
        elapsed_s >= time_s - 0.5 * self.design.family.pendulum.dt
    }
}
