//! Catching.
use super::footstep::Footstep;
use super::swing::{Quintic, Swing, Timing};
use super::whole_body::Task;
use super::{Controller, FORGETTING_RATE};
use crate::lipm::catching::{self, Catch, Catching};
use crate::lipm::pendulum::Pendulum;
use crate::robot::{Command, Foot, PerFoot, Pose};
use super::inverse_dynamics::Wanted;
use nalgebra::{DVector, Isometry2, Matrix3xX, Matrix6xX, Point2, Point3, UnitQuaternion, Vector2, Vector3};

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
        self.ahead.posture = self.whole_body.posture.clone();
        self.height = [self.whole_body.com_height(self.robot), 0.0, 0.0];
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
        self.plan_height(foot, left, zmp);
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

    /// Where the height of the COM is to be: such that the legs reach to the landing place.
    fn plan_height(&mut self, foot: Foot, left: f64, zmp: Point2<f64>) {
        let Pendulum { omega, dt } = self.design.family.pendulum;
        let Some(swing) = &self.swing else { return };
        let estimate = &self.estimator.now;
        let t = left.max(0.0);
        let (com, vel) = (estimate.com_xy() - zmp, estimate.com_vel_xy() / omega);
        let at_landing = zmp + com * (omega * t).cosh() + vel * (omega * t).sinh();
        let mut soles = estimate.footholds;
        let to = swing.footstep.to;
        soles[foot].translation.vector = Vector3::new(to.x, to.y, soles[foot.other()].translation.z);
        soles[foot].rotation = soles[foot.other()].rotation;
        let task = Task {
            com: Point3::new(at_landing.x, at_landing.y, self.design.com_height),
            rise: f64::INFINITY,
            com_vel: Vector3::zeros(),
            soles,
            sole_vel: PerFoot::default(),
            trunk: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.support.frame.rotation.angle()),
        };
        for _ in 0..3 {
            self.ahead.follow(self.robot, &task);
        }
        let end = self.ahead.com_height(self.robot);
        let now = self.height;
        if std::env::var("DBG").is_ok() { self.whole_body.posture.q[0] += 0.0; eprintln!("h {:.3} left {left:.3} end {end:.4} now {:.4?} ref {:.4} est {:.4} at {:.3?} to {:.3?}", swing.time_s, now, self.whole_body.com_height(self.robot), self.estimator.now.com.z, at_landing.coords.as_slice(), to.coords.as_slice()); }
        if left > 2.0 * dt {
            let q = Quintic::new(now, end, 0.0, left);
            self.height = q.at(dt);
        } else {
            self.height = [now[0] + now[1] * dt, now[1] * 0.8, 0.0];
        }
    }

    /// Joint targets by inverse dynamics.
    pub(super) fn dynamic_command(
        &mut self,
        acceleration: Vector2<f64>,
        soles: &PerFoot<Pose>,
        sole_vel: &PerFoot<Vector3<f64>>,
        standing: PerFoot<bool>,
    ) -> Command {
        let env = |k: &str, d: f64| std::env::var(k).map_or(d, |v| v.parse().unwrap());
        let robot = self.robot;
        let dt = self.design.family.pendulum.dt;
        let estimate = &self.estimator.now;
        let n = robot.joints.len();
        let q = &estimate.posture.q;
        let (mut qr, mut vr) = match self.joints.take() {
            Some([q, v]) => (q, v),
            None => (q.clone(), self.whole_body.velocity.as_slice()[6..].to_vec()),
        };
        // Observer.
        let w = env("OBS", 60.0);
        for j in 0..n {
            let e = q[j] - qr[j];
            qr[j] += 2.0 * w * dt * e;
            vr[j] += w * w * dt * e;
        }
        let mut velocity = DVector::zeros(6 + n);
        velocity.as_mut_slice()[6..].copy_from_slice(&vr);
        let omega_trunk = self.gyro_world;
        velocity.fixed_rows_mut::<3>(3).copy_from(&omega_trunk);
        let k = self.estimator.kinematics();
        let mut com_j = Matrix3xX::zeros(6 + n);
        k.com_jacobian(robot, &mut com_j);
        let rest = estimate.com_vel - &com_j * &velocity;
        velocity.fixed_rows_mut::<3>(0).copy_from(&rest);
        let mut wanted = Wanted::rest(robot, standing);
        let (hp, hd) = (env("HP", 150.0), env("HD", 25.0));
        wanted.com_acc = Vector3::new(
            acceleration.x,
            acceleration.y,
            hp * (self.design.com_height - estimate.com.z) - hd * estimate.com_vel.z,
        );
        let trunk = k.link_pose(robot.trunk).rotation;
        let upright = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.support.frame.rotation.angle());
        let (tp, td) = (env("TP", 400.0), env("TD", 40.0));
        wanted.trunk_acc = (upright * trunk.inverse()).scaled_axis() * tp - omega_trunk * td;
        let mut jac = Matrix6xX::zeros(6 + n);
        for foot in Foot::BOTH.into_iter().filter(|&f| !standing[f]) {
            let pose = k.sole_pose(robot, foot);
            let point = pose.translation.vector.into();
            k.point_jacobian(robot, robot.soles[foot].link, &point, &mut jac);
            let vel = &jac * &velocity;
            let (sp, sd) = (env("SP", 900.0), env("SD", 60.0));
            let plan = self.swing.as_ref().map_or(Vector3::zeros(), |s| s.sole_acc());
            wanted.sole_acc[foot] = [
                plan + (soles[foot].translation.vector - pose.translation.vector) * sp
                    + (sole_vel[foot] - vel.fixed_rows::<3>(0)) * sd,
                (soles[foot].rotation * pose.rotation.inverse()).scaled_axis() * sp - vel.fixed_rows::<3>(3) * sd,
            ];
        }
        let (jp, jd) = (env("JP", 100.0), env("JD", 20.0));
        for j in 0..n {
            wanted.joint_acc[j] = jp * (robot.home_rad[j] - q[j]) - jd * vr[j];
        }
        let outlook = self.inverse_dynamics.solve(robot, &estimate.posture, &velocity, &wanted);
        if std::env::var("DBG").is_ok() {
            let f = outlook.wrenches.left.force + outlook.wrenches.right.force;
            let t = self.swing.as_ref().map_or(0.0, |s| s.time_s);
            let worst = (0..n).max_by(|a, b| (q[*a] - qr[*a]).abs().total_cmp(&(q[*b] - qr[*b]).abs())).unwrap();
            eprintln!(
                "{t:.3} acc want [{:.1} {:.1} {:.1}] got [{:.1} {:.1} {:.1}] zmp {:.3?} fz {:.1} meas {:.1} {:.3?} tau {:.2} worst {} {:.3}",
                wanted.com_acc.x, wanted.com_acc.y, wanted.com_acc.z,
                outlook.com_acc.x, outlook.com_acc.y, outlook.com_acc.z,
                outlook.zmp.map(|z| [z.x, z.y]), f.z,
                estimate.load_n.left + estimate.load_n.right, [estimate.zmp.x, estimate.zmp.y], outlook.torque_ratio, robot.joints[worst].name, q[worst]-qr[worst]
            );
        }
        for j in 0..n {
            let a = self.inverse_dynamics.acceleration[6 + j];
            qr[j] += vr[j] * dt + 0.5 * a * dt * dt;
            vr[j] += a * dt;
        }
        let command =
            Command { q_ref: qr.clone(), dq_ref: vr.clone(), tau_ff: self.inverse_dynamics.tau.clone() };
        self.joints = Some([qr, vr]);
        // The kinematic reference follows.
        self.whole_body.posture = estimate.posture.clone();
        self.whole_body.posture.q.copy_from_slice(&command.q_ref);
        command
    }
}
