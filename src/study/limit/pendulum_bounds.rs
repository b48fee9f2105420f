//! The pendulum bounds: the largest impulses that a pendulum can take without a footstep, with one, and with any
//! number, by the landing regions of the robot and by footsteps as `catch` takes them.

use crate::ask::spec::Campaign;
use crate::limit::search::ControllerLimit;
use nalgebra::Point2;
use serde::Serialize;
use standfast_core::control::step::reach::earliest;
use standfast_core::lipm::capture::{self, SteppingPendulum, SwingRegion};
use standfast_core::robot::{Foot, Kinematics, LandingRegion, PerFoot, Robot, Units};
use standfast_sim::Profile;

/// The quantities from which the bounds are computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PendulumBounds {
    pub mass_kg: f64,
    pub omega_rad_s: f64,
    pub com_height_m: f64,
    /// COM at home relative to the origin: x, y.
    pub com_offset_m: [f64; 2],
    /// Smallest and largest coordinates of a sole, from its centre.
    pub sole_x_m: [f64; 2],
    pub sole_y_m: [f64; 2],
    /// The part of a sole on which its ankle can hold all of the weight.
    pub held_x_m: [f64; 2],
    pub held_y_m: [f64; 2],
    /// The x range on which both ankles together hold the weight by their pitch torques while both feet stand. (A push
    /// to the side is carried by one foot, so there is no such range of y.)
    pub held_by_both_x_m: [f64; 2],
    /// Distance between the soles' centres.
    pub stance_width_m: f64,
    /// The regions where a foot can land, each with its swing time.
    pub reach: Vec<LandingRegion>,
    /// Mean duration of the pushes in the campaign.
    pub push_duration_s: f64,
    /// Mean height of the pushes above the COM in the campaign.
    pub push_height_m: f64,
    /// Name of the link on which it acts.
    pub push_link: String,
    pub push_profile: Profile,
    /// Ratio of the impulse of a push with this duration to an instantaneous one with the same effect.
    pub push_factor: f64,
    /// 1 / (1 + push_height / com_height) for a push above the COM, else 1. A bound is reduced by this factor if the
    /// angular momentum of the push has to be removed through the ankles.
    pub height_factor: f64,
}

/// One heading: the bounds for the campaign's push (for its duration, not its height), and the controllers' results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Heading {
    pub heading_deg: f64,
    pub bound_no_step_n_s: f64,
    /// What limits the bounds beside places and times of footsteps: `soles` or, if the ankles cannot hold the weight at
    /// the edges of the soles, `ankle torque`.
    pub limited_by: &'static str,
    /// With at most one footstep, and with any number. Both are None for a robot that does not say where its feet can land.
    pub bound_one_step_n_s: Option<f64>,
    pub bound_n_step_n_s: Option<f64>,
    /// With any number that may also reach as far beyond the landing regions as `catch` aims its feet, and land as early as
    /// `catch` counts a landing.
    pub bound_early_n_s: Option<f64>,
    /// The bounds multiplied by `height_factor`.
    pub bound_no_step_at_height_n_s: f64,
    pub bound_one_step_at_height_n_s: Option<f64>,
    pub bound_n_step_at_height_n_s: Option<f64>,
    pub bound_early_at_height_n_s: Option<f64>,
    pub controllers: Vec<ControllerLimit>,
}

impl PendulumBounds {
    /// For a robot at home and the mean push of a campaign.
    pub fn new(robot: &Robot, campaign: &Campaign) -> PendulumBounds {
        let kinematics = Kinematics::at_home(robot);
        let centre = PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot).translation.vector);
        let (com, middle) = (kinematics.com(), (centre.left + centre.right) / 2.0);
        let omega_rad_s = robot.omega();
        let com_height_m = robot.home_com_height();
        // If the soles differ in size, the smaller one counts.
        let half_m = [0, 1].map(|axis| {
            Foot::BOTH
                .map(|foot| robot.soles[foot].half_m[axis])
                .into_iter()
                .fold(f64::INFINITY, f64::min)
        });
        let weight_n = robot.weight_n();
        let [held_x_m, held_y_m, held_by_both_x_m] =
            [(1.0, 0), (1.0, 1), (0.5, 0)].map(|(share, axis)| {
                let [left, right] =
                    Foot::BOTH.map(|foot| robot.soles[foot].pressable_m(share * weight_n)[axis]);
                // If the feet differ, the range that both allow counts.
                [left[0].max(right[0]), left[1].min(right[1])]
            });
        let push_duration_s = campaign.push.duration_s.mean();
        let point_m = match robot.pushed.point_m {
            Some(point_m) => (kinematics.link_pose(robot.pushed.link) * point_m).z - com.z,
            None => 0.0,
        };
        let push_height_m = point_m + campaign.push.height_m.mean();
        let push_factor = match campaign.push.profile {
            Profile::Rectangular => capture::rectangular_push_factor,
            Profile::HalfSine => capture::half_sine_push_factor,
        };
        PendulumBounds {
            mass_kg: robot.mass(),
            omega_rad_s,
            com_height_m,
            com_offset_m: [com.x - middle.x, com.y - middle.y],
            sole_x_m: [-half_m[0], half_m[0]],
            sole_y_m: [-half_m[1], half_m[1]],
            held_x_m,
            held_y_m,
            held_by_both_x_m,
            stance_width_m: (centre.left.y - centre.right.y).abs(),
            reach: robot.reach.clone(),
            push_duration_s,
            push_height_m,
            push_link: robot.links[robot.pushed.link].name.clone(),
            push_profile: campaign.push.profile,
            push_factor: push_factor(omega_rad_s, push_duration_s),
            height_factor: 1.0 / (1.0 + push_height_m.max(0.0) / com_height_m),
        }
    }

    /// The units of the robot.
    pub fn units(&self) -> Units {
        Units {
            mass_kg: self.mass_kg,
            length_m: self.com_height_m,
            half_sole_m: self.sole_x_m[1],
        }
    }

    /// The bounds for one heading (degrees), still without controllers.
    pub fn heading(&self, heading_deg: f64) -> Heading {
        let regions = self.reach.iter().map(|region| SwingRegion {
            x_m: region.x_m,
            y_m: region.y_m,
            swing_time_s: region.swing_time_s,
        });
        let held = SteppingPendulum {
            mass_kg: self.mass_kg,
            omega: self.omega_rad_s,
            com: Point2::from(self.com_offset_m),
            sole_x_m: self.held_x_m,
            sole_y_m: self.held_y_m,
            both_x_m: self.held_by_both_x_m,
            both_y_m: self.held_y_m,
            stance_width_m: self.stance_width_m,
            regions: regions.collect(),
        };
        let [x_m, y_m] = [self.sole_x_m, self.sole_y_m];
        let by_soles = SteppingPendulum {
            sole_x_m: x_m,
            both_x_m: x_m,
            sole_y_m: y_m,
            both_y_m: y_m,
            ..held.clone()
        };
        let bounds = held.bounds(heading_deg);
        let limited_by = if bounds == by_soles.bounds(heading_deg) {
            "soles"
        } else {
            "ankle torque"
        };
        let no = bounds.no_step_n_s * self.push_factor;
        let [one, n] = [bounds.one_step_n_s, bounds.n_step_n_s]
            .map(|j| (!self.reach.is_empty()).then_some(j * self.push_factor));
        let places = earliest(&self.reach, self.stance_width_m, self.com_height_m);
        let early = (!places.is_empty()).then(|| {
            held.early_n_s(heading_deg, &places).max(bounds.n_step_n_s) * self.push_factor
        });
        let at_height = |bound_n_s: f64| bound_n_s * self.height_factor;
        Heading {
            heading_deg,
            bound_no_step_n_s: no,
            limited_by,
            bound_one_step_n_s: one,
            bound_n_step_n_s: n,
            bound_early_n_s: early,
            bound_no_step_at_height_n_s: at_height(no),
            bound_one_step_at_height_n_s: one.map(at_height),
            bound_n_step_at_height_n_s: n.map(at_height),
            bound_early_at_height_n_s: early.map(at_height),
            controllers: Vec::new(),
        }
    }
}

impl Heading {
    /// The bound with one footstep or, where it is not known, a guess from the one without (N s), for searches to begin with.
    pub fn with_one_step_n_s(&self) -> f64 {
        const FACTOR: f64 = 2.0;
        self.bound_one_step_n_s
            .unwrap_or(FACTOR * self.bound_no_step_n_s)
    }

    /// The same with any number of footsteps.
    pub fn with_steps_n_s(&self) -> f64 {
        const FACTOR: f64 = 4.0;
        self.bound_n_step_n_s
            .unwrap_or(FACTOR * self.bound_no_step_n_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::standing_bound::StandingBound;
    use crate::fixtures::campaign;

    #[test]
    fn the_pendulum_bounds_take_the_mean_push() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let of = |set: &[&str]| PendulumBounds::new(&robot, &campaign("nominal", set));
        let drawn = of(&[
            "push.height_m={uniform=[-0.05, 0.1]}",
            "push.duration_s={normal=[0.06, 0.02]}",
        ]);
        assert_eq!(drawn, of(&["push.height_m=0.025", "push.duration_s=0.06"]));
        let heading = drawn.heading(0.0);
        let factor = 1.0 / (1.0 + 0.025 / robot.home_com_height());
        assert!(
            (heading.bound_one_step_at_height_n_s.unwrap() / heading.with_one_step_n_s() - factor)
                .abs()
                < 1e-12
        );
        // For a push below the COM, the bound stays as it is.
        assert_eq!(
            of(&["push.height_m={uniform=[-0.1, 0]}"]).height_factor,
            1.0
        );
    }

    /// UT-mu2's, as another program computes them. It tries at most eight footsteps, the first three of them to any places.
    #[test]
    fn early_footsteps_take_what_others_found() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let bounds = PendulumBounds::new(&robot, &campaign("nominal", &[]));
        for (heading_deg, found_n_s) in [
            (0.0, 14.46),
            (45.0, 16.84),
            (90.0, 13.68),
            (135.0, 17.20),
            (180.0, 14.46),
        ] {
            let early_n_s = bounds.heading(heading_deg).bound_early_n_s.unwrap();
            assert!(
                (early_n_s / found_n_s - 1.0).abs() < 0.01,
                "{heading_deg}: {early_n_s}, not {found_n_s} N s"
            );
        }
    }

    /// Weak ankles hold less than the soles allow, forward by the torque of both over the weight.
    #[test]
    fn weak_ankles_limit_what_is_held_without_a_footstep() {
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        let bound =
            |robot: &Robot| PendulumBounds::new(robot, &campaign("nominal", &[])).heading(0.0);
        let strong = bound(&robot);
        assert_eq!(strong.limited_by, "soles");
        let lever_m = 0.02;
        for foot in Foot::BOTH {
            robot.soles[foot].ankle.torque_n_m = [0.5 * robot.weight_n() * lever_m; 2];
            robot.soles[foot].ankle.above_m = [0.0; 2];
        }
        let weak = bound(&robot);
        assert_eq!(weak.limited_by, "ankle torque");
        let pendulum_bounds = PendulumBounds::new(&robot, &campaign("nominal", &[]));
        let held_m = lever_m - pendulum_bounds.com_offset_m[0];
        let expected = robot.mass() * robot.omega() * held_m * pendulum_bounds.push_factor;
        assert!(
            (weak.bound_no_step_n_s / expected - 1.0).abs() < 1e-9,
            "{} {expected}",
            weak.bound_no_step_n_s
        );
        assert!(
            weak.with_one_step_n_s() < strong.with_one_step_n_s()
                && weak.with_steps_n_s() < strong.with_steps_n_s()
        );
        // Where a foot can land is not known: the bounds with footsteps are left out, and the other one stays.
        robot.reach.clear();
        let unknown = bound(&robot);
        assert_eq!(unknown.bound_no_step_n_s, weak.bound_no_step_n_s);
        assert_eq!(
            [
                unknown.bound_one_step_n_s,
                unknown.bound_n_step_n_s,
                unknown.bound_early_n_s
            ],
            [None; 3]
        );
    }

    /// The measure of a push is the bound without a footstep and without the factor for the push's duration.
    #[test]
    fn the_measure_of_a_push_is_the_bound_without_a_footstep() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let pendulum_bounds = PendulumBounds::new(&robot, &campaign("nominal", &[]));
        let no_step = StandingBound::new(&robot);
        for heading_deg in [-135.0, -20.0, 0.0, 70.0, 90.0, 180.0] {
            let bound = pendulum_bounds.heading(heading_deg).bound_no_step_n_s
                / pendulum_bounds.push_factor;
            let found = no_step.impulse_n_s(heading_deg).unwrap();
            assert!(
                (found - bound).abs() < 1e-9,
                "{heading_deg}: {found}, not {bound}"
            );
        }
    }
}
