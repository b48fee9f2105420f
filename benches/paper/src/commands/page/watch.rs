//! Observes a pushed run tick by tick, and keeps what the page needs and neither the record nor the film of the run
//! has.

use crate::account::account;
use crate::render::page::study::{Seen, Stand};
use nalgebra::{Point2, Vector3};
use standfast::core::control::estimate::on_ground;
use standfast::core::control::stand::Support;
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::pendulum::State;
use standfast::core::robot::{Foot, PerFoot, Robot};
use standfast::sim::Truth;
use standfast::sim::episode::snapshot::LEAST_N;
use standfast::sim::episode::{AT_LIMIT, Tick};

/// Observer of one run.
#[derive(Default)]
pub struct PushedWatch {
    pub seen: Seen,
    /// Heading of the stance sole at the start of the first swing (rad, world frame).
    heading_at_lift: Option<f64>,
}

impl PushedWatch {
    /// Takes note of a tick. Returns the corners of the hull of the soles that carry load (m, world frame), or none in
    /// flight.
    pub fn see(&mut self, robot: &Robot, period_s: f64, tick: &Tick) -> Vec<Point2<f64>> {
        let truth = tick.truth;
        let loaded = PerFoot::from_fn(|foot| truth.sole_wrenches[foot].force.z >= LEAST_N);
        self.seen.loaded.push(loaded);
        self.note_torques(robot, period_s, truth);
        if let (Some(footstep), None) = (tick.report.footstep, &self.seen.landing) {
            self.note_stance(truth, footstep.foot.other());
        } else if let Some(account) = account(tick)
            && let estimate = account.estimate
            && account.stands()
            && estimate.in_contact.left
            && estimate.in_contact.right
            && self.seen.landing.is_none()
            && let Support {
                frame,
                polygon: Some(polygon),
                ..
            } = account.support()
        {
            let stand = Stand {
                time_s: truth.time_s,
                frame,
                polygon,
                state: State::new(
                    frame.inverse_transform_point(&estimate.com_xy()),
                    frame.inverse_transform_vector(&estimate.com_vel_xy()),
                    frame.inverse_transform_point(&account.zmp_ref),
                ),
                soles: PerFoot::from_fn(|foot| on_ground(&estimate.footholds[foot])),
                load_n: estimate.load_n,
            };
            *(if self.heading_at_lift.is_some() {
                &mut self.seen.landing
            } else {
                &mut self.seen.lift
            }) = Some(stand);
        }
        hull(robot, truth, &loaded)
    }

    /// Keeps how far the stance sole has tipped and turned at most since the start of the swing.
    fn note_stance(&mut self, truth: &Truth, stance: Foot) {
        let rotation = truth.soles[stance].rotation;
        let heading = on_ground(&truth.soles[stance]).rotation.angle();
        let tip_deg = (rotation * Vector3::z())
            .z
            .clamp(-1.0, 1.0)
            .acos()
            .to_degrees();
        self.seen.stance_tip_deg = self.seen.stance_tip_deg.max(tip_deg);
        let turn_deg = (heading - *self.heading_at_lift.get_or_insert(heading)).to_degrees();
        if turn_deg.abs() > self.seen.stance_turn_deg.abs() {
            self.seen.stance_turn_deg = turn_deg;
        }
    }

    /// Adds up for how long each joint is at its torque limit.
    fn note_torques(&mut self, robot: &Robot, period_s: f64, truth: &Truth) {
        self.seen.at_limit_s.resize(robot.joints.len(), 0.0);
        for ((time_s, tau), servo) in self
            .seen
            .at_limit_s
            .iter_mut()
            .zip(&truth.tau)
            .zip(&robot.servos)
        {
            *time_s += if tau.abs() >= AT_LIMIT * servo.torque_n_m {
                period_s
            } else {
                0.0
            };
        }
    }
}

/// Corners of the hull of the soles that carry load (m, world frame).
fn hull(robot: &Robot, truth: &Truth, loaded: &PerFoot<bool>) -> Vec<Point2<f64>> {
    let corners = |foot: Foot| {
        robot.soles[foot]
            .corners()
            .map(|corner| (truth.soles[foot] * corner).xy())
    };
    let of_loaded: Vec<Point2<f64>> = Foot::BOTH
        .into_iter()
        .filter(|f| loaded[*f])
        .flat_map(corners)
        .collect();
    SupportPolygon::hull(&of_loaded).map_or_else(Vec::new, |polygon| polygon.vertices().to_vec())
}
