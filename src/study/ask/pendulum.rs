//! `[push.pendulum]`: the pendulum of a campaign, and RoboCup's rules for it (RoboCup-Humanoid-TC/Rules, push recovery).

use crate::ask::bounds::{because, in_range};
use crate::ask::distribution::Distribution;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_sim::pendulum::check_at_home;
use standfast_sim::{Bob, Push};
use std::fmt;

/// `[push.pendulum]`: a bob on a rope that is drawn back horizontally and released, and comes as a [`Bob`] does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PendulumSpec {
    /// If it is left out: that of RoboCup's rules for the size of the robot, 1 or 3 kg.
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

    pub(super) fn check(&self, file: &str) -> Result<()> {
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

/// Mass of the bob (kg) for the size class of a robot. A robot with its COM at 0.55 m is about 1 m tall, where adult size
/// begins. (The rules of 2019 to 2024 have 1 kg below; that of 2025 has 3 kg for all.)
pub(super) fn of_size_class_kg(units: &Units) -> f64 {
    if units.length_m < 0.55 { 1.0 } else { 3.0 }
}

/// The ranking metric of RoboCup's push recovery, sqrt(H) / h_c * m_B / m_R * h_i / h_c (1 / sqrt(m)), for a strike at
/// `height_m` above the COM: H is the height from which the bob falls, m_B its mass and h_i its height at the strike; m_R and
/// h_c are the mass of the robot and the height of its COM.
pub fn robocup_m(bob: &Bob, draw_m: f64, height_m: f64, units: &Units) -> f64 {
    let com_m = units.length_m;
    let mass_share = bob.mass_kg / units.mass_kg;
    bob.fall_m(draw_m).sqrt() / com_m * mass_share * (com_m + height_m) / com_m
}
