//! The distributions of pushes in a campaign: `[push]` and `[second_push]`.

use crate::ask::bounds::{A_QUARTER, HALF, PushBounds, because, digits, in_range};
use crate::ask::distribution::Distribution;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{PushPoint, Robot, Units};
use standfast_sim::pendulum::check_at_home;
use standfast_sim::{Bob, Profile, Push};
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

/// `[push.pendulum]`: a bob on a rope that is drawn back horizontally and released, and comes as a [`Bob`] does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PendulumSpec {
    pub mass_kg: f64,
    pub rope_m: f64,
    pub draw_m: Distribution,
    #[serde(default = "of_bottle_m")]
    pub radius_m: f64,
    #[serde(default = "of_rig_n_m")]
    pub stiffness_n_m: f64,
    #[serde(default = "of_rig")]
    pub restitution: f64,
}

/// Radius of a bottle with 2 kg of water (m).
fn of_bottle_m() -> f64 {
    0.08
}

/// Stiffness (N/m) and restitution of a padding with which strikes are as those that EUROBENCH's DysTurbance rig measured; the
/// chapter `limits` of the guide compares them.
fn of_rig_n_m() -> f64 {
    9e4
}

fn of_rig() -> f64 {
    0.5
}

/// The keys of a push that follow from its pendulum.
pub(super) const OF_PENDULUM: [&str; 3] = ["impulse_n_s", "duration_s", "profile"];

impl PendulumSpec {
    pub fn bob(&self) -> Bob {
        let Self {
            mass_kg,
            rope_m,
            draw_m: _,
            radius_m,
            stiffness_n_m,
            restitution,
        } = *self;
        Bob {
            mass_kg,
            rope_m,
            radius_m,
            stiffness_n_m,
            restitution,
        }
    }

    /// Accepted drawbacks (m).
    pub(crate) fn draws_m(&self) -> [f64; 2] {
        [0.0, self.rope_m]
    }

    fn check(&self, file: &str) -> Result<()> {
        check_bob(file, "push.pendulum", &self.bob())?;
        let checked = self
            .draw_m
            .check(file, "push.pendulum.draw_m", self.draws_m());
        because(", the length of the rope", checked)
    }
}

/// Checks the numbers of a bob, which a file states in `table`.
pub fn check_bob(file: &str, table: &str, bob: &Bob) -> Result<()> {
    for (field, value, bounds) in [
        ("mass_kg", bob.mass_kg, [1e-3, 1e5]),
        ("rope_m", bob.rope_m, [0.05, 100.0]),
        ("radius_m", bob.radius_m, [1e-3, 10.0]),
        ("stiffness_n_m", bob.stiffness_n_m, [1.0, 1e9]),
        ("restitution", bob.restitution, [0.05, 1.0]),
    ] {
        in_range(file, &format!("{table}.{field}"), value, bounds)?;
    }
    Ok(())
}

/// Checks that the bob of a push comes freely to a robot at home, and touches it.
pub fn check_strike(file: &str, robot: &Robot, push: &Push, bob: &Bob) -> Result<()> {
    check_at_home(robot, push, bob).map_err(|[problem, accepted]| {
        let problem = format!("towards {} degrees {problem}", push.heading_deg);
        Error::value(file, "push.height_m", push.height_m, problem, accepted)
    })
}

impl fmt::Display for PendulumSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            mass_kg,
            rope_m,
            draw_m,
            ..
        } = self;
        write!(
            f,
            "bob of {mass_kg} kg on a rope of {rope_m} m, drawn back by {draw_m} m"
        )
    }
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

    /// Checks that a bob comes to the robot at home from the ends of the ranges of heading, height and drawback, and from the
    /// middle of the headings.
    fn check_pendulum(&self, robot: &Robot, point: PushPoint, file: &str) -> Result<()> {
        let Some(pendulum) = &self.pendulum else {
            return Ok(());
        };
        let robot = Robot {
            pushed: point,
            ..robot.clone()
        };
        let ends = |distribution: Distribution| match distribution {
            Distribution::Uniform { uniform } => uniform,
            other => [other.mean(); 2],
        };
        let bob = pendulum.bob();
        for height_m in ends(self.height_m) {
            for draw_m in ends(pendulum.draw_m) {
                let [from_deg, to_deg] = ends(self.heading_deg);
                for heading_deg in [from_deg, 0.5 * (from_deg + to_deg), to_deg] {
                    let push = Push {
                        heading_deg,
                        height_m,
                        impulse_n_s: bob.momentum_n_s(draw_m),
                        bob: Some(bob),
                        ..Push::default()
                    };
                    check_strike(file, &robot, &push, &bob)?;
                }
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
        let of = |draw_m: f64| bob.momentum_n_s(draw_m);
        self.impulse_n_s = match pendulum.draw_m {
            Distribution::Constant(draw_m) => Distribution::Constant(of(draw_m)),
            Distribution::Uniform { uniform } => Distribution::Uniform {
                uniform: uniform.map(of),
            },
            Distribution::Normal { normal: [mean, sd] } => Distribution::Normal {
                normal: [of(mean), of(sd)],
            },
        };
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
