//! `report.html`: the result of a campaign as one page.
//!
//! The page is one file that loads nothing else. Its pictures are SVG, so that they show without JavaScript, which only
//! adds tooltips, commands to copy, and the choice of a pair. The page depends on nothing but the summary, the rows and
//! the replays that exist, so its bytes are the same on every machine.

mod polar;
mod telling;
mod trials;

use self::trials::Trials;
use crate::figure::{self, success};
use crate::table::signs;
use crate::tables::{self, Detail, ReportTable};
use crate::text::layout::percent;
use crate::{html_page, replay_parts, text};
use minijinja::{Environment, UndefinedBehavior, Value as Cell};
use serde_json::{Value, json};
use standfast_core::error::Result;
use standfast_stats::decision::PairVerdict;
use standfast_study::Summary;
use standfast_study::verdict::trial_columns::TrialColumns;
use std::collections::BTreeMap;
use std::path::Path;

const TEMPLATE: &str = include_str!("report.html.jinja");
const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// Largest number of pairs with a map. Further pairs appear only in the table of pairs.
const MOST_PAIRS: usize = 28;
/// Largest number of pairs whose sentences are shown. With more pairs, the sentences are folded away.
const FEW_ANSWERS: usize = 6;

/// The page of a campaign, from its `summary` and its `rows`. It links to the replays that exist, by paths relative to
/// `folder`. Fails only if the template is wrong.
pub fn page(summary: &Summary, rows: &TrialColumns, folder: &Path) -> Result<String> {
    let context = context(summary, rows, folder);
    html_page::render(
        "report.html",
        TEMPLATE,
        UndefinedBehavior::SemiStrict,
        add_to,
        &context,
    )
}

/// Adds the filters that the template calls.
fn add_to(environment: &mut Environment) {
    environment.add_filter("signs", |text: String| Cell::from_safe_string(signs(&text)));
    environment.add_filter("fixed", |x: f64, digits: usize| {
        format!("{x:.digits$}").replace('-', "\u{2212}")
    });
    environment.add_filter("pct", percent);
}

/// The values that the template reads: the summary as `s`, and everything that is computed here.
fn context(summary: &Summary, rows: &TrialColumns, folder: &Path) -> Value {
    let (controllers, pairs) = (&summary.controllers, &summary.pairs);
    let names: Vec<String> = controllers
        .iter()
        .map(|controller| controller.name.clone())
        .collect();
    // Every pair and gate names controllers of the summary, so the default is never used.
    let index = |name: &str| names.iter().position(|n| *n == name).unwrap_or_default();
    let trials = Trials(rows);
    let maps = polar::Maps::new(success::impulse_edges_n_s(controllers), &trials);
    let mut pair_views = Vec::new();
    for (i, pair) in pairs.iter().enumerate() {
        let (a, b) = (index(&pair.a), index(&pair.b));
        let map = if i < MOST_PAIRS {
            maps.pair((a, b))
        } else {
            None
        };
        let open = pair.verdict == PairVerdict::Open;
        let trials = telling::of_pair(controllers, pair, (a, b));
        pair_views.push(
            json!({ "index": i, "a": a, "b": b, "open": open, "map": map, "trials": trials }),
        );
    }
    let lost = summary.gates.iter().map(|gate| {
        Some(telling::point(
            controllers,
            gate.lost_trial?,
            &[index(&gate.controller)],
        ))
    });
    let commands: Vec<_> = controllers
        .iter()
        .map(|controller| replay_parts(&controller.origin, Path::new("")))
        .collect();
    let mut sections: BTreeMap<&str, String> = BTreeMap::new();
    for ReportTable {
        section,
        detail,
        table,
    } in tables::of(summary)
    {
        *sections.entry(section).or_default() += &match detail {
            Detail::Page => {
                format!(
                    "<details><summary>{}</summary>\n{}</details>\n",
                    signs(&table.title),
                    table.html()
                )
            }
            _ => table.html(),
        };
    }
    json!({
        "s": summary,
        "gates_seen": summary.gates.iter().map(text::gate_seen).collect::<Vec<_>>(),
        "baseline": text::baseline(summary),
        "style": figure::page_style() + STYLE,
        "script": SCRIPT,
        "colors": figure::COLORS,
        "data": trials.as_dots().then(|| trials.as_json(&commands)),
        "telling": telling::table(controllers, folder),
        "lost": lost.collect::<Vec<_>>(),
        "maps": (0..names.len()).map(|controller| maps.set(controller)).collect::<Vec<_>>(),
        "pair_views": pair_views,
        "most_pairs": MOST_PAIRS,
        "few_answers": FEW_ANSWERS,
        "curve": success::chart(controllers).svg("role=\"img\" aria-label=\"Success rate over impulse\""),
        "tables": sections,
        "endings": text::endings(&summary.episode.judge),
        "settings": text::settings(summary, true),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{ragged, summary, summary_columns};
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    /// The page of two controllers with five trials each, in one engine.
    fn usual() -> String {
        let outcomes = [[Recovered, Fell]; 5];
        page(
            &summary(&outcomes, &[], &[]),
            &summary_columns(&outcomes),
            Path::new(""),
        )
        .unwrap()
    }

    const HOSTILE: &str = "</script><b onclick='x()'>&";

    #[test]
    fn names_are_escaped_everywhere() {
        let outcomes = [[Recovered, Fell], [Fell, Recovered], [Recovered, Fell]];
        let (mut summary, mut rows) = (
            summary(&outcomes, &[], &["a >= 0.9"]),
            summary_columns(&outcomes),
        );
        let of_controller = [
            &mut summary.controllers[0].name,
            &mut summary.pairs[0].a,
            &mut rows.names[0],
        ];
        for name in [&mut summary.name, &mut summary.robot]
            .into_iter()
            .chain(of_controller)
        {
            *name = HOSTILE.into();
        }
        summary.warnings = vec![HOSTILE.into()];
        summary.controllers[0].telling[0].why = HOSTILE.into();
        summary.controllers[0].origin.controller = HOSTILE.into();
        summary.pairs[0].words = HOSTILE.into();
        let gate = &mut summary.gates[0];
        (gate.controller, gate.judged.name) = (HOSTILE.into(), HOSTILE.into());
        let page = page(&summary, &rows, Path::new("")).unwrap();
        assert!(!page.contains("</script><b") && !page.contains("<b onclick"));
        assert!(page.contains("&lt;b onclick"));
        // The page has two script elements, data and code, each closed once.
        assert_eq!(page.matches("</script>").count(), 2);
    }

    #[test]
    fn the_two_measures_of_impulses_are_told_apart() {
        let page = usual();
        for told in [
            "<dt>m omega d</dt>",
            "<dt>sole impulse</dt>",
            "(1 sole impulse\u{a0}=",
            "impulse / m omega d</th>",
        ] {
            assert!(page.contains(told), "{told} is not in {page}");
        }
    }

    /// The page, the summary for a pull request, and the terminal are tested.
    #[test]
    fn a_controller_that_was_stopped_has_its_own_trials() {
        let (summary, rows) = ragged(&[]);
        let page = page(&summary, &rows, Path::new("")).unwrap();
        let terminal = text::campaign(&summary, Path::new("out"), true);
        let up_to = "up to 100 trials (of 200 at most) for each controller";
        for (text, told) in [
            // The last text has the outcome of a trial that a controller has not run.
            (
                &page,
                [
                    "up to 100 trials of 3 controllers",
                    "20.0 % of 25</td>",
                    "\"R-R\"",
                ],
            ),
            (
                &crate::markdown::text(&summary),
                [up_to, "| b | 5/25 |", ""],
            ),
            (&terminal, [up_to, " 5/25 ", " trials 100 25 100 "]),
        ] {
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            let of_all = ["b after 25 trials. Each rate "];
            for told in told.iter().chain(&of_all) {
                assert!(words.contains(told), "{told} in {words}");
            }
        }
        assert!(!page.contains("NaN") && !usual().contains("up to 5 trials"));
    }

    #[test]
    fn with_many_trials_the_maps_have_cells_but_no_dots() {
        let page = |trials: usize| {
            let one_in_three = |k: usize| if k.is_multiple_of(3) { Fell } else { Recovered };
            let outcomes: Vec<_> = (0..trials)
                .map(|k| [one_in_three(k), one_in_three(k + 1)])
                .collect();
            page(
                &summary(&outcomes, &[], &[]),
                &summary_columns(&outcomes),
                Path::new(""),
            )
            .unwrap()
        };
        let (few, many) = (page(1000), page(20_000));
        assert!(few.contains("class=\"won\"") && !many.contains("class=\"won\""));
        assert!(
            few.len() < 200_000 && many.len() < 100_000,
            "{} and {} bytes",
            few.len(),
            many.len()
        );
    }
}
