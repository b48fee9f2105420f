//! Two films of one trial in words. In pictures the robot of one is solid, and that of the other is a ghost.

use super::agreement::in_words;
use super::story::outcome;
use crate::episode::Film;
use crate::episode::parting::{Parting, half_sole_width_m};

/// The engine of a film, and how the episode ended in it.
pub fn ended(film: &Film) -> String {
    format!("{}: {}", film.engine.with_version(), outcome(&film.record))
}

/// Where two films part, in sentences.
pub fn parted(film: &Film, ghost: &Film) -> String {
    let limit_mm = 1000.0 * half_sole_width_m(&film.robot);
    let Some(parting) = Parting::of_films(film, ghost) else {
        return format!(
            "COM and soles of the two are never more than {limit_mm:.0} mm apart, which is half the width of a sole."
        );
    };
    let has_fallen = |film: &Film| film.record.fell_at_s.is_some_and(|fell_s| fell_s < parting.at_s);
    let late = if [film, ghost].into_iter().all(has_fallen) { " By then both have fallen." } else { "" };
    let told = in_words(&parting, [film.engine, ghost.engine]);
    format!("{told}{late} (They part when they are more than {limit_mm:.0} mm apart, half the width of a sole.)")
}
