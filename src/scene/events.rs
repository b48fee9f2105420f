//! The events of a film, for a time line.

use serde::Serialize;
use standfast_sim::episode::parting::Parting;
use standfast_sim::episode::{Film, Snapshot};

/// An event: its kind, its beginning and end (s), and a short description.
#[derive(Debug, Clone, Serialize)]
pub struct Event {
    pub kind: EventKind,
    pub from_s: f64,
    pub to_s: f64,
    pub text: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EventKind {
    Push,
    /// The controller switches from one gain to another.
    Switch,
    Footstep,
    /// The legs meet for the first time.
    Legs,
    Fall,
    /// The robot stands still from here on.
    Still,
    /// The robot and its ghost part.
    Parting,
}

/// The events in `ticks`, the first snapshots of a film, and the time at which it parts from the film of a ghost. An
/// event after the last of `ticks` is left out, such as a second push after a fall. The events are in order of time.
pub fn events(film: &Film, ticks: &[Snapshot], ghost: Option<&Film>) -> Vec<Event> {
    let record = &film.record;
    let last_s = ticks.last().map_or(record.end_s, |tick| tick.time_s);
    let mut events = Vec::new();
    let mut add = |kind, from_s: f64, to_s, text| {
        if from_s <= last_s + 1e-9 {
            events.push(Event {
                kind,
                from_s,
                to_s,
                text,
            });
        }
    };
    for push in &film.pushes {
        let text = format!(
            "push of {:.2} N s towards {:.0}°",
            push.impulse_n_s, push.heading_deg
        );
        add(EventKind::Push, push.start_s, push.end_s(), text);
    }
    for pair in ticks.windows(2) {
        if let (Some(before), Some(after)) = (&pair[0].gain, &pair[1].gain)
            && before != after
        {
            let text = format!("gain {before} to {after}");
            add(EventKind::Switch, pair[1].time_s, pair[1].time_s, text);
        }
    }
    for step in &record.footsteps.taken {
        let held = match step.in_set_at_landing {
            Some(true) => "; at its landing the new sets hold the state",
            Some(false) => "; at its landing no new set holds the state",
            None => "",
        };
        let text = format!("{} footstep{held}", step.foot.name());
        add(EventKind::Footstep, step.lift_s, step.land_s, text);
    }
    if let Some(lifted) = &record.footsteps.lifted {
        let text = format!("{} footstep, which did not land", lifted.foot.name());
        add(
            EventKind::Footstep,
            lifted.lift_s,
            record.fell_at_s.unwrap_or(last_s),
            text,
        );
    }
    if let (Some(at), Some(links)) = (record.legs_met_at_s, &record.legs_met) {
        add(EventKind::Legs, at, at, format!("legs met: {links}"));
    }
    if let Some(at) = record.fell_at_s {
        let cause = record.fall_cause.as_deref().unwrap_or("out of bounds");
        let text = format!("{}: {cause}", record.outcome.name());
        add(EventKind::Fall, at, at, text);
    }
    if let Some(at) = record.settled_at_s {
        add(EventKind::Still, at, at, "standing still from here".into());
    }
    if let Some(Parting { at_s, .. }) = ghost.and_then(|ghost| Parting::of_films(film, ghost)) {
        add(
            EventKind::Parting,
            at_s,
            at_s,
            "the robot and its ghost part".into(),
        );
    }
    events.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    events
}
