//! Two films of one trial in words. In pictures the robot of one is solid, and that of the other is a ghost.

use super::story::outcome;
use crate::episode::{Film, Parting};

/// The engine of a film, and how the episode ended in it.
pub fn ended(film: &Film) -> String {
    format!("{}: {}", film.engine.with_version(), outcome(&film.record))
}

/// Where two films part, in a sentence.
pub fn parted(film: &Film, ghost: &Film) -> String {
    let limit_mm = 1000.0 * Parting::limit_m(&film.robot);
    match Parting::of(film, ghost) {
        Some(Parting { time_s, point, apart_m }) => {
            let has_fallen = |film: &Film| film.record.fell_at_s.is_some_and(|fell_s| fell_s < time_s);
            let late = if [film, ghost].into_iter().all(has_fallen) { ", after both have fallen" } else { "" };
            format!(
                "The two part at t = {time_s:.3} s{late}: the {point} of one is {:.1} mm from that of the other. The limit \
                 is half the smaller width of a sole, {limit_mm:.1} mm.",
                1000.0 * apart_m
            )
        }
        None => format!(
            "The two stay together: COM and soles of one are always within {limit_mm:.1} mm of those of the other, which is \
             half the smaller width of a sole."
        ),
    }
}
