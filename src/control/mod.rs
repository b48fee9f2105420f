//! The controller: estimate, support, supervisor, whole body (paper, Fig. 11). It sees
//! [`Sensed`] and answers with a [`Command`]; it never names the simulation.
//!
//! One tick: [`Estimator`] (COM, its velocity, ZMP, contact) -> [`Support`] (polygon and control frame) ->
//! [`Supervisor`] (gain and wanted ZMP) -> COM reference -> [`WholeBody`] (joint targets) and [`load`] (their
//! feed-forward). When no set holds the state a foot is lifted. In the paper [`footstep`] chooses it and its landing place,
//! and until it lands the plan of [`swing`] takes the place of supervisor and COM reference. A set that catches plans both at
//! every tick (`catch`), with the torques of [`inverse_dynamics`].

mod catch;
mod design;
pub mod estimator;
pub mod footstep;
pub mod inverse_dynamics;
pub mod kalman;
pub mod load;
pub mod nnls;
mod quintic;
pub mod supervisor;
pub mod support;
pub mod swing;
pub mod whole_body;

use crate::lipm::gains::Standing;
use crate::lipm::pendulum::Pendulum;
use crate::robot::dynamics::load_torques;
use crate::robot::{Command, Foot, GRAVITY, PerFoot, Pose, Posture, Robot, Sensed};
use catch::Height;
pub use design::{Design, home_polygon};
use estimator::Estimator;
use footstep::Necessity;
use inverse_dynamics::{Grip, InverseDynamics};
use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};
use supervisor::Supervisor;
use support::Support;
use swing::{Lift, Swing};
use whole_body::{Task, WholeBody};

/// What the controller is doing, for trace and view.
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

/// The controller of one episode.
pub struct Controller<'a> {
    robot: &'a Robot,
    design: &'a Design,
    pub estimator: Estimator,
    pub supervisor: Supervisor,
    pub support: Support,
    whole_body: WholeBody,
    pub phase: Phase,
    /// The footstep in the air.
    pub swing: Option<Swing>,
    /// For how long no set has held the state while no foot was in the air (s); 0 at the first such tick.
    out_of_sets_s: Option<f64>,
    /// The foot that landed last, and since when it stands (s).
    landed: Option<Foot>,
    since_landing_s: f64,
    /// COM reference over the ground and its velocity (world): integrated from eq. 1 and 2, started from the estimate at
    /// every switch and, other than in the paper, drawn back to it in between (`FORGETTING_RATE`).
    com_ref: Point2<f64>,
    com_ref_vel: Vector2<f64>,
    /// Added to the COM reference: makes up for sag (paper, "COG reference shaping").
    shaping: Vector2<f64>,
    pub switches: u32,
    inverse_dynamics: InverseDynamics,
    height: Height,
}

impl<'a> Controller<'a> {
    /// At home, at rest.
    pub fn new(robot: &'a Robot, design: &'a Design) -> Self {
        let estimator = Estimator::new(robot, &design.family.pendulum);
        let support = Support::of_estimate(robot, &estimator.now);
        let com = estimator.now.com_xy();
        Self {
            robot,
            design,
            supervisor: Supervisor::new(&design.family, com),
            support,
            whole_body: WholeBody::new(robot),
            phase: Phase::Posture,
            swing: None,
            out_of_sets_s: None,
            landed: None,
            since_landing_s: f64::INFINITY,
            com_ref: com,
            com_ref_vel: Vector2::zeros(),
            shaping: Vector2::zeros(),
            switches: 0,
            inverse_dynamics: InverseDynamics::new(
                robot,
                Grip { friction: GRIP * robot.friction, sole_share: SOLE_SHARE },
            ),
            height: Height::new(robot, design.com_height),
            estimator,
        }
    }

    /// Name of the gain that acts; None where the gain set has none.
    pub fn acting_gain(&self) -> Option<&str> {
        self.design.family.gains.get(self.supervisor.gain).map(|gain| gain.name.as_str())
    }

    /// Where the body is sent: the posture of the inverse kinematics.
    pub fn posture(&self) -> &Posture {
        &self.whole_body.posture
    }

    /// Goes on with the gain set of another design for the same robot, from the state reached. A foot in the air lands as it
    /// was planned; one that was led by catching, of which the new set knows nothing, is left to the standing rule.
    pub fn switch_to(&mut self, design: &'a Design) {
        let zmp = self.supervisor.zmp_ref;
        let is_led = self.swing.as_ref().is_some_and(|swing| swing.pendulum().is_none());
        if is_led && design.family.catching.is_none() {
            self.end_swing(false);
        }
        self.supervisor = Supervisor::new(&design.family, zmp);
        self.supervisor.start_anew(zmp);
        self.design = design;
        (self.phase, self.out_of_sets_s) = (Phase::Posture, None);
    }

    /// One control tick.
    pub fn tick(&mut self, sensed: &Sensed) -> Command {
        self.estimator.update(self.robot, sensed);
        self.act()
    }

    /// What follows from the estimate (paper, Fig. 5): stand, or step and stand again.
    pub fn act(&mut self) -> Command {
        let in_air = self.swing.is_some() && !self.try_to_land();
        self.support = Support::of_estimate(self.robot, &self.estimator.now);
        if in_air {
            return self.swing_on();
        }
        match self.design.family.standing {
            Standing::Posture => self.hold(),
            Standing::Switching => self.stand(),
        }
    }

    /// Keeps the home posture. The wanted ZMP is shown as the one measured.
    fn hold(&mut self) -> Command {
        self.phase = Phase::Posture;
        self.supervisor.zmp_ref = self.estimator.now.zmp;
        self.design.home.clone()
    }

    /// Switching control (Sect. III.D); where no set holds the state, a footstep if the gain set takes any (Sect. V).
    fn stand(&mut self) -> Command {
        let (family, estimate) = (&self.design.family, &self.estimator.now);
        let (com, com_vel) = (estimate.com_xy(), estimate.com_vel_xy());
        let decision = self.supervisor.update(family, &self.support, com, com_vel);
        let Pendulum { dt, .. } = family.pendulum;
        self.phase = if decision.held { Phase::Switching } else { Phase::OutOfSets };
        self.out_of_sets_s = if decision.held { None } else { Some(self.out_of_sets_s.map_or(0.0, |s| s + dt)) };
        let steps = !decision.held && self.is_time_to_step();
        if steps && (self.lift(self.supervisor.zmp_error()) || self.try_to_catch()) {
            return self.swing_on();
        }
        self.since_landing_s += dt;
        self.height.now = [self.design.com_height, 0.0, 0.0];
        if decision.starts {
            self.switches += 1;
        }
        // In flight there is no ZMP and no pendulum: the reference waits at the estimate.
        if decision.starts || self.support.polygon.is_none() {
            self.start_reference();
        }
        let acceleration = self.move_reference();
        if decision.held {
            self.shaping += (self.com_ref - com) * (SHAPING_RATE * dt);
            self.shaping = self.shaping.cap_magnitude(MOST_SHAPING_M);
        }
        let estimate = &self.estimator.now;
        self.body_command(acceleration, estimate.footholds, PerFoot::default(), estimate.in_contact)
    }

    /// Starts the COM reference from the estimate.
    fn start_reference(&mut self) {
        self.com_ref = self.estimator.now.com_xy();
        self.com_ref_vel = self.estimator.now.com_vel_xy();
    }

    /// Moves the COM reference by a tick (eq. 1 and 2); returns the acceleration (m/s^2).
    fn move_reference(&mut self) -> Vector2<f64> {
        let (pendulum, dt) = (&self.design.family.pendulum, self.design.family.pendulum.dt);
        let (com, com_vel) = (self.estimator.now.com_xy(), self.estimator.now.com_vel_xy());
        let acceleration = pendulum.com_acc(com, self.supervisor.zmp_ref);
        self.com_ref += self.com_ref_vel * dt + acceleration * (0.5 * dt * dt);
        self.com_ref_vel += acceleration * dt;
        self.com_ref += (com - self.com_ref) * (FORGETTING_RATE * dt);
        self.com_ref_vel += (com_vel - self.com_ref_vel) * (FORGETTING_RATE * dt);
        acceleration
    }

    /// Whether the gain set steps, and has waited for as long as it wants to.
    fn is_time_to_step(&self) -> bool {
        let family = &self.design.family;
        let [patience_s, pause_s] = match (&family.stepping, &family.catching) {
            (Some(rules), _) => [rules.patience_s, rules.pause_s],
            (None, Some(rules)) => [0.0, rules.pause_s],
            (None, None) => return false,
        };
        let out_of_sets = self.out_of_sets_s.is_some_and(|s| self.has_passed(s, patience_s));
        // The tick of a landing belongs to the footstep that ends.
        out_of_sets && self.since_landing_s > 0.0 && self.has_passed(self.since_landing_s, pause_s)
    }

    /// Whether `time_s` is over after `elapsed_s`, a sum of ticks.
    fn has_passed(&self, elapsed_s: f64, time_s: f64) -> bool {
        elapsed_s >= time_s - 0.5 * self.design.family.pendulum.dt
    }

    /// Plans the footstep for a ZMP error (m, control frame) and starts it. False if the gain set takes none, or none
    /// leads that way, or only with the foot that has just landed.
    pub fn lift(&mut self, zmp_error: Vector2<f64>) -> bool {
        let (family, estimate) = (&self.design.family, &self.estimator.now);
        let Some(rules) = &family.stepping else { return false };
        let necessity = Necessity {
            frame: &self.support.frame,
            soles: PerFoot::from_fn(|foot| estimate.footholds[foot].translation.vector.xy().into()),
            stance: self.design.stance,
            zmp_error,
            load_n: estimate.load_n,
            can_lift: PerFoot::from_fn(|foot| estimate.in_contact[foot.other()]),
        };
        let Some(footstep) = footstep::choose(rules, &necessity) else { return false };
        if self.landed == Some(footstep.foot) && !self.has_passed(self.since_landing_s, rules.same_foot_pause_s) {
            return false;
        }
        let lift = Lift {
            com: estimate.com_xy(),
            com_vel: estimate.com_vel_xy(),
            footholds: estimate.footholds,
            zmp_margin: family.zmp_margin,
        };
        let stance_sole = &self.robot.soles[footstep.foot.other()];
        self.swing = Some(Swing::plan(family.pendulum.omega, rules, stance_sole, footstep, &lift));
        self.estimator.lift(footstep.foot);
        true
    }

    /// While a foot is in the air a plan of the paper is followed, and nothing stabilised; a footstep that catches is
    /// planned anew.
    fn swing_on(&mut self) -> Command {
        let Some(swing) = &mut self.swing else { return self.design.home.clone() };
        let family = &self.design.family;
        swing.time_s += family.pendulum.dt;
        let foot = swing.footstep.foot;
        self.phase = Phase::Swing(foot);
        let Some(pendulum) = swing.pendulum() else { return self.catch_on() };
        let (pose, velocity) = swing.sole();
        (self.com_ref, self.com_ref_vel) = (pendulum.com, pendulum.com_vel);
        self.supervisor.zmp_ref = pendulum.zmp;
        let acceleration = family.pendulum.com_acc(pendulum.com, pendulum.zmp);
        let (mut soles, mut sole_vel) = (self.estimator.now.footholds, PerFoot::default());
        (soles[foot], sole_vel[foot]) = (pose, velocity);
        let stance = PerFoot::from_fn(|f| f != foot);
        self.body_command(acceleration, soles, sole_vel, stance)
    }

    /// Ends the swing when the foot has landed, or is not going to: switching control goes on from the state reached.
    fn try_to_land(&mut self) -> bool {
        let Some(swing) = &self.swing else { return true };
        let has_landed = swing.has_landed(self.estimator.now.load_n[swing.footstep.foot]);
        if !has_landed && !swing.is_overdue() {
            return false;
        }
        self.end_swing(has_landed);
        true
    }

    fn end_swing(&mut self, has_landed: bool) {
        let Some(swing) = self.swing.take() else { return };
        self.supervisor.start_anew(swing.pendulum().map_or(self.supervisor.zmp_ref, |p| p.zmp));
        self.estimator.land(has_landed);
        self.landed = Some(swing.footstep.foot);
        self.out_of_sets_s = None;
        self.since_landing_s = 0.0;
    }

    /// Joint targets that carry the COM reference, with the torques of the wanted ZMP on the feet that stand.
    fn body_command(
        &mut self,
        acceleration: Vector2<f64>,
        soles: PerFoot<Pose>,
        sole_vel: PerFoot<Vector3<f64>>,
        standing: PerFoot<bool>,
    ) -> Command {
        let robot = self.robot;
        self.move_body(soles, sole_vel);
        let effective = Vector3::new(-acceleration.x, -acceleration.y, -GRAVITY);
        let force = -effective * robot.mass();
        let footholds = &self.estimator.now.footholds;
        let wrenches = load::share(robot, footholds, &standing, self.supervisor.zmp_ref, force);
        let mut tau_ff = vec![0.0; robot.joints.len()];
        load_torques(self.estimator.kinematics(), robot, effective, &wrenches, &mut tau_ff);
        self.command_with(tau_ff)
    }

    /// Moves the whole body's reference after the COM reference and the soles.
    fn move_body(&mut self, soles: PerFoot<Pose>, sole_vel: PerFoot<Vector3<f64>>) {
        let shaped = self.com_ref + self.shaping;
        let task = Task {
            com: Point3::new(shaped.x, shaped.y, self.height.now[0]),
            rise: RISING_M_S * self.design.family.pendulum.dt,
            com_vel: Vector3::new(self.com_ref_vel.x, self.com_ref_vel.y, self.height.now[1]),
            soles,
            sole_vel,
            trunk: upright(&self.support),
        };
        self.whole_body.follow(self.robot, &task);
    }

    /// The whole body's reference as joint targets, with these torques (N m) fed forward.
    fn command_with(&self, tau_ff: Vec<f64>) -> Command {
        let body = &self.whole_body;
        Command { q_ref: body.posture.q.clone(), dq_ref: body.velocity.as_slice()[6..].to_vec(), tau_ff }
    }
}

/// Orientation of an upright trunk that faces as the feet do.
fn upright(support: &Support) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), support.frame.rotation.angle())
}

/// Share of the friction, and of each sole's length and width, that inverse dynamics counts on.
const GRIP: f64 = 0.75;
const SOLE_SHARE: f64 = 0.98;
/// Rate at which the COM reference comes back to the estimate (1/s). Between switches the joints' stiffness pulls the
/// COM to a reference that does not know of pushes: with 0 that spring outlasts the push, tips the feet and rings. From
/// 7 to 20 the toppling impulses are the same to 0.06 N s; small pushes settle sooner with more, large ones with less.
const FORGETTING_RATE: f64 = 10.0;
/// Rate at which the COM reference is moved to make up for sag (1/s).
const SHAPING_RATE: f64 = 1.0;
/// Sag is some millimetres; what asks for more is not sag (m).
const MOST_SHAPING_M: f64 = 0.02;
/// The COM goes back up to its height at home no faster than this (m/s).
const RISING_M_S: f64 = 0.03;
