//! One tick of a closed loop, and the loop itself.

use super::config::EpisodeConfig;
use crate::control::Account;
use crate::geometry::SupportPolygon;
use crate::robot::{Command, Foot, PerFoot, Pose, Robot};
use crate::sim::Truth;
use nalgebra::Point2;
use std::ops::ControlFlow;

/// One control tick, as an observer sees it: the truth now (with means over the tick that ends now), and what the
/// controller makes of what it senses now.
pub struct Tick<'a> {
    pub truth: &'a Truth,
    /// True divergent component of motion, world.
    pub dcm: Point2<f64>,
    /// Its distance outside of the soles on the ground (m); negative inside, infinite in flight.
    pub dcm_outside_m: f64,
    /// What the controller did, and why.
    pub account: Account<'a>,
    pub command: &'a Command,
}

impl<'a> Tick<'a> {
    /// Of `robot`, whose pendulum has this omega (rad/s).
    pub(super) fn new(robot: &Robot, omega: f64, truth: &'a Truth, account: Account<'a>, command: &'a Command) -> Self {
        let dcm = truth.com.xy() + truth.com_vel.xy() / omega;
        let support = support_on_ground(robot, truth);
        let dcm_outside_m = support.map_or(f64::INFINITY, |polygon| polygon.signed_distance(dcm));
        Self { truth, dcm, dcm_outside_m, account, command }
    }
}

/// A robot under control: simulated ([`ClosedLoop`](super::ClosedLoop)), or the paper's ideal one ([`imposed`](super::imposed)).
pub trait Controlled {
    /// What is now, and what the controller makes of it. Once a control period.
    fn tick(&mut self) -> Tick<'_>;
    /// Goes on for a control period under the last command.
    fn advance(&mut self);
}

/// The loop: from now to the horizon, or until `observe`, which sees every tick, says that it is over.
pub fn drive(
    controlled: &mut impl Controlled,
    config: &EpisodeConfig,
    mut observe: impl FnMut(&Tick) -> ControlFlow<()>,
) {
    let ticks = (config.horizon_s / config.control_period_s).round() as u64;
    for k in 0..=ticks {
        if observe(&controlled.tick()).is_break() {
            return;
        }
        if k < ticks {
            controlled.advance();
        }
    }
}

/// Hull of the soles that rest on the ground, world; None in flight.
pub fn support_on_ground(robot: &Robot, truth: &Truth) -> Option<SupportPolygon> {
    /// A sole is on the ground when a corner of it is this low above it (m).
    const NEAR_M: f64 = 0.003;
    let mut corners = [Point2::origin(); 8];
    let mut count = 0;
    let placed = PerFoot::from_fn(|foot| robot.soles[foot].corners().map(|corner| truth.soles[foot] * corner));
    for foot in
        Foot::BOTH.into_iter().filter(|&f| placed[f].iter().any(|c| c.z - truth.ground.height_m(c.xy()) < NEAR_M))
    {
        for corner in placed[foot] {
            corners[count] = corner.xy();
            count += 1;
        }
    }
    SupportPolygon::hull(&corners[..count])
}

/// Distance of the COM over the ground from the middle of the soles' centres (m).
pub(super) fn home_distance(com: Point2<f64>, soles: &PerFoot<Pose>) -> f64 {
    let middle = (soles.left.translation.vector.xy() + soles.right.translation.vector.xy()) / 2.0;
    (com.coords - middle).norm()
}
