//! What the window shows, a live simulation or a recording, and what it needs to know of either.

use super::camera::Lens;
use super::live::Live;
use super::pick::pick_near;
use super::plots::Trail;
use super::recorded::{Recorded, Reel};
use super::simulation::Simulation;
use crate::episode::{Outcome, Record, Snapshot};
use crate::render::scene::palette::Overlay;
use crate::render::scene::{Mark, Stage, arrow_along};
use crate::robot::Kinematics;
use crate::sim::Engine;
use kiss3d::egui::Pos2;

/// A number of things with the noun in singular or plural.
pub fn several(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// The robot in the other engine: its moment, and what has become of it.
pub struct Ghost<'a> {
    pub engine: Engine,
    pub now: &'a Snapshot,
    pub kinematics: &'a Kinematics,
    pub trail: &'a Trail,
    pub record: &'a Record,
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
            Show::Live(live) => &live.shown.now,
            Show::Recorded(recorded) => recorded.now(),
        }
    }

    pub fn kinematics(&self) -> &Kinematics {
        match self {
            Show::Live(live) => &live.shown.kinematics,
            Show::Recorded(recorded) => &recorded.shown.kinematics,
        }
    }

    pub fn trail(&self) -> &Trail {
        match self {
            Show::Live(live) => &live.shown.trail,
            Show::Recorded(recorded) => &recorded.shown.trail,
        }
    }

    pub fn engine(&self) -> Engine {
        match self {
            Show::Live(live) => live.shown.config.engine,
            Show::Recorded(recorded) => recorded.shown.film.engine,
        }
    }

    /// The robot in the other engine.
    pub fn ghost(&self) -> Option<Ghost<'_>> {
        match self {
            Show::Live(live) => live.ghost.as_ref().map(|ghost| {
                let Simulation { config, now, kinematics, trail, .. } = ghost;
                Ghost { engine: config.engine, now, kinematics, trail, record: ghost.record() }
            }),
            Show::Recorded(recorded) => recorded.ghost.as_ref().map(|ghost| {
                let Reel { film, kinematics, trail, .. } = ghost;
                Ghost { engine: film.engine, now: ghost.now(), kinematics, trail, record: &film.record }
            }),
        }
    }

    /// The state of the live robot, or the end of the trial, in words, and whether it is bad.
    pub fn verdict(&self) -> (String, bool) {
        self.verdict_on(match self {
            Show::Live(live) => live.shown.record(),
            Show::Recorded(recorded) => &recorded.shown.film.record,
        })
    }

    /// The same of the robot or its ghost, whose record this is.
    pub fn verdict_on(&self, record: &Record) -> (String, bool) {
        let is_held = matches!(self, Show::Live(live) if live.grab.is_some());
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
        let mut marks = stage.marks(&Snapshot { push, ..live.shown.now.clone() }, shown);
        let hand = hand.filter(|_| shown.contains(&Overlay::Push));
        // The arrow begins at the point that is pulled.
        let drawing = hand.and_then(|hand| arrow_along(Overlay::Push, &hand, false, stage.scale));
        marks.extend(drawing.map(|drawing| Mark { overlay: Overlay::Push, drawing }));
        marks
    }

    /// Name of the link that a drag from this place would pull. None while a link is pulled.
    pub fn link_at(&self, stage: &Stage, lens: &Lens, mouse: Pos2) -> Option<&str> {
        let Show::Live(live) = self else { return None };
        let hit = pick_near(stage, &live.shown.kinematics, lens, mouse).filter(|_| live.grab.is_none())?;
        Some(live.world.simulated.links[hit.link].name.as_str())
    }

    /// Control period (s).
    pub fn step_s(&self) -> f64 {
        match self {
            Show::Live(live) => live.world.config.control_period_s,
            Show::Recorded(recorded) => recorded.shown.film.control_period_s,
        }
    }

    /// What happened, in two lines, and a third one on a ghost.
    pub fn account(&self) -> String {
        let ghost = self.ghost().map(|Ghost { engine, record, .. }| {
            format!("\nghost, in {}: {}", engine.title(), self.verdict_on(record).0)
        });
        let shown = match self {
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
                recorded.shown.film.gain_set,
                self.verdict().0,
                recorded.now().time_s,
                recorded.shown.film.snapshots.len()
            ),
        };
        shown + &ghost.unwrap_or_default()
    }
}
