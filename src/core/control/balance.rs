//! Decides from the estimate whether to stand or to step (paper, Fig. 5).

use super::account::{Account, Phase};
use super::body::{Body, SoleReference, carry};
use super::design::Design;
use super::estimate::{Estimate, Estimator};
use super::stand::{Supervisor, Support};
use super::step::{Footwork, Landing, LastLanding, StepState, Swing, footwork};
use crate::lipm::catching::Departures;
use crate::robot::{Foot, PerFoot};
use crate::socket::{Command, TickError};
use nalgebra::{Point2, Vector2};
use std::sync::Arc;

/// Standing rule, footwork rule and body, without the estimator, which is the only writer of the estimate.
#[derive(Debug, Clone)]
pub struct Balance {
    design: Arc<Design>,
    supervisor: Supervisor,
    body: Body,
    footwork: Option<Box<dyn Footwork>>,
    /// The footwork rule of another gain set, which takes over when the foot in the air has landed.
    next_footwork: Option<Option<Box<dyn Footwork>>>,
    /// The footstep in the air.
    swing: Option<Swing>,
    last_landing: Option<LastLanding>,
    /// Time for which the state has been in no CPI set while no foot was in the air (s). It is 0 at the first such
    /// tick.
    out_of_sets_s: Option<f64>,
    /// Desired ZMP, world frame (m).
    zmp_ref: Point2<f64>,
    switches: u32,
}

impl Balance {
    /// Starts at rest in the state of `start`.
    pub fn new(design: Arc<Design>, start: &Estimate) -> Self {
        Self {
            supervisor: Supervisor::new(&design.family, start.com_xy()),
            body: Body::new(&design.robot, &design.units, start),
            footwork: footwork(&design),
            next_footwork: None,
            swing: None,
            last_landing: None,
            out_of_sets_s: None,
            zmp_ref: start.com_xy(),
            switches: 0,
            design,
        }
    }

    /// Continues from the present state with the gain set of another design for the same robot. If a foot is in the
    /// air, the footwork rule that lifted it leads it to its landing first.
    pub fn switch_to(&mut self, design: Arc<Design>) {
        self.supervisor = Supervisor::new(&design.family, self.zmp_ref);
        self.supervisor.start_anew(self.zmp_ref);
        match &self.swing {
            Some(_) => self.next_footwork = Some(footwork(&design)),
            None => self.footwork = footwork(&design),
        }
        self.out_of_sets_s = None;
        self.design = design;
    }

    /// Adds `probe` (m, world frame) to the ZMP that the acting gain asks for, without changing the gain's own state.
    /// This serves to measure how the ZMP follows.
    pub fn probe_zmp(&mut self, probe: Vector2<f64>) {
        self.supervisor.zmp_probe = probe;
    }

    /// Makes the first footsteps depart from the footwork rule.
    pub fn depart(&mut self, departures: &Departures) {
        if let Some(footwork) = &mut self.footwork {
            footwork.depart(departures);
        }
    }

    pub fn in_air(&self) -> Option<Foot> {
        self.swing.as_ref().map(|swing| swing.footstep.foot)
    }

    /// The footstep in the air.
    pub fn swing(&self) -> Option<&Swing> {
        self.swing.as_ref()
    }

    /// Whether the state was in no gain's CPI set when the robot last stood, or a foot is in the air.
    pub fn has_left_sets(&self) -> bool {
        self.swing.is_some() || !self.supervisor.is_held()
    }

    /// Runs one tick: writes `command`, and tells `estimator` which foot has been lifted or has landed. It does not
    /// allocate. If the equations of motion have no solution it returns an error, and `command` may be half written.
    pub fn tick(
        &mut self,
        estimator: &mut Estimator,
        command: &mut Command,
    ) -> Result<(), TickError> {
        if let (Some(swing), Some(footwork)) = (&self.swing, &self.footwork) {
            match footwork.landing(estimator.now(), swing) {
                Some(landing) => self.land(landing, estimator),
                None => return self.swing_on(estimator.now(), command),
            }
        }
        self.stand(estimator, command)
    }

    /// What the controller did at the last tick, for the `estimate` that it used.
    pub fn account<'a>(&'a self, estimate: &'a Estimate) -> Account<'a> {
        let phase = match self.in_air() {
            Some(foot) => Phase::Swing(foot),
            None if self.supervisor.is_held() => Phase::Switching,
            None => Phase::OutOfSets,
        };
        Account {
            phase,
            estimate,
            zmp_ref: self.zmp_ref,
            gain: self.supervisor.gain,
            margin: self.supervisor.margin,
            switches: self.switches,
            swing: self.swing.as_ref(),
            posture_ref: self.body.posture(),
            design: &self.design,
            supervisor: &self.supervisor,
        }
    }

    /// Applies switching control (Sect. III.D). When the state is in no CPI set, it asks the footwork rule, if there is
    /// one, for a footstep (Sect. V).
    fn stand(&mut self, estimator: &mut Estimator, command: &mut Command) -> Result<(), TickError> {
        let Design { family, robot, .. } = &*self.design;
        let estimate = estimator.now();
        let (com, dt) = (estimate.com_xy(), family.pendulum.dt);
        let now = StepState {
            design: &self.design,
            estimate,
            zmp_error: Vector2::zeros(),
            out_of_sets_s: 0.0,
            last_landing: self.last_landing,
        };
        let lean = self.footwork.as_mut().map_or(Vector2::zeros(), |rule| {
            rule.lean(&now, self.supervisor.margin)
        });
        let poses = self
            .footwork
            .as_ref()
            .map_or(estimate.footholds, |rule| rule.standing_soles(&now));
        let support = Support::of_leaning(robot, estimate, lean);
        let decision = self
            .supervisor
            .update(family, &support, com, estimate.com_vel_xy());
        self.zmp_ref = decision.zmp.unwrap_or(self.zmp_ref);
        self.out_of_sets_s = (!decision.held).then(|| self.out_of_sets_s.map_or(0.0, |s| s + dt));
        let cause = self
            .out_of_sets_s
            .map(|out_of_sets_s| (self.supervisor.zmp_error(), out_of_sets_s));
        let lifts = self.lift(estimator, cause);
        let estimate = estimator.now();
        if lifts {
            return self.swing_on(estimate, command);
        }
        if let Some(landing) = &mut self.last_landing {
            landing.ago_s += dt;
        }
        self.switches += u32::from(decision.starts);
        // The impact of the last landing may not be over yet.
        let is_landing = self
            .last_landing
            .zip(self.footwork.as_ref())
            .is_some_and(|(landing, footwork)| landing.ago_s < footwork.impact_s(&self.design));
        let Self { design, body, .. } = self;
        let Design { family, robot, .. } = &**design;
        body.com.height = [design.units.length_m, 0.0, 0.0];
        // In flight there is no ZMP and no pendulum, and an impact changes the velocity: the reference stays at the
        // estimate.
        if decision.starts || is_landing || support.polygon.is_none() {
            body.com.start(estimate);
        }
        let mut acceleration = body.com.advance(&family.pendulum, estimate, self.zmp_ref);
        if decision.held {
            body.com
                .make_up_for_sag(&family.pendulum, design.units.length_m, com);
        }
        // A reference that cannot be followed is not set: the legs keep the COM above the middle of the feet, and the
        // ZMP follows.
        if design.is_rigid_sideways && estimate.in_contact.left && estimate.in_contact.right {
            let sideways = support.frame.rotation * Vector2::y();
            let across = |v: Vector2<f64>| sideways * v.dot(&sideways);
            body.com.place -=
                across(body.com.place - Point2::from(support.frame.translation.vector));
            body.com.vel -= across(body.com.vel);
            acceleration -= across(acceleration);
            self.zmp_ref += across(estimate.zmp - self.zmp_ref);
        }
        let soles = SoleReference {
            poses,
            velocities: PerFoot::default(),
        };
        body.follow(robot, &family.pendulum, estimate, soles, 0.0, command);
        carry(
            robot,
            estimate,
            &estimate.in_contact,
            self.zmp_ref,
            acceleration,
            &mut command.tau_ff,
        );
        Ok(())
    }

    /// Lifts a foot for an imposed ZMP error (m, control frame) that does not come from the state, as in the paper's
    /// Sect. V.C. Returns false if the footwork rule finds no footstep for it.
    pub fn lift_for(&mut self, estimator: &mut Estimator, zmp_error: Vector2<f64>) -> bool {
        self.lift(estimator, Some((zmp_error, f64::INFINITY)))
    }

    /// Begins the footstep, if any, that the footwork rule returns, for a ZMP error and the time for which the state has
    /// been in no CPI set, or at ease. Returns whether there is one.
    fn lift(&mut self, estimator: &mut Estimator, cause: Option<(Vector2<f64>, f64)>) -> bool {
        let Some(footwork) = &mut self.footwork else {
            return false;
        };
        let (zmp_error, out_of_sets_s) = cause.unwrap_or_default();
        let now = StepState {
            design: &self.design,
            estimate: estimator.now(),
            zmp_error,
            out_of_sets_s,
            last_landing: self.last_landing,
        };
        self.swing = match cause {
            Some(_) => footwork.lift(&now, &mut self.body),
            None => footwork.lift_at_ease(&now, &mut self.body),
        };
        if let Some(swing) = &self.swing {
            estimator.lift(swing.footstep.foot);
        }
        self.swing.is_some()
    }

    /// Runs a tick with a foot in the air.
    fn swing_on(&mut self, estimate: &Estimate, command: &mut Command) -> Result<(), TickError> {
        let (Some(swing), Some(footwork)) = (&mut self.swing, &mut self.footwork) else {
            return Ok(());
        };
        swing.time_s += self.design.family.pendulum.dt;
        let now = StepState {
            design: &self.design,
            estimate,
            zmp_error: swing.footstep.zmp_error,
            out_of_sets_s: 0.0,
            last_landing: self.last_landing,
        };
        self.zmp_ref = footwork.swing(&now, swing, &mut self.body, command)?;
        Ok(())
    }

    /// Ends the footstep. The standing rule continues from the present state.
    fn land(&mut self, landing: Landing, estimator: &mut Estimator) {
        let Some(foot) = self.in_air() else { return };
        self.swing = None;
        self.supervisor.start_anew(self.zmp_ref);
        estimator.land(foot, landing == Landing::OnGround);
        self.last_landing = Some(LastLanding { foot, ago_s: 0.0 });
        self.out_of_sets_s = None;
        if let Some(next) = self.next_footwork.take() {
            self.footwork = next;
        }
    }
}
