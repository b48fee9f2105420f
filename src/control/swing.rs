//! A footstep in the air: COM and ZMP by the relaxed boundary conditions of [`AxisPlan`], the swing foot on a smooth arc,
//! and its landing, by contact. Planned once from the estimate at the lift; nothing is stabilised until the landing, as
//! in the paper.

use super::estimator::heading;
use super::footstep::Footstep;
use crate::lipm::relaxation::{AxisPlan, Boundary};
use crate::lipm::stepping::Stepping;
use crate::robot::{PerFoot, Pose, Sole};
use nalgebra::{Isometry2, Point2, Vector2, Vector3};

/// A foot that presses with more has landed (N),
const LANDED_N: f64 = 5.0;
/// but not in this first share of the swing, when it may not have left the ground yet.
const EARLIEST_LANDING: f64 = 0.6;
/// A foot that is late goes down at this speed (m/s).
const LATE_SPEED_M_S: f64 = 0.1;

/// One footstep, from lift to landing.
#[derive(Debug, Clone, PartialEq)]
pub struct Swing {
    pub footstep: Footstep,
    rules: Stepping,
    /// Stance sole, flat on the ground, to world.
    stance: Isometry2<f64>,
    /// x and y in the stance sole's frame.
    plan: [AxisPlan; 2],
    /// Swing sole at the lift, and as it is to land.
    from: Pose,
    to: Pose,
    /// Since the lift (s).
    pub time_s: f64,
}

/// Where COM and ZMP are to be: world, over the ground (m, m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PendulumRef {
    pub com: Point2<f64>,
    pub com_vel: Vector2<f64>,
    pub zmp: Point2<f64>,
}

/// What a footstep starts from: world, as estimated at the lift.
#[derive(Debug, Clone, Copy)]
pub struct Lift {
    pub com: Point2<f64>,
    pub com_vel: Vector2<f64>,
    /// Where the feet stand.
    pub footholds: PerFoot<Pose>,
    /// Least distance of the ZMP from the edge of the stance sole (m).
    pub zmp_margin: f64,
}

impl Swing {
    /// Plans the footstep.
    pub fn plan(omega: f64, rules: &Stepping, stance_sole: &Sole, footstep: Footstep, lift: &Lift) -> Self {
        let [from, foothold] = [footstep.foot, footstep.foot.other()].map(|foot| lift.footholds[foot]);
        let stance = Isometry2::new(foothold.translation.vector.xy(), heading(&foothold));
        let [com, to] = [lift.com, footstep.to].map(|p| stance.inverse_transform_point(&p));
        let com_vel = stance.inverse_transform_vector(&lift.com_vel);
        let plan = [0, 1].map(|axis| {
            let most = (stance_sole.half_m[axis] - lift.zmp_margin).max(0.0);
            let boundary =
                Boundary { com: com[axis], com_vel: com_vel[axis], target: 0.5 * to[axis], zmp: [-most, most] };
            AxisPlan::new(omega, rules, &boundary)
        });
        let landing = Vector3::new(footstep.to.x, footstep.to.y, foothold.translation.z);
        let to = Pose::from_parts(landing.into(), foothold.rotation);
        Self { footstep, rules: *rules, stance, plan, from, to, time_s: 0.0 }
    }

    /// The planned COM and ZMP now.
    pub fn pendulum(&self) -> PendulumRef {
        let [[x, vx], [y, vy]] = self.plan.map(|axis| axis.com(self.time_s));
        let [zx, zy] = self.plan.map(|axis| axis.zmp(self.time_s));
        PendulumRef {
            com: self.stance * Point2::new(x, y),
            com_vel: self.stance * Vector2::new(vx, vy),
            zmp: self.stance * Point2::new(zx, zy),
        }
    }

    /// Where the swing sole is to be now, and its velocity (m/s).
    pub fn sole(&self) -> (Pose, Vector3<f64>) {
        let duration = self.rules.swing_time_s;
        let u = (self.time_s / duration).min(1.0);
        // Least jerk along the ground, a bump above it; both at rest at both ends.
        let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
        let share_rate = 30.0 * (u * (1.0 - u)).powi(2) / duration;
        let height = 16.0 * self.rules.lift_m * (u * (1.0 - u)).powi(2);
        let height_rate = 32.0 * self.rules.lift_m * u * (1.0 - u) * (1.0 - 2.0 * u) / duration;
        let late = (self.time_s - duration).max(0.0);
        let late_speed = if late > 0.0 { LATE_SPEED_M_S } else { 0.0 };
        let way = self.to.translation.vector - self.from.translation.vector;
        let place = self.from.translation.vector + way * share + Vector3::z() * (height - LATE_SPEED_M_S * late);
        let velocity = way * share_rate + Vector3::z() * (height_rate - late_speed);
        (Pose::from_parts(place.into(), self.from.rotation.slerp(&self.to.rotation, share)), velocity)
    }

    /// Whether the planned time is over.
    pub fn is_due(&self) -> bool {
        self.time_s >= self.rules.swing_time_s - 1e-9
    }

    /// Whether the footstep is over: the sole carries `load_n` (N), early or late, or it has been late for too long.
    pub fn has_landed(&self, load_n: f64) -> bool {
        let duration = self.rules.swing_time_s;
        let may_land = self.time_s >= EARLIEST_LANDING * duration;
        (may_land && load_n > LANDED_N) || self.time_s >= duration + self.rules.late_s
    }
}
