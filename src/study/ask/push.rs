//! The distributions of pushes in a campaign: `[push]` and `[second_push]`.

use crate::ask::bounds::{A_QUARTER, HALF, PushBounds, because, digits};
use crate::ask::distribution::Distribution;
use crate::ask::pendulum::{PendulumSpec, check_strike};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{PushPoint, Robot, Units};
use standfast_sim::{Profile, Push};
use std::fmt;

/// Largest distance of a point from the origin of its link, in heights of the COM.
const MOST_HEIGHTS: f64 = 2.0;

/// Distributions of the fields of a [`Push`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushSpec {
    pub impulse_n_s: Distribution,
    pub heading_deg: Distribution,
    pub height_m: Distribution,
    pub duration_s: Distribution,
    pub start_s: Distribution,
    pub profile: Profile,
    /// The link on which it acts: `trunk`, `pelvis` (the link that carries both legs), or the name of a link.
    #[serde(default = "on_trunk")]
    pub link: String,
    /// The point of the link on which it acts, from which `height_m` counts.
    #[serde(default)]
    pub point_m: PushedPoint,
    /// The pendulum that pushes; None for a force. Impulse, duration and profile then follow from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pendulum: Option<PendulumSpec>,
}

/// Words in a file for two links that every robot has.
const TRUNK: &str = "trunk";
const PELVIS: &str = "pelvis";

fn on_trunk() -> String {
    TRUNK.into()
}

/// The point of a link on which a push acts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"com\" or a point [x, y, z] in the frame of the link (m)"
)]
pub enum PushedPoint {
    /// The COM of the home posture.
    AtCom(AtCom),
    /// A point in the frame of the link (m).
    Point([f64; 3]),
}

/// The word "com".
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AtCom {
    Com,
}

impl Default for PushedPoint {
    fn default() -> Self {
        Self::AtCom(AtCom::Com)
    }
}

impl PushSpec {
    /// Where it acts on a robot. Fails if the robot has no such link, or for a point that is far from it.
    pub fn on(&self, robot: &Robot, file: &str) -> Result<PushPoint> {
        let link = match &self.link[..] {
            TRUNK => robot.trunk,
            PELVIS => robot.pelvis(),
            name => {
                let mut frames = robot.frames.iter();
                let frame = frames.find(|frame| frame.name == name).ok_or_else(|| {
                    let names = robot.frames.iter().map(|frame| frame.name.as_str());
                    let names: Vec<&str> = [TRUNK, PELVIS].into_iter().chain(names).collect();
                    let problem = format!("{} has no such link", robot.name);
                    Error::value(file, "push.link", name, problem, names.join(", "))
                })?;
                frame.link
            }
        };
        let point_m = self.point_on(robot, file)?;
        let point = PushPoint { link, point_m };
        self.check_pendulum(robot, point, file)?;
        Ok(point)
    }

    /// The stated point in the frame of a link of the robot (m); None for the COM at home.
    fn point_on(&self, robot: &Robot, file: &str) -> Result<Option<Point3<f64>>> {
        let point_m = match self.point_m {
            PushedPoint::AtCom(_) => None,
            PushedPoint::Point(point) => {
                let most_m = MOST_HEIGHTS * robot.home_com_height();
                if point.iter().any(|x| x.is_nan() || x.abs() > most_m) {
                    return Err(Error::value(
                        file,
                        "push.point_m",
                        format!("{point:?}"),
                        "is far from the link",
                        format!(
                            "[x, y, z] in its frame, each from {:.3} to {most_m:.3}",
                            -most_m
                        ),
                    ));
                }
                let mut frames = robot.frames.iter();
                let frame = frames.find(|frame| frame.name == self.link);
                let pose = frame.map_or(Isometry3::identity(), |frame| frame.pose);
                Some(pose * Point3::from(point))
            }
        };
        Ok(point_m)
    }

    /// Checks that a bob comes to the robot at home for samples of heading, height and drawback.
    fn check_pendulum(&self, robot: &Robot, point: PushPoint, file: &str) -> Result<()> {
        let Some(pendulum) = &self.pendulum else {
            return Ok(());
        };
        let robot = Robot {
            pushed: point,
            ..robot.clone()
        };
        let bob = pendulum.bob();
        // The farthest drawback sweeps the largest way.
        let most_m = pendulum.draw_m.samples(2).into_iter().fold(0.0, f64::max);
        for height_m in self.height_m.samples(3) {
            for heading_deg in self.heading_deg.samples(9) {
                let push = Push {
                    heading_deg,
                    height_m,
                    impulse_n_s: bob.momentum_n_s(most_m),
                    bob: Some(bob),
                    ..Push::default()
                };
                check_strike(file, &robot, &push, &bob)?;
            }
        }
        Ok(())
    }

    /// Sets what follows from the pendulum, if there is one: the momentum of the bob, and the duration and the course of its
    /// strike on a free body with the mass of the robot, for plans and bounds.
    pub(super) fn settle(&mut self, units: &Units) {
        let Some(pendulum) = &self.pendulum else {
            return;
        };
        let bob = pendulum.bob();
        self.impulse_n_s = pendulum.draw_m.map(|draw_m| bob.momentum_n_s(draw_m));
        self.duration_s = Distribution::Constant(bob.contact_s(units.mass_kg));
        self.profile = Profile::HalfSine;
    }

    /// From what `height_m` counts.
    pub fn from_what(&self) -> &'static str {
        match self.point_m {
            PushedPoint::AtCom(_) => "the COM",
            PushedPoint::Point(_) => "that point",
        }
    }

    /// Where it acts if it is not the trunk at the COM, in words with a comma before them; empty if it is.
    pub fn place(&self) -> String {
        let on = match &self.link[..] {
            TRUNK => String::new(),
            link => format!(", on {link}"),
        };
        match self.point_m {
            PushedPoint::AtCom(_) => on,
            PushedPoint::Point([x, y, z]) => format!(", on {} at {x}, {y}, {z} m", self.link),
        }
    }

    /// The push of a campaign whose file does not state one, for a robot with these units. The impulse has no default.
    pub(super) fn usual(units: &Units) -> Self {
        let Push {
            impulse_n_s,
            heading_deg,
            height_m,
            duration_s,
            start_s,
            profile,
            bob: _,
        } = Push::of(units);
        let [impulse_n_s, heading_deg, height_m, duration_s, start_s] =
            [impulse_n_s, heading_deg, height_m, duration_s, start_s].map(Distribution::Constant);
        Self {
            impulse_n_s,
            heading_deg,
            height_m,
            duration_s,
            start_s,
            profile,
            link: on_trunk(),
            point_m: PushedPoint::default(),
            pendulum: None,
        }
    }

    pub(crate) fn check(&self, file: &str, horizon_s: f64) -> Result<()> {
        let bounds = PushBounds::new(horizon_s);
        if let Some(pendulum) = &self.pendulum {
            pendulum.check(file)?;
        }
        self.impulse_n_s
            .check(file, "push.impulse_n_s", bounds.impulse_n_s)?;
        self.heading_deg
            .check(file, "push.heading_deg", bounds.heading_deg)?;
        self.height_m
            .check(file, "push.height_m", bounds.height_m)?;
        because(
            A_QUARTER,
            self.duration_s
                .check(file, "push.duration_s", bounds.duration_s),
        )?;
        because(
            HALF,
            self.start_s.check(file, "push.start_s", bounds.start_s),
        )
    }
}

/// `[second_push]`: distributions of a push after the first one, with the same height, duration and profile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SecondPushSpec {
    /// Impulse (N s); with 0 there is no second push.
    pub impulse_n_s: Distribution,
    pub heading_deg: Distribution,
    /// Time from the end of the first push to the start of this one (s).
    pub after_s: Distribution,
}

impl SecondPushSpec {
    /// No second push.
    pub(crate) fn none(units: &Units) -> Self {
        let [impulse_n_s, heading_deg, after_s] =
            [0.0, 0.0, 5.626 * units.time_s()].map(Distribution::Constant);
        Self {
            impulse_n_s,
            heading_deg,
            after_s,
        }
    }

    /// Whether there is a second push.
    pub fn is_any(&self) -> bool {
        self.impulse_n_s != Distribution::Constant(0.0)
    }

    /// Whether trials with the same first push can have different second pushes.
    pub(crate) fn is_random(&self) -> bool {
        self.is_any()
            && ![self.impulse_n_s, self.heading_deg, self.after_s]
                .iter()
                .all(Distribution::is_constant)
    }

    /// Accepted values of `after_s`: both pushes must end within three quarters of the episode, as a single push does.
    pub(crate) fn after_bounds(push: &PushSpec, horizon_s: f64) -> [f64; 2] {
        let bounds = PushBounds::new(horizon_s);
        let [_, start_s] = push.start_s.range(bounds.start_s);
        let [_, duration_s] = push.duration_s.range(bounds.duration_s);
        [0.0, 0.75 * horizon_s - start_s - 2.0 * duration_s]
    }

    /// Checks the distributions. The first push (`push`) must be valid.
    pub(crate) fn check(&self, file: &str, push: &PushSpec, horizon_s: f64) -> Result<()> {
        if !self.is_any() {
            return Ok(());
        }
        if push.pendulum.is_some() {
            let problem = "a pendulum strikes once";
            return Err(Error::value(
                file,
                "second_push",
                self,
                problem,
                "no second push beside push.pendulum",
            ));
        }
        let bounds = PushBounds::new(horizon_s);
        self.impulse_n_s
            .check(file, "second_push.impulse_n_s", bounds.impulse_n_s)?;
        self.heading_deg
            .check(file, "second_push.heading_deg", bounds.heading_deg)?;
        let after_s = Self::after_bounds(push, horizon_s);
        if after_s[1] < after_s[0] {
            let accepted =
                "a first push that starts earlier or is shorter, or a longer episode.horizon_s";
            return Err(Error::value(
                file,
                "second_push",
                self,
                "there is no time left for the second push",
                accepted,
            ));
        }
        let horizon_s = digits(horizon_s);
        let why = format!(
            ", since both pushes end within three quarters of episode.horizon_s = {horizon_s}"
        );
        because(
            &why,
            self.after_s.check(file, "second_push.after_s", after_s),
        )
    }
}

impl fmt::Display for SecondPushSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            impulse_n_s,
            heading_deg,
            after_s,
        } = self;
        write!(
            f,
            "impulse {impulse_n_s} N s, heading {heading_deg} deg, {after_s} s after the first"
        )
    }
}
