//! The walk home. Footsteps that caught a push leave the feet where they landed: far apart, one ahead of the other, or
//! crossed. A robot that has come to rest puts its feet beside each other again, so that the next push finds the same
//! stance as the first one.
//!
//! One footstep is enough, because only the place of one foot beside the other matters. The standing rule first brings
//! the COM over the stance foot ([`WayHome::lean`]); then the other foot is unloaded and can be lifted
//! ([`WayHome::unloaded`]). A robot that is disturbed during the walk gives up ([`WayHome::give_up`]), and stands or
//! catches itself as usual.

use super::footwork::StepState;
use crate::control::estimate::{Estimate, control_frame, on_ground};
use crate::robot::Foot;
use nalgebra::{Point3, Vector2};

/// Time at rest after which the robot walks home, in 1/omega.
const REST: f64 = 6.0;
/// Distance from a point within which the COM stays at rest, in COM heights. At rest, the state is also in a CPI set. A
/// body that still rises after a long stride is not at rest.
const REST_WAY: f64 = 0.02;
/// Speed at which the COM goes to the stance foot, in COM heights times omega.
const LEAN_SPEED: f64 = 0.03;
/// Share of the stance sole within which DCM and ZMP must lie for the lift. If they are not there within the time
/// [`REST`], the robot gives up.
const OVER_SOLE: f64 = 0.6;
/// Distance from its place below which a foot is at home, in sole lengths, and largest angle between feet at home
/// (rad).
const HOME: f64 = 0.1;
const PARALLEL_RAD: f64 = 0.1;

/// The state of the walk home.
#[derive(Debug, Clone, Default)]
pub struct WayHome {
    /// Time for which the robot has been at rest, or has waited over its stance foot (s).
    rest_s: f64,
    /// Where the COM was when it came to rest (m, world frame).
    rest_at: Point3<f64>,
    /// The foot that is to go home, and how far the robot leans towards the other foot, as a share of the way from the
    /// middle of the feet to that foot.
    leant: Option<(Foot, f64)>,
}

impl WayHome {
    /// Desired place of the COM, from the point midway between the feet (m, world frame). `margin` is the margin of the
    /// last tick's state in the slowest gain's CPI set.
    pub fn lean(&mut self, now: &StepState, margin: f64) -> Vector2<f64> {
        let Estimate {
            footholds,
            in_contact,
            com,
            ..
        } = now.estimate;
        let pendulum = &now.design.family.pendulum;
        // A closure, since most ticks need not know it.
        let rests =
            || (com - self.rest_at).norm() < REST_WAY * now.design.units.length_m && !is_home(now);
        if margin < 0.0
            || !(in_contact.left && in_contact.right)
            || (self.leant.is_none() && !rests())
        {
            *self = Self {
                rest_at: *com,
                ..Self::default()
            };
            return Vector2::zeros();
        }
        self.rest_s += pendulum.dt;
        let has_rested = self.rest_s * pendulum.omega > REST;
        let Some((foot, share)) = &mut self.leant else {
            if has_rested {
                // The foot that landed last goes back.
                self.leant = Some((
                    now.last_landing.map_or(Foot::Left, |landing| landing.foot),
                    0.0,
                ));
            }
            return Vector2::zeros();
        };
        let way = footholds[foot.other()].translation.vector.xy()
            - control_frame(footholds).translation.vector;
        if *share < 1.0 {
            let speed = LEAN_SPEED * now.design.units.length_m * pendulum.omega;
            *share = (*share + speed * pendulum.dt / way.norm()).min(1.0);
            self.rest_s = 0.0;
        } else if has_rested {
            self.give_up();
            return Vector2::zeros();
        }
        way * *share
    }

    /// The foot to be lifted now, if the robot is over the other one.
    pub fn unloaded(&self, now: &StepState) -> Option<Foot> {
        let (foot, _) = self.leant?;
        let stance = on_ground(&now.estimate.footholds[foot.other()]);
        let dcm =
            now.estimate.com_xy() + now.estimate.com_vel_xy() / now.design.family.pendulum.omega;
        let [x, y] = now.design.robot.soles[foot.other()].half_m;
        let is_over = [dcm, now.estimate.zmp].into_iter().all(|point| {
            let local = stance.inverse_transform_point(&point);
            local.x.abs() < OVER_SOLE * x && local.y.abs() < OVER_SOLE * y
        });
        is_over.then_some(foot)
    }

    /// Ends the walk. The COM returns to the middle of the feet, and a new walk begins after the next rest.
    pub fn give_up(&mut self) {
        *self = Self::default();
    }
}

/// Whether the feet stand beside each other as at home.
fn is_home(now: &StepState) -> bool {
    let (footholds, soles) = (&now.estimate.footholds, &now.design.robot.soles);
    let [left, right] = [&footholds.left, &footholds.right];
    let apart = control_frame(footholds).inverse()
        * (left.translation.vector - right.translation.vector).xy();
    let turned = on_ground(right)
        .rotation
        .rotation_to(&on_ground(left).rotation)
        .angle();
    (apart - now.design.stance).norm() < HOME * 2.0 * soles.left.half_m[0]
        && turned.abs() < PARALLEL_RAD
}
