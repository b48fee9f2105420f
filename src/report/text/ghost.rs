//! The films of two entrants in one trial, in words. On a page the robot of one film is solid, and the robot of the other
//! is a ghost.

use super::story::outcome;
use standfast_sim::episode::Film;
use standfast_sim::episode::parting::{Parting, PartingPoint, SoleContact, half_sole_width_m};

/// How the episodes of two films ended, each with the name of its entrant.
pub fn ended(films: [&Film; 2]) -> [String; 2] {
    films.map(|film| format!("{}: {}", film.controller, outcome(&film.record)))
}

/// When and where two films part, in sentences.
pub fn parted(film: &Film, ghost: &Film) -> String {
    let limit_mm = 1000.0 * half_sole_width_m(&film.robot);
    let Some(parting) = Parting::of_films(film, ghost) else {
        return format!(
            "COM and soles of the two are never more than {limit_mm:.0} mm apart, which is half the width of a sole."
        );
    };
    let places = [film, ghost].map(|film| format!("with {}", film.controller));
    let have_fallen = [film, ghost].into_iter().all(|film| {
        film.record
            .fell_at_s
            .is_some_and(|fell_s| fell_s < parting.at_s)
    });
    let late = if have_fallen {
        " By then both have fallen."
    } else {
        ""
    };
    let words = in_words(&parting, &places);
    format!(
        "{words}{late} (They part when they are more than {limit_mm:.0} mm apart, half the width of a sole.)"
    )
}

/// The time at which two episodes of a trial part, and the states that differ then, each with the time since which it
/// has been so, in sentences. The episodes are named by words such as "with catch".
fn in_words(parting: &Parting, [a, b]: &[String; 2]) -> String {
    let Parting {
        at_s,
        phases,
        loaded,
        ..
    } = parting;
    let what = match parting.of {
        PartingPoint::Com => "COMs",
        PartingPoint::LeftSole => "left soles",
        PartingPoint::RightSole => "right soles",
    };
    let mut text = format!(
        "At {at_s:.3} s the {what} part, {:.0} mm from each other.",
        1000.0 * parting.distance_m
    );
    let states = [
        (
            "Then the controller is in phase",
            phases.each_ref().map(|phase| &**phase),
            parting.phases_since_s,
        ),
        ("The load is on", loaded.map(words), parting.loaded_since_s),
    ];
    for (what, [now_a, now_b], [since_a, since_b]) in states {
        if now_a != now_b {
            text += &format!(
                " {what} {now_a} {a} (since {since_a:.3} s) and {now_b} {b} (since {since_b:.3} s)."
            );
        }
    }
    text
}

fn words(loaded: SoleContact) -> &'static str {
    match loaded {
        SoleContact::BothSoles => "both soles",
        SoleContact::LeftSole => "the left sole",
        SoleContact::RightSole => "the right sole",
        SoleContact::NoSole => "no sole",
    }
}
