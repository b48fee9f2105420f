//! The controller: estimate, support, supervisor, whole body (paper, Fig. 11). It sees
//! [`Sensed`] and answers with a [`Command`]; it never names the simulation.
//!
//! One tick: [`Estimator`] (COM, its velocity, ZMP, contact) -> [`Support`] (polygon and control frame) ->
//! [`Supervisor`] (gain and wanted ZMP) -> COM reference -> [`WholeBody`] (joint targets) and [`load`] (their
//! feed-forward). When no set holds the state, [`footstep`] chooses a foot and its landing place, and until it lands the
//! plan of [`swing`] takes the place of supervisor and COM reference.

pub mod catch;
pub mod estimator;
pub mod footstep;
pub mod inverse_dynamics;
pub mod kalman;
pub mod load;
pub mod nnls;
pub mod supervisor;
pub mod support;
pub mod swing;
pub mod whole_body;

use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::nesting_warning;
use crate::lipm::gains::{GainFamily, GainSet, Standing};
use crate::lipm::pendulum::Pendulum;
use crate::lipm::stepping::Stepping;
use crate::robot::dynamics::load_torques;
use crate::robot::{Command, Foot, GRAVITY, Kinematics, PerFoot, Pose, Posture, Robot, Sensed};
use estimator::Estimator;
use footstep::Necessity;
use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};
use supervisor::Supervisor;
use support::Support;
use swing::{Lift, Swing};
use whole_body::{Task, WholeBody};

/// A gain set made ready for a robot: what all episodes share.
#[derive(Debug, Clone)]
pub struct Design {
    pub family: GainFamily,
    /// Says which gains do not nest on the home support; None when all do.
    pub warning: Option<String>,
    /// Joint targets at home with the torques that carry the weight there.
    home: Command,
    com_height: f64,
    /// From the right sole's centre to the left's at home (m), control frame.
    stance: Vector2<f64>,
}

impl Design {
    /// Designs the feedback and searches the sets on the home support (to check that they nest).
    pub fn new(robot: &Robot, gains: &GainSet, control_period_s: f64) -> Result<Self> {
        let pendulum = Pendulum { omega: robot.omega(), dt: control_period_s };
        let family = GainFamily::design(gains, pendulum)?;
        let polygon = family.allowed_support(&home_polygon(robot), &gains.name)?;
        let warning = if family.gains.len() > 1 { nesting_warning(&family, &polygon)? } else { None };
        let footholds = home_footholds(robot, &home_kinematics(robot));
        let stance = (footholds.left.translation.vector - footholds.right.translation.vector).xy();
        if let Some(rules) = &family.stepping {
            check_stepping(rules, stance, control_period_s, &gains.name)?;
        }
        Ok(Self { family, warning, home: home_command(robot), com_height: robot.home_com_height(), stance })
    }

    /// The same, but footsteps start at the first tick at which no set holds the state.
    pub fn without_patience(&self) -> Self {
        let mut design = self.clone();
        design.family.stepping.iter_mut().for_each(|stepping| stepping.patience_s = 0.0);
        design
    }

    /// The command that holds the home posture.
    pub fn home_command(&self) -> &Command {
        &self.home
    }
}

/// What the rules of a footstep must be for this robot and period.
fn check_stepping(rules: &Stepping, stance: Vector2<f64>, control_period_s: f64, file: &str) -> Result<()> {
    let range = &rules.range;
    if !(range.least_m..=range.outward_m).contains(&stance.y) {
        let value = format!("{} to {} m to the side", range.least_m, range.outward_m);
        let accepted = format!("least_m and outward_m around the distance of its soles, {:.4} m", stance.y);
        return Err(Error::value(file, "stepping.range", value, "does not hold the robot's stance at home", accepted));
    }
    let least = SHORTEST_SWING_TICKS * control_period_s;
    if rules.swing_time_s < least {
        let accepted = format!("{SHORTEST_SWING_TICKS} control periods, {least} s, or more");
        return Err(Error::value(file, "stepping.swing_time_s", rules.swing_time_s, "is too short", accepted));
    }
    Ok(())
}

/// A foot is moved over this many ticks at least.
const SHORTEST_SWING_TICKS: f64 = 10.0;

const BOTH_FEET: PerFoot<bool> = PerFoot { left: true, right: true };

/// Support polygon of both soles at home, control frame.
pub fn home_polygon(robot: &Robot) -> SupportPolygon {
    let footholds = home_footholds(robot, &home_kinematics(robot));
    Support::of(robot, &footholds, &BOTH_FEET)
        .polygon
        .expect("loading a robot checks that its soles are flat and apart")
}

fn home_kinematics(robot: &Robot) -> Kinematics {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &robot.home_posture());
    kinematics
}

fn home_footholds(robot: &Robot, at_home: &Kinematics) -> PerFoot<Pose> {
    PerFoot::from_fn(|foot| at_home.sole_pose(robot, foot))
}

fn home_command(robot: &Robot) -> Command {
    let kinematics = home_kinematics(robot);
    let weight = Vector3::new(0.0, 0.0, robot.mass() * GRAVITY);
    let footholds = home_footholds(robot, &kinematics);
    let wrenches = load::share(robot, &footholds, &BOTH_FEET, kinematics.com().xy(), weight);
    let mut tau_ff = vec![0.0; robot.joints.len()];
    load_torques(&kinematics, robot, -weight / robot.mass(), &wrenches, &mut tau_ff);
    Command { q_ref: robot.home_rad.clone(), dq_ref: vec![0.0; robot.joints.len()], tau_ff }
}

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
    inverse_dynamics: inverse_dynamics::InverseDynamics,
    mode: u32,
    /// Joints as the whole body's dynamics have them: angle, velocity.
    joints: Option<[Vec<f64>; 2]>,
    gyro_world: Vector3<f64>,
    /// The posture at landing.
    ahead: WholeBody,
    /// Height of the COM while a foot is in the air: state, and until when.
    height: [f64; 3],
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
            inverse_dynamics: inverse_dynamics::InverseDynamics::new(
                robot,
                inverse_dynamics::Grip { friction: 0.6, sole_share: 0.98 },
            ),
            joints: None,
            gyro_world: Vector3::zeros(),
            ahead: WholeBody::new(robot),
            height: [design.com_height, 0.0, 0.0],
            mode: std::env::var("WBC").map_or(2, |v| v.parse().unwrap()),
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

    /// One control tick.
    pub fn tick(&mut self, sensed: &Sensed) -> Command {
        self.estimator.update(self.robot, sensed);
        self.gyro_world = sensed.imu.orientation * sensed.imu.gyro;
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
        if !decision.held && self.is_time_to_step() && self.lift(self.supervisor.zmp_error()) {
            return self.swing_on();
        }
        if self.try_to_catch() {
            return self.swing_on();
        }
        self.since_landing_s += dt;
        self.height = [self.design.com_height, 0.0, 0.0];
        if decision.starts {
            self.switches += 1;
        }
        // In flight there is no ZMP and no pendulum: the reference waits at the estimate.
        if decision.starts || self.support.polygon.is_none() {
            self.com_ref = com;
            self.com_ref_vel = com_vel;
        }
        let acceleration = family.pendulum.com_acc(com, self.supervisor.zmp_ref);
        self.com_ref += self.com_ref_vel * dt + acceleration * (0.5 * dt * dt);
        self.com_ref_vel += acceleration * dt;
        self.com_ref += (com - self.com_ref) * (FORGETTING_RATE * dt);
        self.com_ref_vel += (com_vel - self.com_ref_vel) * (FORGETTING_RATE * dt);
        if decision.held {
            self.shaping += (self.com_ref - com) * (SHAPING_RATE * dt);
            self.shaping = self.shaping.cap_magnitude(MOST_SHAPING_M);
        }
        let estimate = &self.estimator.now;
        self.body_command(acceleration, estimate.footholds, PerFoot::default(), estimate.in_contact)
    }

    /// Whether the gain set steps, and has waited for as long as it wants to.
    fn is_time_to_step(&self) -> bool {
        let Some(rules) = &self.design.family.stepping else { return false };
        let out_of_sets = self.out_of_sets_s.is_some_and(|s| self.has_passed(s, rules.patience_s));
        // The tick of a landing belongs to the footstep that ends.
        out_of_sets && self.since_landing_s > 0.0 && self.has_passed(self.since_landing_s, rules.pause_s)
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

    /// While a foot is in the air the plan is followed; nothing is stabilised, as in the paper.
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
        self.supervisor.start_anew(swing.pendulum().map_or(self.supervisor.zmp_ref, |p| p.zmp));
        self.estimator.land(has_landed);
        self.landed = Some(swing.footstep.foot);
        self.swing = None;
        self.out_of_sets_s = None;
        self.since_landing_s = 0.0;
        true
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
        let shaped = self.com_ref + self.shaping;
        let task = Task {
            com: Point3::new(shaped.x, shaped.y, self.height[0]),
            rise: RISING_M_S * self.design.family.pendulum.dt,
            com_vel: Vector3::new(self.com_ref_vel.x, self.com_ref_vel.y, self.height[1]),
            soles: soles.clone(),
            sole_vel: sole_vel.clone(),
            trunk: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.support.frame.rotation.angle()),
        };
        self.whole_body.follow(robot, &task);
        let effective = Vector3::new(-acceleration.x, -acceleration.y, -GRAVITY);
        let force = -effective * robot.mass();
        let footholds = &self.estimator.now.footholds;
        let wrenches = load::share(robot, footholds, &standing, self.supervisor.zmp_ref, force);
        let mut tau_ff = vec![0.0; robot.joints.len()];
        load_torques(self.estimator.kinematics(), robot, effective, &wrenches, &mut tau_ff);
        let in_swing = self.swing.is_some();
        if self.design.family.catching.is_some() && (in_swing && self.mode == 3 || self.mode == 13) {
            return self.dynamic_command(acceleration, &soles, &sole_vel, standing);
        }
        self.joints = None;
        if self.design.family.catching.is_some() && (self.mode >= 10 || self.mode > 0 && in_swing) {
            let mut wanted = inverse_dynamics::Wanted::rest(robot, standing);
            wanted.com_acc = Vector3::new(acceleration.x, acceleration.y, self.height[2]);
            if let Some(swing) = &self.swing {
                wanted.sole_acc[swing.footstep.foot][0] = swing.sole_acc();
            }
            let posture = if self.mode % 10 == 2 { &self.estimator.now.posture } else { &self.whole_body.posture };
            self.inverse_dynamics.solve(robot, posture, &self.whole_body.velocity, &wanted);
            tau_ff.copy_from_slice(&self.inverse_dynamics.tau);
        }
        Command {
            q_ref: self.whole_body.posture.q.clone(),
            dq_ref: self.whole_body.velocity.as_slice()[6..].to_vec(),
            tau_ff,
        }
    }
}

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
