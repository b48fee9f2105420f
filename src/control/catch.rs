//! Footsteps that catch the robot: what the paper leaves out while a foot is in the air.
//!
//! A foot is lifted as soon as no set holds the state and the DCM is outside of the support: the one by which the DCM
//! will miss the support to be by least ([`plan`]). At every tick from then on the landing place and the ZMP are planned
//! anew from the estimate, so that both follow the DCM, and the torques are those of the moving body
//! ([`InverseDynamics`](super::inverse_dynamics::InverseDynamics)): a leg that swings in 0.14 s pushes the rest of the body
//! off its course.

use super::estimator::on_ground;
use super::footstep::Footstep;
use super::inverse_dynamics::Wanted;
use super::quintic::Quintic;
use super::swing::{Swing, Timing};
use super::whole_body::{Task, WholeBody};
use super::{Controller, Design, upright};
use crate::lipm::catching::{Catch, Catching, Means, plan};
use crate::robot::{Command, Foot, PerFoot, Robot};
use nalgebra::{Isometry2, Point2, Point3, Vector2, Vector3};

/// A foot that is late is planned for as if it were due in so many ticks.
const LATE_TICKS: f64 = 5.0;
/// Newton steps a tick towards the posture at landing, which moves with the landing place.
const AHEAD_STEPS: usize = 3;

/// Height of the COM while a foot is in the air. Where the feet will be far apart the legs reach only from lower: the body
/// sinks on the way. One that is pulled down by the leg at the end leaves the ground.
#[derive(Debug)]
pub(super) struct Height {
    /// Place, velocity and acceleration (m, m/s, m/s^2).
    pub now: [f64; 3],
    /// The posture at landing.
    ahead: WholeBody,
}

impl Height {
    pub fn new(robot: &Robot, height: f64) -> Self {
        Self { now: [height, 0.0, 0.0], ahead: WholeBody::new(robot) }
    }
}

impl Controller<'_> {
    /// Lifts the foot that catches best. False while the DCM is inside of the support, and without a foot to stand on.
    pub(super) fn try_to_catch(&mut self) -> bool {
        let Some(rules) = self.design.family.catching else { return false };
        let Some(polygon) = self.support.polygon else { return false };
        if polygon.contains(self.support.frame.inverse_transform_point(&self.dcm_in(0.0))) {
            return false;
        }
        let mut best: Option<(Foot, Isometry2<f64>, Catch)> = None;
        for foot in Foot::BOTH.into_iter().filter(|foot| self.estimator.now.in_contact[foot.other()]) {
            let estimate = &self.estimator.now;
            let stance = on_ground(&estimate.footholds[foot.other()]);
            let carried = (estimate.load_n[foot] / (estimate.load_n.left + estimate.load_n.right)).clamp(0.0, 1.0);
            let transfer_s = if carried.is_finite() { carried * rules.transfer_s } else { 0.0 };
            let means = self.means(foot);
            let dcm = to_side(foot, stance.inverse_transform_point(&self.dcm_in(transfer_s)));
            let catch = plan(&rules.weights, &means, dcm, rules.swing_time_s - transfer_s);
            if best.as_ref().is_none_or(|(.., least)| catch.cost < least.cost) {
                best = Some((foot, stance, catch));
            }
        }
        let Some((foot, stance, catch)) = best else { return false };
        let to = stance * Point2::from(to_side(foot, catch.place.into()));
        let footstep = Footstep { foot, to, zmp_error: self.supervisor.zmp_error() };
        let Catching { swing_time_s, lift_m, late_s, .. } = rules;
        let timing = Timing { swing_time_s, lift_m, late_s };
        self.swing = Some(Swing::new(timing, footstep, &self.estimator.now.footholds));
        self.start_reference();
        self.height.ahead.posture.clone_from(&self.whole_body.posture);
        self.height.now = [self.height.ahead.com_height(self.robot), 0.0, 0.0];
        self.estimator.lift(foot);
        true
    }

    /// A tick with a foot in the air.
    pub(super) fn catch_on(&mut self) -> Command {
        let (Some(rules), Some(mut swing)) = (self.design.family.catching, self.swing.take()) else {
            return self.design.home.clone();
        };
        let (foot, stance, left_s) = (swing.footstep.foot, swing.stance, swing.time_left_s());
        let mut means = self.means(foot);
        if left_s <= rules.settle_s {
            means = means.landing_at(to_side(foot, stance.inverse_transform_point(&swing.footstep.to)));
        }
        let dcm = to_side(foot, stance.inverse_transform_point(&self.dcm_in(0.0)));
        let due_s = left_s.max(LATE_TICKS * self.design.family.pendulum.dt);
        let catch = plan(&rules.weights, &means, dcm, due_s);
        if left_s > rules.settle_s {
            swing.aim(stance * Point2::from(to_side(foot, catch.place.into())));
        }
        self.supervisor.zmp_ref = stance * Point2::from(to_side(foot, catch.zmp.into()));
        let (mut soles, mut sole_vel) = (self.estimator.now.footholds, PerFoot::default());
        (soles[foot], sole_vel[foot]) = swing.sole();
        let standing = PerFoot::from_fn(|f| f != foot);
        let mut wanted = Wanted::rest(self.robot, standing);
        wanted.sole_acc[foot][0] = swing.sole_acc();
        self.lower_body(&swing);
        self.swing = Some(swing);
        let acceleration = self.move_reference();
        wanted.com_acc = Vector3::new(acceleration.x, acceleration.y, self.height.now[2]);
        self.move_body(soles, sole_vel);
        let posture = &self.estimator.now.posture;
        self.inverse_dynamics.solve(self.robot, posture, &self.whole_body.velocity, &wanted);
        self.command_with(self.inverse_dynamics.tau.clone())
    }

    /// The DCM in `time_s` and the delay from sensing to torque, if the ZMP stays where it is: world (m).
    fn dcm_in(&self, time_s: f64) -> Point2<f64> {
        let (estimate, omega) = (&self.estimator.now, self.design.family.pendulum.omega);
        let dcm = estimate.com_xy() + estimate.com_vel_xy() / omega;
        estimate.zmp + (dcm - estimate.zmp) * (omega * (time_s + self.robot.delay_s)).exp()
    }

    /// What a footstep of `foot` has to work with.
    fn means(&self, foot: Foot) -> Means {
        let Design { family, stance, .. } = self.design;
        let reach = self.robot.reach.expect("the design of a set that catches asks for it");
        Means {
            omega: family.pendulum.omega,
            sole: self.robot.soles[foot.other()].half_m,
            zmp_margin: family.zmp_margin,
            reach: [[-reach.forward_m, reach.forward_m], [reach.inward_m, reach.outward_m]],
            home: Vector2::new(stance.x * foot.side(), stance.y),
        }
    }

    /// Moves the height of the COM towards one from which the legs reach the landing place.
    fn lower_body(&mut self, swing: &Swing) {
        let (estimate, pendulum) = (&self.estimator.now, self.design.family.pendulum);
        let left_s = swing.time_left_s();
        let foot = swing.footstep.foot;
        let at_landing =
            pendulum.com_in(left_s.max(0.0), estimate.com_xy(), estimate.com_vel_xy(), self.supervisor.zmp_ref);
        let mut soles = estimate.footholds;
        soles[foot] = soles[foot.other()];
        soles[foot].translation.vector.x = swing.footstep.to.x;
        soles[foot].translation.vector.y = swing.footstep.to.y;
        let task = Task {
            com: Point3::new(at_landing.x, at_landing.y, self.design.com_height),
            rise: f64::INFINITY,
            com_vel: Vector3::zeros(),
            soles,
            sole_vel: PerFoot::default(),
            trunk: upright(&self.support),
        };
        let height = &mut self.height;
        for _ in 0..AHEAD_STEPS {
            height.ahead.follow(self.robot, &task);
        }
        let dt = pendulum.dt;
        height.now = if left_s > LATE_TICKS * dt {
            Quintic::new(height.now, height.ahead.com_height(self.robot), 0.0, left_s).at(dt)
        } else {
            [height.now[0], 0.0, 0.0]
        };
    }
}

/// Between the axes of a stance sole and those in which y is to the side of `foot`, its own inverse.
fn to_side(foot: Foot, v: Point2<f64>) -> Vector2<f64> {
    Vector2::new(v.x, v.y * foot.side())
}
