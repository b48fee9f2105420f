//! A film as a GIF, in slow motion while something happens, and of limited length.

use super::files::{Palette, gif};
use super::film::{Cast, FramesOptions, end_s, index, pushed_from_s, pushed_until_s};
use image::RgbImage;
use rayon::prelude::*;
use standfast_core::error::Result;

/// Time for which a picture is shown, and time for which the last picture is shown (1/100 s).
const DELAY_CS: u16 = 4;
pub(super) const LAST_DELAY_CS: u16 = 120;
/// Approximate largest number of pictures, and the number of pictures that are in memory at a time and from which the
/// palette is made.
const MOST_SHOTS: usize = 200;
const AT_ONCE: usize = 16;
/// Time before the push at which the GIF begins, and time before the push at which slow motion begins (s).
const LEAD_S: f64 = 0.2;
const SLOW_LEAD_S: f64 = 0.04;
/// Time for which slow motion continues after a landing or a fall, and its largest duration (s).
const SLOW_TAIL_S: f64 = 0.1;
const LONGEST_SLOW_S: f64 = 0.8;

/// A picture of the GIF: index of its snapshot, the time for which it is shown (1/100 s), and the speed as a share of
/// real time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shot {
    pub snapshot: usize,
    pub delay_cs: u16,
    pub speed: f64,
}

/// The three stretches of the films: start and end (s), and speed.
fn stretches(cast: &Cast, slow_motion: f64) -> [(f64, f64, f64); 3] {
    let (film, end_s) = (cast.film, end_s(cast));
    let from_s = (pushed_from_s(film) - LEAD_S).max(0.0);
    let slow_from_s = (pushed_from_s(film) - SLOW_LEAD_S).max(from_s);
    let records = || cast.films().map(|film| &film.record);
    let landings_s = records()
        .flat_map(|record| &record.footsteps.taken)
        .map(|step| step.land_s);
    let falls_s = records().filter_map(|record| record.fell_at_s);
    let slow_to_s = landings_s
        .chain(falls_s)
        .fold(pushed_until_s(film), f64::max)
        + SLOW_TAIL_S;
    let slow_to_s = slow_to_s
        .min(slow_from_s + LONGEST_SLOW_S)
        .min(end_s)
        .max(slow_from_s);
    [
        (from_s, slow_from_s, 1.0),
        (slow_from_s, slow_to_s, slow_motion),
        (slow_to_s, end_s, 1.0),
    ]
}

pub(super) fn shots(cast: &Cast, slow_motion: f64) -> Vec<Shot> {
    let film = cast.film;
    let delay_s = f64::from(DELAY_CS) / 100.0;
    let count = |(from_s, to_s, speed): (f64, f64, f64)| {
        ((to_s - from_s) / (delay_s * speed)).round() as usize
    };
    let mut stretches = stretches(cast, slow_motion);
    // If the robot takes long to come to rest, the last stretch is shown faster.
    let room = MOST_SHOTS
        .saturating_sub(count(stretches[0]) + count(stretches[1]))
        .max(MOST_SHOTS / 4);
    stretches[2].2 = (count(stretches[2]) as f64 / room as f64).ceil().max(1.0);
    let mut shots = Vec::new();
    for (from_s, to_s, speed) in stretches {
        let count = count((from_s, to_s, speed));
        shots.extend((0..count).map(|i| Shot {
            snapshot: index(film, from_s + i as f64 * delay_s * speed),
            delay_cs: DELAY_CS,
            speed,
        }));
    }
    shots.push(Shot {
        snapshot: index(film, end_s(cast)),
        delay_cs: LAST_DELAY_CS,
        speed: 1.0,
    });
    shots
}

/// The bytes of the film as a GIF.
pub(super) fn moving(cast: &Cast, options: &FramesOptions) -> Result<Vec<u8>> {
    let shots = shots(cast, options.slow_motion);
    // Every third picture is enough to know how far the robot gets.
    let some = shots
        .iter()
        .step_by(3)
        .chain(shots.last())
        .map(|shot| shot.snapshot);
    let size = cast.size_of_one(options.gif_size);
    let camera = cast.camera(some, size);
    let shown = |shot: &Shot| {
        let speed = if shot.speed == 1.0 {
            String::new()
        } else {
            format!("({} x)", shot.speed)
        };
        cast.picture(shot.snapshot, &camera, size, &speed)
    };
    let some: Vec<&Shot> = shots
        .iter()
        .step_by(shots.len().div_ceil(AT_ONCE))
        .collect();
    let palette = Palette::of(&some.into_par_iter().map(shown).collect::<Vec<_>>());
    let some_at_a_time = shots.chunks(AT_ONCE).flat_map(|shots| {
        let images: Vec<RgbImage> = shots.par_iter().map(shown).collect();
        images
            .into_iter()
            .zip(shots.iter().map(|shot| shot.delay_cs))
    });
    gif(palette, some_at_a_time)
}
