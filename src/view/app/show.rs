//! What the window shows, a live simulation or a recording, and what it needs to know of either.

use super::camera::Lens;
use super::live::Live;
use super::pick::pick_near;
use super::plots::Trail;
use super::recorded::Recorded;
use crate::episode::{Outcome, Snapshot};
use crate::render::scene::palette::Overlay;
use crate::render::scene::{Mark, Stage, arrow_along};
use crate::robot::Kinematics;
use kiss3d::egui::Pos2;

/// A number of things with the noun in singular or plural.
pub fn several(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// What the window shows.
pub enum Show<'a> {
    Live(Box<Live<'a>>),
    Recorded(Box<Recorded>),
}

impl Show<'_> {
    pub fn is_live(&self) -> bool {
        matches!(self, Show::Live(_))
    }

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

    /// The state of the live robot, or the end of the trial, in words, and whether it is bad.
    pub fn verdict(&self) -> (String, bool) {
        let (record, is_held) = match self {
            Show::Live(live) => (live.record(), live.grab.is_some()),
            Show::Recorded(recorded) => (&recorded.film.record, false),
        };
        let (end_s, is_live) = (record.end_s, self.is_live());
        match (record.outcome, record.settled_at_s) {
            (Outcome::Fell, _) => {
                let cause = record.fall_cause.as_deref().unwrap_or("fell");
                (format!("fell at {:.2} s: {cause}", record.fell_at_s.unwrap_or(end_s)), true)
            }
            (Outcome::Diverged, _) => (format!("diverged at {end_s:.2} s"), true),
            _ if is_held => ("held by hand".into(), false),
            (_, Some(since_s)) if is_live => (format!("has stood still since {since_s:.2} s"), false),
            (Outcome::Recovered, since_s) => {
                (format!("recovered: it stands still from {:.2} s on", since_s.unwrap_or(end_s)), false)
            }
            (Outcome::TimedOut, _) if is_live => ("in motion".into(), false),
            (Outcome::TimedOut, _) => (format!("it neither fell nor came to rest in {end_s:.2} s"), true),
        }
    }

    /// The marks, among them a push that has just ended, and the pull of the mouse.
    pub fn marks(&self, stage: &Stage, shown: &[Overlay]) -> Vec<Mark> {
        let Show::Live(live) = self else { return stage.marks(self.now(), shown) };
        let (push, hand) = live.forces();
        let mut marks = stage.marks(&Snapshot { push, ..live.now.clone() }, shown);
        let hand = hand.filter(|_| shown.contains(&Overlay::Push));
        // The arrow begins at the point that is pulled.
        let drawing = hand.and_then(|hand| arrow_along(Overlay::Push, &hand, false, stage.scale));
        marks.extend(drawing.map(|drawing| Mark { overlay: Overlay::Push, drawing }));
        marks
    }

    /// Name of the link that a drag from this place would pull. None while a link is pulled.
    pub fn link_at(&self, stage: &Stage, lens: &Lens, mouse: Pos2) -> Option<&str> {
        let Show::Live(live) = self else { return None };
        let hit = pick_near(stage, &live.kinematics, lens, mouse).filter(|_| live.grab.is_none())?;
        Some(live.world.simulated.links[hit.link].name.as_str())
    }

    /// Control period (s).
    pub fn step_s(&self) -> f64 {
        match self {
            Show::Live(live) => live.world.config.control_period_s,
            Show::Recorded(recorded) => recorded.film.control_period_s,
        }
    }

    /// What happened, in two lines.
    pub fn account(&self) -> String {
        match self {
            Show::Live(live) => {
                let counts = live.counts;
                format!(
                    "{}, {} (up to {:.1} N), {}, {}, {}; the COM was up to {:.1} mm from its start\n\
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
                self.verdict().0,
                recorded.now().time_s,
                recorded.film.snapshots.len()
            ),
        }
    }
}
