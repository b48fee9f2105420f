//! What is shown: a live robot or a recording. What the window needs of either.

use super::live::Live;
use super::pick::{self, Sight};
use super::plots::Trail;
use super::recorded::Recorded;
use crate::episode::Snapshot;
use crate::episode::snapshot::Arrow;
use crate::robot::Kinematics;

/// A number of things, in words.
pub fn several(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

pub enum Show<'a> {
    Live(Box<Live<'a>>),
    Recorded(Box<Recorded>),
}

impl Show<'_> {
    pub fn now(&self) -> &Snapshot {
        match self {
            Show::Live(live) => &live.now,
            Show::Recorded(recorded) => recorded.now(),
        }
    }

    pub fn kinematics(&self) -> &Kinematics {
        match self {
            Show::Live(live) => &live.kinematics,
            Show::Recorded(recorded) => &recorded.kinematics,
        }
    }

    pub fn trail(&self) -> &Trail {
        match self {
            Show::Live(live) => &live.trail,
            Show::Recorded(recorded) => &recorded.trail,
        }
    }

    /// How the robot fares, in words; true if badly.
    pub fn verdict(&self) -> (String, bool) {
        match self {
            Show::Live(live) => live.verdict(),
            Show::Recorded(recorded) => recorded.verdict(),
        }
    }

    /// The force to be seen on the robot.
    pub fn force(&self) -> Option<Arrow> {
        match self {
            Show::Live(live) => live.force(),
            Show::Recorded(recorded) => recorded.now().push,
        }
    }

    /// Name of the link under the mouse that can be pulled; none while one is.
    pub fn link_at(&self, sight: &Sight) -> Option<&str> {
        let Show::Live(live) = self else { return None };
        if live.grab.is_some() {
            return None;
        }
        let robot = &live.world.simulated;
        let hit = pick::pick(robot, &live.kinematics, sight)?;
        Some(robot.links[hit.link].name.as_str())
    }

    /// How long a tick lasts (s).
    pub fn step_s(&self) -> f64 {
        match self {
            Show::Live(live) => live.world.config.control_period_s,
            Show::Recorded(recorded) => recorded.film.control_period_s,
        }
    }

    /// Names of the gain sets to choose from, which of them acts, and the names of its gains, slow to fast.
    pub fn gain_sets(&self) -> (Vec<String>, usize, Vec<String>) {
        match self {
            Show::Live(live) => {
                let world = live.world;
                let names = world.designs.iter().map(|design| design.family.name.clone()).collect();
                let gains = &world.designs[live.acting].family.gains;
                (names, live.acting, gains.iter().map(|gain| gain.name.clone()).collect())
            }
            Show::Recorded(recorded) => (Vec::new(), 0, recorded.film.gains.clone()),
        }
    }

    /// How a recording differs from what it should be, in words.
    pub fn difference(&self) -> Option<&str> {
        let Show::Recorded(recorded) = self else { return None };
        recorded.difference.as_deref()
    }

    /// Name and length (s) of a recording.
    pub fn recording(&self) -> Option<(String, f64)> {
        let Show::Recorded(recorded) = self else { return None };
        Some((format!("trial {} of {}", recorded.trial, recorded.film.gain_set), recorded.end_s()))
    }

    /// What happened, in a line or two.
    pub fn account(&self) -> String {
        match self {
            Show::Live(live) => {
                let counts = live.counts;
                format!(
                    "{}, {} (up to {:.1} N), {}, {}, {}; COM up to {:.1} mm from its start\n\
                     {} ({} single), {:.3} s simulated",
                    several(counts.pushes.into(), "push", "pushes"),
                    several(counts.drags.into(), "drag", "drags"),
                    counts.drag_n,
                    several(counts.switches.into(), "gain switch", "gain switches"),
                    several(counts.restarts.into(), "restart", "restarts"),
                    several(counts.falls.into(), "fall", "falls"),
                    1000.0 * counts.com_m,
                    several(counts.ticks, "tick", "ticks"),
                    counts.single_ticks,
                    counts.ticks as f64 * self.step_s()
                )
            }
            Show::Recorded(recorded) => format!(
                "trial {}, gain set {}: {}; shown at {:.3} s\n{} ticks recorded",
                recorded.trial,
                recorded.film.gain_set,
                recorded.verdict().0,
                recorded.now().time_s,
                recorded.film.snapshots.len()
            ),
        }
    }
}
