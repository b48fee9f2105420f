//! Catching.
use super::footstep::Footstep;
use super::swing::{Swing, Timing};
use super::{Controller, FORGETTING_RATE};
use crate::lipm::catching::{self, Catch, Catching};
use crate::lipm::pendulum::Pendulum;
use crate::robot::{Command, Foot, PerFoot};
use nalgebra::{Isometry2, Point2, Vector2};

impl Controller<'_> {
    /// DCM, ahead by the delay.
    fn dcm_ahead(&self, rules: &Catching) -> Point2<f64> {
        let (estimate, omega) = (&self.estimator.now, self.design.family.pendulum.omega);
        let dcm = estimate.com_xy() + estimate.com_vel_xy() / omega;
        estimate.zmp + (dcm - estimate.zmp) * (omega * rules.delay_s).exp()
    }

    fn plan_catch(
        &self,
        rules: &Catching,
        foot: Foot,
        stance: &Isometry2<f64>,
        time_s: f64,
        transfer_s: f64,
        fixed: Option<Point2<f64>>,
    ) -> Catch {
        let omega = self.design.family.pendulum.omega;
        let estimate = &self.estimator.now;
        let dcm = self.dcm_ahead(rules);
        let dcm = estimate.zmp + (dcm - estimate.zmp) * (omega * transfer_s).exp();
        let side = |v: Point2<f64>| Vector2::new(v.x, v.y * foot.side());
        let dcm = side(stance.inverse_transform_point(&dcm));
        let fixed = fixed.map(|f| side(stance.inverse_transform_point(&f)));
        let half = self.robot.soles[foot.other()].half_m;
        let home = Vector2::new(self.design.stance.x * foot.side(), self.design.stance.y);
        catching::plan(rules, omega, time_s, dcm, half, home, fixed)
    }

    /// Lifts a foot when the DCM has left the support.
    pub(super) fn try_to_catch(&mut self) -> bool {
        let Some(rules) = self.design.family.catching else { return false };
        let estimate = &self.estimator.now;
        let late_enough = self.has_passed(self.since_landing_s, rules.pause_s);
        let out = self.out_of_sets_s.is_some_and(|s| self.has_passed(s, rules.patience_s));
        let Some(polygon) = self.support.polygon else { return false };
        let outside = polygon.signed_distance(self.support.frame.inverse_transform_point(&self.dcm_ahead(&rules)));
        if !(out && late_enough && outside > rules.outside_m) {
            return false;
        }
        let mut best: Option<(Foot, Catch, Isometry2<f64>)> = None;
        for foot in Foot::BOTH {
            if !estimate.in_contact[foot.other()] {
                continue;
            }
            let foothold = &estimate.footholds[foot.other()];
            let stance = Isometry2::new(foothold.translation.vector.xy(), super::estimator::heading(foothold));
            let load = (estimate.load_n[foot] / (estimate.load_n.left + estimate.load_n.right).max(1.0)).clamp(0.0, 1.0);
            let transfer = rules.transfer_s * load;
            let catch = self.plan_catch(&rules, foot, &stance, rules.swing_time_s - transfer, transfer, None);
            if best.as_ref().is_none_or(|b| catch.cost < b.1.cost) {
                best = Some((foot, catch, stance));
            }
        }
        let Some((foot, catch, stance)) = best else { return false };
        if catch.miss > rules.most_miss_m {
            return false;
        }
        let to = stance * Point2::new(catch.place.x, catch.place.y * foot.side());
        let footstep = Footstep { foot, to, zmp_error: self.supervisor.zmp_error() };
        let timing = Timing { swing_time_s: rules.swing_time_s, lift_m: rules.lift_m, late_s: rules.late_s };
        self.swing = Some(Swing::caught(timing, footstep, &self.estimator.now.footholds));
        self.com_ref = self.estimator.now.com_xy();
        self.com_ref_vel = self.estimator.now.com_vel_xy();
        self.estimator.lift(foot);
        true
    }

    /// A tick of a footstep that catches: ZMP and landing place follow the DCM.
    pub(super) fn catch_on(&mut self) -> Command {
        let Some(rules) = self.design.family.catching else { return self.design.home.clone() };
        let Some(mut swing) = self.swing.take() else { return self.design.home.clone() };
        let foot = swing.footstep.foot;
        let left = swing.time_left_s();
        let open = left > rules.settle_s;
        let fixed = (!open).then_some(swing.footstep.to);
        let catch = self.plan_catch(&rules, foot, &swing.stance, left.max(0.01), 0.0, fixed);
        if open {
            swing.aim(swing.stance * Point2::new(catch.place.x, catch.place.y * foot.side()));
        }
        let zmp = swing.stance * Point2::new(catch.zmp.x, catch.zmp.y * foot.side());
        let (pose, velocity) = swing.sole();
        self.swing = Some(swing);
        self.supervisor.zmp_ref = zmp;
        let Pendulum { dt, .. } = self.design.family.pendulum;
        let (com, com_vel) = (self.estimator.now.com_xy(), self.estimator.now.com_vel_xy());
        let acceleration = self.design.family.pendulum.com_acc(com, zmp);
        self.com_ref += self.com_ref_vel * dt + acceleration * (0.5 * dt * dt);
        self.com_ref_vel += acceleration * dt;
        let f = rules.forgetting * dt;
        self.com_ref += (com - self.com_ref) * f;
        self.com_ref_vel += (com_vel - self.com_ref_vel) * f;
        let _ = FORGETTING_RATE;
        let (mut soles, mut sole_vel) = (self.estimator.now.footholds, PerFoot::default());
        (soles[foot], sole_vel[foot]) = (pose, velocity);
        self.body_command(acceleration, soles, sole_vel, PerFoot::from_fn(|f| f != foot))
    }
}
