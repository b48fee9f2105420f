//! Two films of one trial in words: in two engines, or with two controllers. On a page the robot of one film is
//! solid, and the robot of the other is a ghost.

use super::agreement::in_words;
use super::story::outcome;
use standfast_sim::episode::Film;
use standfast_sim::episode::parting::{Parting, half_sole_width_m};

/// The names that distinguish two films: the controllers or, if these are the same, the engines.
pub fn names(films: [&Film; 2]) -> [String; 2] {
    let [a, b] = films;
    films.map(|film| {
        if a.has_controller_of(b) {
            film.engine.title().into()
        } else {
            film.controller.clone()
        }
    })
}

/// How the episodes of two films ended, each with its distinguishing name.
pub fn ended(films: [&Film; 2]) -> [String; 2] {
    let [a, b] = films;
    films.map(|film| {
        let name = if a.has_controller_of(b) {
            film.engine.with_version()
        } else {
            film.controller.clone()
        };
        format!("{name}: {}", outcome(&film.record))
    })
}

/// When and where two films part, in sentences.
pub fn parted(film: &Film, ghost: &Film) -> String {
    let limit_mm = 1000.0 * half_sole_width_m(&film.robot);
    let Some(parting) = Parting::of_films(film, ghost) else {
        return format!(
            "COM and soles of the two are never more than {limit_mm:.0} mm apart, which is half the width of a sole."
        );
    };
    let place = if film.has_controller_of(ghost) {
        "in"
    } else {
        "with"
    };
    let places = names([film, ghost]).map(|name| format!("{place} {name}"));
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
