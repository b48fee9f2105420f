//! Tables of the trials of each controller.

use crate::table::{Cell, CellMark, Table, TableColumn, cell, headings, number, texts, words};
use crate::text::layout::{percent, seconds, velocity_change};
use standfast_stats::curve::{Level, NoCurve};
use standfast_stats::rate::SuccessCount;
use standfast_study::Summary;
use standfast_study::verdict::controller_summary::{ControllerSummary, FittedCurve};
use standfast_study::verdict::failures::Failures;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::iter::once;

/// How often each controller recovered.
pub(super) fn rates(summary: &Summary) -> Table {
    // An outcome that no controller had gets no column.
    type RareOutcome = (&'static str, fn(&ControllerSummary) -> u64);
    let rare: [RareOutcome; 4] = [
        ("broke", |controller| controller.broke),
        ("diverged", |controller| controller.diverged),
        ("failed", |controller| controller.failed),
        ("timed out", |controller| controller.timed_out),
    ];
    let rare: Vec<_> = rare
        .into_iter()
        .filter(|(_, count)| {
            summary
                .controllers
                .iter()
                .any(|controller| count(controller) > 0)
        })
        .collect();
    let columns = headings("controller", ["recovered", "rate", "95 %", "fell"]);
    let columns = columns.chain(rare.iter().map(|(label, _)| number(*label)));
    // If every trial ended standing or fallen, survival equals recovery and needs no column.
    let lingers = summary
        .controllers
        .iter()
        .any(|controller| controller.survived.recovered != controller.count.recovered);
    let mut table = Table::new(
        "Rates of recovery",
        columns.chain(lingers.then(|| number("survived, 95 %"))),
    );
    for (i, controller) in summary.controllers.iter().enumerate() {
        let SuccessCount {
            trials,
            recovered,
            success_rate,
            ci95: [low, high],
        } = controller.count;
        let interval = format!("{:.1}-{}", 100.0 * low, percent(high));
        let cells = [
            cell(format!("{recovered}/{trials}")),
            rate(percent(success_rate), controller.count, i),
            cell(interval),
        ];
        let counts = once(controller.fell).chain(rare.iter().map(|(_, count)| count(controller)));
        let [low, high] = controller.survived.ci95;
        let survived = format!(
            "{} ({:.1}-{})",
            controller.survived.recovered,
            100.0 * low,
            percent(high)
        );
        let survived = lingers.then(|| cell(survived));
        table.row(
            once(name(i, controller))
                .chain(cells)
                .chain(counts.map(cell))
                .chain(survived),
        );
    }
    match lingers {
        true => table.with_note(
            "Survived: not fallen at the end, whether it stood or not. With `episode.judge.counts=survived` these count as recovered.",
        ),
        false => table,
    }
}

/// The impulses of which 50 % and 90 % are survived.
pub(super) fn limits(summary: &Summary) -> Table {
    let units = [
        number("50 %").in_unit("N s"),
        number("90 %").in_unit("N s"),
        number("50 %").in_unit("m omega d"),
    ];
    let mut table = Table::new(
        "Impulses of which so many recover",
        once(words("controller")).chain(units),
    );
    for (i, controller) in summary.controllers.iter().enumerate() {
        let (curve, normalized) = (&controller.curve, &controller.normalized_curve);
        let levels = [
            impulse_at(curve, true),
            impulse_at(curve, false),
            impulse_at(normalized, true),
        ];
        table.row(once(name(i, controller)).chain(texts(levels)));
    }
    let velocity = velocity_change(&summary.units, 1.0);
    table.with_note(format!(
        "Impulses at which 50 % and 90 % of the pushes are survived, with 95 % intervals, by a logistic curve fitted over \
         all headings. m omega d is mass times omega times the way d from the COM to the edge of the soles in the direction \
         of the push: the most that a pendulum takes without a footstep of a push that has no duration. Of 1 N s, {velocity}.",
    ))
}

/// The impulse (N s, or over m omega d) at which 50 % of the pushes are survived (`half`), or else 90 %, with its
/// interval. If there is none, the reason.
fn impulse_at(curve: &FittedCurve, half: bool) -> String {
    let Some(fit) = &curve.fit else {
        return curve.none_because.map_or("-".into(), |why| why.to_string());
    };
    let (level, why) = if half {
        (fit.impulse50, fit.no_impulse50)
    } else {
        (fit.impulse90, fit.no_impulse90)
    };
    shown_level(level, why)
}

/// An impulse, or a drawback, with its interval. If there is none, the reason.
pub(super) fn shown_level(level: Option<Level>, why: Option<NoCurve>) -> String {
    match (level, why) {
        (Some(level), _) => {
            let [least, most] = level
                .ci95
                .map(|end| end.map_or("?".into(), |x| format!("{x:.2}")));
            format!("{:.2} ({least}-{most})", level.at)
        }
        (None, why) => why.map_or("-".into(), |why| why.to_string()),
    }
}

/// How often each controller recovered, by kind of trial. If controllers have different numbers of trials, these are
/// shown.
pub(super) fn by_kind(summary: &Summary) -> Table {
    let corner = [words("kind of trial"), number("pushes")];
    let columns = corner
        .into_iter()
        .chain(columns(summary.controllers.iter().enumerate()));
    let mut table = Table::new("Recovered, by kind of trial", columns);
    for (i, stratum) in summary
        .controllers
        .iter()
        .take(1)
        .flat_map(|controller| &controller.strata)
        .enumerate()
    {
        let pushes = summary
            .controllers
            .iter()
            .map(|controller| controller.strata[i].count.trials)
            .max()
            .unwrap_or(0);
        let mut row = vec![cell(kind(stratum.by, &stratum.label)), cell(pushes)];
        for (number, controller) in summary.controllers.iter().enumerate() {
            let count = controller.strata[i].count;
            let share = percent(count.success_rate);
            row.push(match (&summary.stopped, count.trials) {
                (None, _) => rate(share, count, number),
                (Some(_), 0) => cell("-"),
                (Some(_), trials) => rate(format!("{share} of {trials}"), count, number),
            });
        }
        table.row(row);
    }
    table.with_note(
        "There are many kinds, and no interval is corrected for that: one that stands out alone may do so by chance.",
    )
}

/// How often each recovered, by the impulse of the first push: the figures behind the points of the curves.
pub(super) fn by_impulse(summary: &Summary) -> Table {
    let corner = once(words("impulse, N s")).chain(columns(summary.controllers.iter().enumerate()));
    let mut table = Table::new("Recovered, by impulse", corner);
    for (i, bin) in summary
        .controllers
        .iter()
        .take(1)
        .flat_map(|controller| &controller.by_impulse)
        .enumerate()
    {
        let range = cell(format!("{:.2} to {:.2}", bin.from_n_s, bin.to_n_s));
        table.row(
            once(range).chain(
                summary
                    .controllers
                    .iter()
                    .map(|controller| rate_of(&controller.by_impulse[i].count)),
            ),
        );
    }
    table
}

/// A kind of trial in words: the quantity, without its unit, and the values in this kind.
pub(super) fn kind(by: &str, label: &str) -> String {
    let name = by
        .strip_suffix("_m")
        .or(by.strip_suffix("_s"))
        .unwrap_or(by);
    format!(
        "{}: {label}",
        name.replace("_scale", " (times nominal)")
            .replace("_com_", "_COM_")
            .replace('_', " ")
    )
}

/// How the trials of each controller were lost.
pub(super) fn losses(summary: &Summary) -> Table {
    type Pick = fn(&Failures) -> u64;
    let kinds: [(&str, Pick); 11] = [
        ("fell without a footstep", |f| f.fell_before_any_footstep),
        ("fell with a foot in the air", |f| f.fell_in_swing),
        ("fell after a landing", |f| f.fell_after_landing),
        ("not standing at the end", |f| f.timed_out),
        ("a sole bore too much", |f| f.broke),
        ("diverged", |f| f.diverged),
        ("the controller failed", |f| f.failed),
        ("  falls: slipped", |f| f.fell_slipped),
        ("  falls: torque at its limit", |f| f.fell_torque_limited),
        ("  falls: legs met", |f| f.fell_legs_met),
        ("  falls: none of these", |f| f.fell_otherwise),
    ];
    counts(
        summary,
        "When robots fell, and what went with it",
        "lost",
        kinds.map(|(label, pick)| {
            (label, move |controller: &ControllerSummary| {
                pick(&controller.failures)
            })
        }),
    )
}

/// The causes of the falls of each controller, the most frequent first.
pub(super) fn causes(summary: &Summary) -> Table {
    let mut causes: BTreeMap<&str, u64> = BTreeMap::new();
    for fall in summary
        .controllers
        .iter()
        .flat_map(|controller| &controller.fall_causes)
    {
        *causes.entry(&fall.cause).or_default() += fall.trials;
    }
    let mut causes: Vec<_> = causes.into_iter().collect();
    causes.sort_by_key(|&(_, trials)| Reverse(trials));
    let rows = causes.into_iter().map(|(cause, _)| {
        let falls = move |controller: &ControllerSummary| {
            let fall = controller
                .fall_causes
                .iter()
                .find(|fall| fall.cause == cause);
            fall.map_or(0, |fall| fall.trials)
        };
        (cause, falls)
    });
    counts(summary, "What ended the falls", "cause of the fall", rows)
}

/// A table of counts with a row for each kind that any controller has. If controllers have different numbers of trials,
/// the first row has these numbers.
fn counts<'a, F: Fn(&ControllerSummary) -> u64>(
    summary: &Summary,
    title: &str,
    corner: &str,
    kinds: impl IntoIterator<Item = (&'a str, F)>,
) -> Table {
    let controllers = &summary.controllers;
    let mut table = Table::new(
        title,
        once(words(corner)).chain(columns(controllers.iter().enumerate())),
    );
    for (label, count) in kinds
        .into_iter()
        .filter(|(_, count)| controllers.iter().any(|controller| count(controller) > 0))
    {
        table.row(
            once(cell(label)).chain(controllers.iter().map(|controller| cell(count(controller)))),
        );
    }
    if summary.stopped.is_some() && !table.rows.is_empty() {
        table.rows.insert(
            0,
            once(cell("trials"))
                .chain(
                    controllers
                        .iter()
                        .map(|controller| cell(controller.count.trials)),
                )
                .collect(),
        );
    }
    table
}

/// How long recoveries took.
pub(super) fn times(summary: &Summary) -> Table {
    let columns = headings("controller", ["to standing", "to home"])
        .chain(once(number("sole force").in_unit("N")));
    let mut table = Table::new(
        "How long recoveries took, and how hard they landed",
        columns,
    );
    for (i, controller) in summary.controllers.iter().enumerate() {
        let times = [controller.median_settling_s, controller.median_homing_s];
        let times = times.map(|time_s| cell(seconds(time_s)));
        let force = controller.median_sole_force_n;
        let force = cell(force.map_or("-".into(), |n| format!("{n:.0}")));
        table.row(once(name(i, controller)).chain(times).chain(once(force)));
    }
    let home = match summary.episode.end_early {
        true => {
            " Times to home were not measured: an episode ends as soon as its outcome is certain, which is before that."
        }
        false => "",
    };
    table.with_note(format!(
        "Median times from the end of the last push until the robot stands, and until its COM is home for good, and of the \
         largest force on a sole, over the controller's own recoveries. A controller that recovers from harder pushes has slower and harder recoveries among its own.{home}"
    ))
}

/// Recovered trials by number of footsteps.
pub(super) fn footsteps(summary: &Summary) -> Table {
    let steppers: Vec<_> = summary
        .controllers
        .iter()
        .enumerate()
        .filter_map(|(i, controller)| Some((i, controller, controller.by_footsteps.as_ref()?)))
        .collect();
    let columns = columns(steppers.iter().map(|(i, controller, _)| (*i, *controller)));
    let mut table = Table::new(
        "Recovered, by footsteps",
        once(words("recovered, by footsteps")).chain(columns),
    );
    for (i, label) in ["none", "one", "two", "three or more"]
        .into_iter()
        .enumerate()
        .filter(|_| !steppers.is_empty())
    {
        let rates = steppers.iter().map(|(.., counts)| rate_of(&counts[i]));
        table.row(once(cell(label)).chain(rates));
    }
    table
}

/// The columns of controllers side by side.
pub(super) fn columns<'a>(
    controllers: impl Iterator<Item = (usize, &'a ControllerSummary)>,
) -> impl Iterator<Item = TableColumn> {
    controllers.map(|(i, controller)| TableColumn {
        controller: Some(i),
        ..number(&controller.name)
    })
}

/// The name of a controller, as a cell.
pub(super) fn name(i: usize, controller: &ControllerSummary) -> Cell {
    Cell {
        controller: Some(i),
        ..cell(&controller.name)
    }
}

/// A rate that can be drawn.
fn rate(text: String, count: SuccessCount, controller: usize) -> Cell {
    Cell {
        mark: Some(CellMark {
            at: count.success_rate,
            ci: Some(count.ci95),
            controller: Some(controller),
        }),
        ..cell(text)
    }
}

/// Number of recovered trials of all, and the rate.
fn rate_of(count: &SuccessCount) -> Cell {
    match count.trials {
        0 => cell("-"),
        trials => cell(format!(
            "{}/{trials} {:>7}",
            count.recovered,
            percent(count.success_rate)
        )),
    }
}
