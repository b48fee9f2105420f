//! The tables of a result, each made once for the terminal, `summary.md` and `report.html`. A further table is a
//! function in one of these files, and a line in the list of [`of`].

mod controllers;
mod pairs;
mod strikes;

use super::table::Table;
use standfast_study::Summary;

/// The places where a table is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// Everywhere.
    Short,
    /// With `--full`, in `summary.md` and on the page.
    Full,
    /// On the page alone, folded.
    Page,
}

/// A table of a result, and its section of the page. If the section is empty, the page shows the content in another
/// way.
pub struct ReportTable {
    pub section: &'static str,
    pub detail: Detail,
    pub table: Table,
}

/// All tables of a result that have rows, in their order.
pub fn of(summary: &Summary) -> Vec<ReportTable> {
    use Detail::{Full, Page, Short};
    let each = [
        ("rates", Short, controllers::rates(summary)),
        ("strikes", Short, strikes::declared(summary)),
        ("strikes", Short, strikes::by_heading(summary)),
        ("strikes", Short, strikes::conditions(summary)),
        ("pairs", Short, pairs::engines(summary)),
        ("pairs", Full, pairs::effects(summary)),
        ("pairs", Full, pairs::counts(summary)),
        ("pairs", Full, pairs::landings(summary)),
        ("", Short, pairs::gates(summary)),
        ("curves", Full, controllers::limits(summary)),
        ("curves", Page, controllers::by_impulse(summary)),
        ("strata", Full, controllers::by_kind(summary)),
        ("failures", Full, controllers::losses(summary)),
        ("failures", Full, controllers::causes(summary)),
        ("times", Full, controllers::times(summary)),
        ("times", Full, controllers::footsteps(summary)),
    ];
    let pair_kinds = pairs::by_kind(summary).into_iter();
    let all = each
        .into_iter()
        .chain(pair_kinds.map(|table| ("strata", Page, table)));
    all.filter(|(.., table)| !table.rows.is_empty())
        .map(|(section, detail, table)| ReportTable {
            section,
            detail,
            table,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{ragged, summary};
    use standfast_sim::episode::Outcome::{Diverged, Fell, Recovered, TimedOut};

    /// The texts of the rows of the table in `section` whose first heading is `heading`.
    fn rows(summary: &Summary, section: &str, heading: &str) -> Vec<String> {
        let table = of(summary)
            .into_iter()
            .find(|table| table.section == section && table.table.columns[0].heading == heading)
            .unwrap_or_else(|| panic!("no {heading}"))
            .table;
        let heads = table
            .columns
            .iter()
            .map(|column| column.heading.clone())
            .collect::<Vec<_>>();
        let row = |row: &Vec<super::super::table::Cell>| {
            assert_eq!(row.len(), heads.len(), "{heads:?}");
            row.iter()
                .map(|cell| cell.text.clone())
                .collect::<Vec<_>>()
                .join(" | ")
        };
        std::iter::once(heads.join(" | "))
            .chain(table.rows.iter().map(row))
            .collect()
    }

    #[test]
    fn rates_are_those_of_each_controller_and_an_outcome_of_no_controller_has_no_column() {
        let of = |outcomes: &[_]| rows(&summary(outcomes, &[], &[]), "rates", "controller");
        let lines = of(&[[Recovered, Fell], [Recovered, Recovered]]);
        assert_eq!(lines[0], "controller | recovered | rate | 95 % | fell");
        assert_eq!(
            lines[1..],
            [
                "a | 2/2 | 100.0 % | 15.8-100.0 % | 0",
                "b | 1/2 | 50.0 % | 1.3-98.7 % | 1"
            ]
        );
        let lasts = of(&[[TimedOut, Fell]]);
        assert!(
            lasts[0].ends_with("| fell | timed out | survived, 95 %"),
            "{lasts:?}"
        );
        assert!(
            lasts[1].ends_with("| 0 | 1 | 1 (2.5-100.0 %)")
                && lasts[2].ends_with("| 1 | 0 | 0 (0.0-97.5 %)"),
            "{lasts:?}"
        );
        assert!(of(&[[Recovered, Diverged]])[0].ends_with("| fell | diverged"));
    }

    #[test]
    fn rates_over_different_trials_are_told_with_their_number() {
        let summary = ragged(&[]).0;
        let kinds = rows(&summary, "strata", "kind of trial");
        let bins = rows(&summary, "curves", "impulse, N s");
        let of_b = bins[1..].iter().map(|bin| bin.split(" | ").nth(2).unwrap());
        let trials = of_b
            .filter_map(|told| told.split(['/', ' ']).nth(1)?.parse::<u32>().ok())
            .sum::<u32>();
        assert_eq!(trials, 25, "{bins:?}");
        assert_eq!(
            kinds[3],
            "impulse: from 2.32 N s | 34 | 91.2 % of 34 | - | 88.2 % of 34"
        );
    }

    #[test]
    fn pairs_have_counts_points_and_p() {
        let outcomes: Vec<_> = (0..100)
            .map(|i| [Recovered, if i < 50 { Recovered } else { Fell }])
            .collect();
        let of = |set: &[&str]| rows(&summary(&outcomes, set, &[]), "pairs", "a");
        assert_eq!(
            of(&[])[1],
            "a | b | 50 | 50 | 0 | 0.00 | +50.0 | 40.4 to 59.6 | < 0.0001"
        );
        let sequential = of(&["stopping.until_resolved=true"]);
        assert!(sequential[1].ends_with(" | -"), "no p: {sequential:?}");
    }

    /// Two controllers are no such pair, whatever their engines.
    #[test]
    fn one_controller_in_two_engines_has_a_row() {
        let outcomes: Vec<_> = (0..100)
            .map(|i| [Recovered, if i < 50 { Recovered } else { Fell }])
            .collect();
        let mut summary = summary(&outcomes, &[], &[]);
        let titles = |summary: &_| {
            let tables = of(summary).into_iter().map(|table| table.table.title);
            tables.collect::<Vec<_>>()
        };
        for [a, b] in [["a@rapier", "b@mujoco"], ["a", "b"]] {
            [summary.pairs[0].a, summary.pairs[0].b] = [a, b].map(String::from);
            assert!(!titles(&summary).contains(&"The same controller in two engines".into()));
        }
        [summary.pairs[0].a, summary.pairs[0].b] = ["a@rapier", "a@mujoco"].map(String::from);
        assert_eq!(
            rows(&summary, "pairs", "a")[1],
            "a@rapier | a@mujoco | 50 | 50 | 0 | 0 | 50.0 % | 0.00"
        );
    }

    #[test]
    fn gates_are_told_in_their_unit_and_guesses_have_two_digits() {
        let outcomes: Vec<_> = (0..100)
            .map(|i| [Recovered, if i < 50 { Recovered } else { Fell }])
            .collect();
        let mut summary = summary(
            &outcomes,
            &["gates.unresolved=fail"],
            &["b >= 0.45", "a >= b + 0.1", "b >= 0.9"],
        );
        summary.gates[0].judged.more_trials = Some(1234);
        let rows = rows(&summary, "", "gate");
        assert_eq!(
            rows[1],
            "b >= 0.45 | unresolved, counts as FAILED | 50.0 % | 39.8 to 60.2 | 100 | about 1300"
        );
        assert!(
            rows[2].starts_with("a >= b + 0.1 | passed | +50.0 points | +40.")
                && rows[2].ends_with(" | -")
        );
        assert!(rows[3].starts_with("b >= 0.9 | FAILED |"));
    }

    /// A quantity that did not occur has no table. All rows of a table have the same number of cells.
    #[test]
    fn every_table_is_whole() {
        let mut all = of(&ragged(&["a >= b"]).0);
        let mut none = summary(&[[Recovered; 2]; 3], &[], &[]);
        none.pairs.clear();
        none.controllers.truncate(1);
        assert_eq!(
            of(&none)
                .iter()
                .map(|told| told.section)
                .collect::<Vec<_>>(),
            ["rates", "curves", "curves", "strata", "times"]
        );
        all.extend(of(&none));
        for ReportTable { table, .. } in all {
            assert!(
                !table.title.is_empty() && table.columns[0].is_words,
                "{table:?}"
            );
            assert!(
                table
                    .rows
                    .iter()
                    .all(|row| row.len() == table.columns.len()),
                "{table:?}"
            );
        }
    }
}
