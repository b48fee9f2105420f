//! The result of `standfast ceiling` as text: the lost pushes that can be caught, and the departures with which they
//! are.

use crate::table::{Table, cell, number, texts, words};
use crate::text::layout::{percent, plant_options, signed, wrapped};
use standfast_core::lipm::catching::Departure;
use standfast_files::shell_word;
use standfast_stats::rate::SuccessCount;
use standfast_study::ceiling::{Ceiling, HELD, LostTrial, NEIGHBOURS};
use std::path::Path;

/// Names of the numbers of a departure, in the order of [`Departure::numbers`].
const NAMES: [&str; Departure::NUMBERS] = [
    "time of lifting",
    "which foot",
    "crossed or not",
    "landing place forward",
    "landing place sideways",
    "ZMP forward",
    "ZMP sideways",
    "swing time",
    "roll of the trunk",
    "pitch of the trunk",
    "COM height",
];

/// The file of a recovery.
pub fn file(trial: u64) -> String {
    format!("trial-{trial}.toml")
}

/// The result. `folder` is the folder of the written recoveries, and `changes` are the options that changed the
/// campaign.
pub fn text(ceiling: &Ceiling, folder: &Path, changes: &str) -> String {
    let Ceiling {
        robot,
        campaign,
        seed,
        engine,
        controller,
        alone,
        with_search,
        tries,
        ..
    } = ceiling;
    let recovered: Vec<&LostTrial> = ceiling
        .lost
        .iter()
        .filter(|lost| lost.found.is_some())
        .collect();
    let mut text =
        format!("What {controller} could catch: {robot}, campaign {campaign}, seed {seed}\n");
    text += &wrapped("engine:   ", engine);
    text += &wrapped(
        "alone:    ",
        &format!("{controller} recovers from {}", told(alone)),
    );
    let more = format!(
        "with knowledge of each lost push and up to {tries} tries, from {} more; at least {} can be caught",
        recovered.len(),
        told(with_search)
    );
    text += &wrapped("search:   ", &more);
    let lucky = ceiling.lost.iter().filter(|lost| {
        let held = lost.most_held;
        lost.found.is_none() && held.is_some()
    });
    let unlucky = ceiling.lost.iter().filter(|lost| lost.alone_held >= HELD);
    let luck = format!(
        "{} more were survived, but fewer than {HELD} of their {NEIGHBOURS} neighbours were; of the lost pushes, {controller} \
         alone survives {HELD} neighbours or more of {}",
        lucky.count(),
        unlucky.count()
    );
    text += &wrapped("luck:     ", &luck);
    if ceiling.lost.is_empty() {
        return text;
    }
    let columns = [
        number("trial"),
        number("N s"),
        number("heading"),
        number("of one"),
        number("tries"),
        number("alone"),
        number("held"),
        words("caught by"),
    ];
    let mut table = Table::new("", columns);
    for lost in &ceiling.lost {
        let by = match &lost.found {
            Some(recovery) => {
                let footsteps: Vec<String> = (1..)
                    .zip(&recovery.departures)
                    .filter_map(|(number, departure)| of_footstep(number, departure, ceiling))
                    .collect();
                footsteps.join("; ")
            }
            None => "not recovered by search".into(),
        };
        let [impulse, heading] = [
            format!("{:.2}", lost.impulse_n_s),
            format!("{:.0}", lost.heading_deg),
        ];
        let numbers = [
            lost.trial.to_string(),
            impulse,
            heading,
            lost.of_one_step_bound
                .map_or(String::new(), |of| format!("{of:.2}")),
        ];
        let held = [
            Some(lost.alone_held),
            lost.found
                .as_ref()
                .map(|found| found.held)
                .or(lost.most_held),
        ];
        let held = held.map(|held| held.map_or("-".into(), |held| format!("{held}/{NEIGHBOURS}")));
        table.row(
            texts(numbers)
                .chain([cell(lost.tries)])
                .chain(texts(held))
                .chain([cell(by)]),
        );
    }
    text += &format!("\n{}\n", table.text());
    let mut needed: Vec<(usize, &str)> = NAMES
        .iter()
        .enumerate()
        .map(|(i, name)| (needs(&recovered, i), *name))
        .collect();
    needed.sort_by_key(|&(count, _)| std::cmp::Reverse(count));
    let needed = needed
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, name)| format!("{name} {count}"));
    if !recovered.is_empty() {
        text += &wrapped(
            "",
            &format!(
                "How many of these recoveries need what: {}.",
                needed.collect::<Vec<_>>().join(", ")
            ),
        );
    }
    text += &wrapped(
        "",
        "`of one` is the ratio of the impulse to the pendulum bound with one footstep. The neighbours of a push are up to 3 % \
         weaker or harder, come up to 10 ms earlier or later, and have other noise; `alone` is how many of them the controller \
         survives, and `held` how many the recovery does. `caught by` has what the robot does \
         otherwise than the controller, footstep by footstep; without any one of these too many fall. A foot is lifted when the \
         DCM is so far outside of the support. Landing places and the ZMP are shifted forward, and to the side of the foot \
         in the air; the trunk tilts about its x and y axes. What is not recovered by search may be possible all the same.",
    );
    if let Some(lost) = recovered.first() {
        let plant = plant_options(robot, engine);
        let gains = shell_word(&folder.join(file(lost.trial)).to_string_lossy());
        text += &format!(
            "to see one beside the controller:\n  standfast push --campaign {campaign} --seed {seed}{changes} --trial {}{plant} \\\n    \
             --controller {gains} --beside {controller} --replay caught.html\n",
            lost.trial
        );
    }
    text
}

fn told(count: &SuccessCount) -> String {
    let [low, high] = count.ci95.map(|rate| format!("{:.1}", 100.0 * rate));
    format!(
        "{} of {} ({}, 95 % interval {low} to {high})",
        count.recovered,
        count.trials,
        percent(count.success_rate)
    )
}

/// Number of recoveries that need a value other than zero of a number.
fn needs(found: &[&LostTrial], number: usize) -> usize {
    found
        .iter()
        .filter(|lost| {
            lost.found
                .iter()
                .flat_map(|found| &found.departures)
                .any(|departure| departure.numbers()[number] != 0.0)
        })
        .count()
}

/// The differences of a footstep from the controller's own, in words. None if there are none.
fn of_footstep(number: usize, departure: &Departure, ceiling: &Ceiling) -> Option<String> {
    let Departure {
        lift,
        left,
        crossed,
        place: [x, y],
        zmp: [zmp_x, zmp_y],
        slower,
        tilt: [roll, pitch],
        lower,
    } = *departure;
    let mm = |share: f64| format!("{} mm", signed(1e3 * ceiling.com_height_m * share, 0));
    let degrees = |angle: f64| format!("{} degrees", signed(angle.to_degrees(), 0));
    let parts = [
        (lift, format!("lifted {} outside", mm(lift))),
        (
            left,
            if left < 0.0 {
                "rather the left foot".into()
            } else {
                "rather the right foot".into()
            },
        ),
        (
            crossed,
            if crossed < 0.0 {
                "rather crossed".into()
            } else {
                "rather not crossed".into()
            },
        ),
        (x, format!("lands {} forward", mm(x))),
        (y, format!("lands {} outward", mm(y))),
        (zmp_x, format!("ZMP {} forward", mm(zmp_x))),
        (zmp_y, format!("ZMP {} outward", mm(zmp_y))),
        (
            slower,
            format!("swing {} %", signed(100.0 * (slower.exp() - 1.0), 0)),
        ),
        (roll, format!("rolls {}", degrees(roll))),
        (pitch, format!("pitches {}", degrees(pitch))),
        (lower, format!("COM {}", mm(-lower))),
    ];
    let words: Vec<String> = parts
        .into_iter()
        .filter(|(size, _)| *size != 0.0)
        .map(|(_, words)| words)
        .collect();
    (!words.is_empty()).then(|| format!("{number}: {}", words.join(", ")))
}
