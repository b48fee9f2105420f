//! Tables of pairs of controllers and of gates.

use crate::table::{Cell, CellMark, Table, TableColumn, cell, headings, number, texts, words};
use crate::tables::controllers::kind;
use crate::text::comparison::{about_gates, about_pairs, in_unit, p_cell, shown, status, unit};
use crate::text::layout::signed;
use standfast_sim::loads::WINDOW_S;
use standfast_stats::mcnemar::PairedCounts;
use standfast_study::Summary;
use standfast_study::ask::entrant::Entrant;
use standfast_study::verdict::pairs::{PairSummary, rounded};

fn columns<const N: usize>(numbers: [&str; N]) -> impl Iterator<Item = TableColumn> {
    [words("a"), words("b")]
        .into_iter()
        .chain(numbers.map(number))
}

fn names(pair: &PairSummary) -> impl Iterator<Item = Cell> {
    [&pair.a, &pair.b].into_iter().map(cell)
}

/// A difference and its interval, as two cells.
fn difference(at: f64, ci: Option<[f64; 2]>, digits: usize) -> [Cell; 2] {
    let interval = ci.map_or("-".into(), |[least, most]| {
        format!("{least:.digits$} to {most:.digits$}")
    });
    [
        Cell {
            mark: Some(CellMark {
                at,
                ci,
                controller: None,
            }),
            ..cell(signed(at, digits))
        },
        cell(interval),
    ]
}

/// The counts behind the verdicts.
pub(super) fn counts(summary: &Summary) -> Table {
    let columns = columns(["both", "only a", "only b", "kappa", "a - b", "95 %", "p"]);
    let mut table = Table {
        about_zero: true,
        ..Table::new("Counts and differences", columns)
    };
    for pair in &summary.pairs {
        let seen = difference(
            100.0 * pair.difference,
            Some(pair.adjusted_ci95.map(|share| 100.0 * share)),
            1,
        );
        let PairedCounts {
            both,
            only_a,
            only_b,
            neither: _,
        } = pair.counts;
        let p = [cell(pair.adjusted_p.map_or("-".into(), p_cell))];
        table.row(
            names(pair)
                .chain([both, only_a, only_b].map(cell))
                .chain([cell(kappa(pair))])
                .chain(seen)
                .chain(p),
        );
    }
    let difference = "a - b is the rate of a less that of b, in points.";
    table.with_note(format!(
        "Trials from which both, or only one, recovered. {KAPPA} {difference} {}",
        about_pairs(summary)
    ))
}

/// How hard the soles land.
pub(super) fn landings(summary: &Summary) -> Table {
    let columns = columns(["pushes", "a [N]", "b [N]", "a / b", "95 %"]);
    let mut table = Table::new("Largest force on a sole, where both recover", columns);
    for pair in &summary.pairs {
        let Some(landing) = &pair.landing else {
            continue;
        };
        let interval = landing.ratio_ci95.map_or("-".into(), |[least, most]| {
            format!("{least:.2} to {most:.2}")
        });
        table.row(names(pair).chain(texts([
            landing.trials.to_string(),
            format!("{:.0}", landing.median_a_n),
            format!("{:.0}", landing.median_b_n),
            format!("{:.2}", landing.ratio),
            interval,
        ])));
    }
    table.with_note(format!(
        "Medians over the pushes from which both recovered, and of the ratio push by push. A force is a mean over {:.0} ms; the \
         robot weighs {:.0} N.",
        1000.0 * WINDOW_S,
        summary.units.weight_n()
    ))
}

/// How far two engines agree: the pairs of one controller in both.
pub(super) fn engines(summary: &Summary) -> Table {
    let columns = columns(["both", "only a", "only b", "neither", "alike", "kappa"]);
    let mut table = Table::new("The same controller in two engines", columns);
    for pair in &summary.pairs {
        let [a, b] = [&pair.a, &pair.b].map(|name| Entrant::split(name));
        if a.engine == b.engine || a.controller != b.controller {
            continue;
        }
        let PairedCounts {
            both,
            only_a,
            only_b,
            neither,
        } = pair.counts;
        let trials = (both + only_a + only_b + neither).max(1);
        let alike = 100.0 * (both + neither) as f64 / trials as f64;
        table.row(
            names(pair)
                .chain([both, only_a, only_b, neither].map(cell))
                .chain([cell(format!("{alike:.1} %")), cell(kappa(pair))]),
        );
    }
    table.with_note(format!(
        "Trials from which both, only one, or neither recovered. Alike is the share of both and neither. {KAPPA}"
    ))
}

const KAPPA: &str = "Kappa (Cohen) is 1 if both always recover from the same trials, 0 if no more often than by chance.";

fn kappa(pair: &PairSummary) -> String {
    pair.kappa.map_or("-".into(), |kappa| format!("{kappa:.2}"))
}

/// In a sweep, the effect of each change: over all trials, and by heading.
pub(super) fn effects(summary: &Summary) -> Table {
    let Some(reference) = &summary.reference else {
        return Table::default();
    };
    let (mut columns, mut variants) = (vec![words("headings")], Vec::new());
    for (i, controller) in summary.controllers.iter().enumerate() {
        let pair = summary.pairs.iter().find(|pair| {
            [&pair.a, &pair.b] == [&controller.name, reference]
                || [&pair.b, &pair.a] == [&controller.name, reference]
        });
        if let Some(pair) = pair {
            columns.push(TableColumn {
                controller: Some(i),
                ..number(&controller.name)
            });
            let sign = if pair.a == controller.name { 1.0 } else { -1.0 };
            variants.push((i, pair, sign));
        }
    }
    let mut table = Table {
        about_zero: true,
        ..Table::new(format!("Against {reference}"), columns)
    };
    let mut headings = vec![(None, "all")];
    for (_, pair, _) in variants.iter().take(1) {
        for (number, stratum) in pair.strata.iter().enumerate() {
            if stratum.by == "heading" {
                headings.push((Some(number), &stratum.label));
            }
        }
    }
    for (stratum, label) in headings {
        let mut row = vec![cell(label)];
        for &(i, pair, sign) in &variants {
            let (seen, ci) = match stratum {
                Some(number) => (pair.strata[number].difference, pair.strata[number].ci95),
                None => (pair.difference, pair.adjusted_ci95),
            };
            let [seen, least, most] = [seen, ci[0], ci[1]].map(|share| 100.0 * sign * share);
            row.push(Cell {
                mark: Some(CellMark {
                    at: seen,
                    ci: Some([least.min(most), least.max(most)]),
                    controller: Some(i),
                }),
                ..cell(signed(seen, 1))
            });
        }
        table.row(row);
    }
    table.with_note(format!(
        "By how many points more of the trials each recovers than {reference}, over all headings and by heading of the push."
    ))
}

/// The differences of two controllers by kind of trial: a table for each pair that is shown.
pub(super) fn by_kind(summary: &Summary) -> Vec<Table> {
    let mut tables = Vec::new();
    for pair in shown(summary) {
        let (title, columns) = (
            format!("{} - {}, by kind of trial", pair.a, pair.b),
            ["trials", "a - b", "95 %"],
        );
        let mut table = Table {
            about_zero: true,
            ..Table::new(title, headings("kind of trial", columns))
        };
        for stratum in &pair.strata {
            let seen = difference(
                100.0 * stratum.difference,
                Some(stratum.ci95.map(|share| 100.0 * share)),
                1,
            );
            table.row(
                [cell(kind(stratum.by, &stratum.label)), cell(stratum.trials)]
                    .into_iter()
                    .chain(seen),
            );
        }
        tables.push(table.with_note(
            "The rate of the first less that of the second, in points, with 95 % intervals.",
        ));
    }
    tables
}

/// The gates.
pub(super) fn gates(summary: &Summary) -> Table {
    let numbers = ["seen", "interval", "trials", "to run"].map(number);
    let mut table = Table::new(
        "Gates",
        [words("gate"), words("status")].into_iter().chain(numbers),
    );
    for gate in &summary.gates {
        let (judged, unit) = (&gate.judged, unit(gate));
        let [least, most] = judged.interval.map(|share| in_unit(gate, share));
        let more = judged
            .more_trials
            .map_or("-".into(), |more| format!("about {}", rounded(more)));
        let seen = format!("{} {unit}", in_unit(gate, judged.observed));
        let (name, interval) = (judged.name.clone(), format!("{least} to {most}"));
        table.row(texts([
            name,
            status(gate).into(),
            seen,
            interval,
            judged.trials.to_string(),
            more,
        ]));
    }
    table.with_note(about_gates(summary))
}
