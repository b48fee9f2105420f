//! `report.html`: the result of a campaign as one page.
//!
//! The page is one file that loads nothing else. Its pictures are SVG, so that they show without JavaScript, which only
//! adds tooltips, commands to copy, and the choice of a pair. The page depends on nothing but the summary, the rows and
//! the replays that exist, so its bytes are the same on every machine.

mod engines;
mod polar;
mod svg;
mod telling;
mod trials;
mod words;

use self::trials::Trials;
use self::words::{interval, number, part};
use crate::campaign::Summary;
use crate::campaign::verdict::digest::Digest;
use crate::campaign::verdict::pairs::Pair;
use crate::campaign::verdict::set_summary::SetSummary;
use crate::error::Result;
use crate::render::figure::{self, axes::Scale, success};
use crate::render::{html_page, replay_parts, text};
use crate::stats::ranks::Shift;
use minijinja::value::Kwargs;
use minijinja::{Environment, UndefinedBehavior, Value as Cell};
use serde_json::{Value, json};
use std::path::Path;

const TEMPLATE: &str = include_str!("report.html.jinja");
const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// Pairs beyond this number appear only in the table of pairs, without a map.
const MOST_PAIRS: usize = 28;
/// If there are more pairs than this, the sentences on them are folded away.
const FEW_ANSWERS: usize = 6;

/// The page of a campaign, from its `summary` and the `rows` of it. It links to the replays that exist, by paths
/// relative to `folder`. Fails only if the template is wrong.
pub fn page(summary: &Summary, rows: &Digest, folder: &Path) -> Result<String> {
    let context = context(summary, rows, folder);
    html_page::render("report.html", TEMPLATE, UndefinedBehavior::Strict, add_to, &context)
}

/// Adds the functions and filters that the template calls.
fn add_to(environment: &mut Environment) {
    words::add_to(environment);
    environment.add_function("whisker", |at: Cell, ci: Cell, options: Kwargs| {
        let part = |name| options.get::<Option<f64>>(name).ok().flatten();
        let scale = Scale { from: part("from").unwrap_or(0.0), to: part("to").unwrap_or(1.0) };
        let class = options.get::<Option<String>>("class").ok().flatten().unwrap_or_default();
        Cell::from_safe_string(svg::whisker(scale, number(&at), interval(&ci), &class))
    });
    environment.add_function("axis", |from: f64, to: f64, unit: String| {
        Cell::from_safe_string(svg::axis(Scale { from, to }, &unit))
    });
    environment.add_function("share_bar", |parts: Vec<Cell>, to: f64| {
        Cell::from_safe_string(svg::share_bar(&parts.iter().filter_map(part).collect::<Vec<_>>(), to))
    });
}

/// The values that the template reads: the summary as `s`, and everything that is computed here.
fn context(summary: &Summary, rows: &Digest, folder: &Path) -> Value {
    let (sets, pairs) = (&summary.sets, &summary.pairs);
    let names: Vec<String> = sets.iter().map(|set| set.name.clone()).collect();
    // Every pair and gate names sets of the summary, so the default is never used.
    let index = |name: &str| names.iter().position(|n| *n == name).unwrap_or_default();
    let trials = Trials(rows);
    let maps = polar::Maps::new(success::impulse_edges_n_s(sets), &trials);
    let view = |(i, pair): (usize, &Pair)| {
        let (a, b) = (index(&pair.a), index(&pair.b));
        // Of two engines, the map of a gain set stands where their agreement is told.
        let has_map = i < MOST_PAIRS && summary.agreement.is_none();
        let map = if has_map { maps.pair((a, b), [a, b]) } else { None };
        json!({ "index": i, "a": a, "b": b, "map": map, "trials": telling::of_pair(sets, pair, (a, b)) })
    };
    let lost = summary.gates.iter().map(|gate| Some(telling::point(sets, gate.lost_trial?, &[index(&gate.set)])));
    let commands: Vec<_> = sets.iter().map(|set| replay_parts(&set.origin, Path::new(""))).collect();
    let shifts = |of: fn(&Pair) -> Option<Shift>| pairs.iter().filter_map(move |pair| of(pair)?.ci95);
    json!({
        "s": summary,
        "gates_seen": summary.gates.iter().map(text::gate_seen).collect::<Vec<_>>(),
        "baseline": text::baseline(summary),
        "about_pairs": text::about_pairs(summary),
        "style": figure::page_style() + STYLE,
        "script": SCRIPT,
        "colors": figure::COLORS,
        "data": trials.as_dots().then(|| trials.as_json(&commands)),
        "telling": telling::table(sets, folder),
        "lost": lost.collect::<Vec<_>>(),
        "maps": (0..names.len()).map(|set| maps.set(set)).collect::<Vec<_>>(),
        "pair_views": pairs.iter().enumerate().map(view).collect::<Vec<_>>(),
        "most_pairs": MOST_PAIRS,
        "few_answers": FEW_ANSWERS,
        "curve": success::chart(sets).svg("role=\"img\" aria-label=\"Success rate over impulse\""),
        "engines": summary.agreement.as_ref().map(|agreement| engines::view(agreement, sets, &maps)),
        "footsteps": trials.footsteps(),
        "scale": {
            "difference": reach(pairs.iter().map(|pair| pair.adjusted_ci95), 0.05),
            "strata": reach(pairs.iter().flat_map(|pair| &pair.strata).map(|stratum| stratum.ci95), 0.05),
            "homing": reach(shifts(|pair| pair.homing_s), 0.05),
            "settling": reach(shifts(|pair| pair.settling_s), 0.05),
            "footsteps": reach(pairs.iter().filter_map(mean_footsteps), 0.1),
            "lost": most_lost(sets),
        },
    })
}

/// The interval of the difference in the mean number of footsteps, or the difference itself if it has no interval.
fn mean_footsteps(pair: &Pair) -> Option<[f64; 2]> {
    let Shift { mean, mean_ci95, .. } = pair.footsteps?;
    Some(mean_ci95.unwrap_or([mean; 2]))
}

/// Half the width of a scale about 0 that contains the intervals, rounded up to a multiple of `step`.
fn reach(intervals: impl Iterator<Item = [f64; 2]>, step: f64) -> f64 {
    let most = intervals.flatten().map(f64::abs).fold(0.0, f64::max);
    ((most / step).ceil() * step).max(step)
}

/// Largest share of lost trials of any set, rounded up to 10 %.
fn most_lost(sets: &[SetSummary]) -> f64 {
    let lost = sets.iter().map(|set| 1.0 - set.count.success_rate);
    ((lost.fold(0.0, f64::max) * 10.0 - 1e-9).ceil() / 10.0).max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::row;
    use crate::campaign::verdict::agreement::tests::compared;
    use crate::campaign::verdict::summary::tests::{digest, ragged, summary};
    use crate::episode::Outcome::{Fell, Recovered};

    /// The page of two sets with five trials each, in one engine.
    fn usual() -> String {
        let outcomes = [[Recovered, Fell]; 5];
        page(&summary(&outcomes, &[], &[]), &digest(&outcomes), Path::new("")).unwrap()
    }

    const HOSTILE: &str = "</script><b onclick='x()'>&";

    #[test]
    fn names_are_escaped_everywhere() {
        let outcomes = [[Recovered, Fell], [Fell, Recovered], [Recovered, Fell]];
        let (mut summary, mut rows) = (summary(&outcomes, &[], &["a >= 0.9"]), digest(&outcomes));
        let of_set = [&mut summary.sets[0].name, &mut summary.pairs[0].a, &mut rows.names[0]];
        for name in [&mut summary.name, &mut summary.robot].into_iter().chain(of_set) {
            *name = HOSTILE.into();
        }
        summary.warnings = vec![HOSTILE.into()];
        summary.sets[0].telling[0].why = HOSTILE.into();
        summary.sets[0].origin.gains = HOSTILE.into();
        summary.pairs[0].words = HOSTILE.into();
        let gate = &mut summary.gates[0];
        (gate.set, gate.judged.name) = (HOSTILE.into(), HOSTILE.into());
        let page = page(&summary, &rows, Path::new("")).unwrap();
        assert!(!page.contains("</script><b") && !page.contains("<b onclick"));
        assert!(page.contains("&lt;b onclick"));
        // The page has two script elements, data and code, each closed once.
        assert_eq!(page.matches("</script>").count(), 2);
    }

    #[test]
    fn a_summary_without_pairs_makes_a_page_without_them() {
        let mut summary = summary(&[[Recovered, Fell]], &[], &[]);
        summary.sets.truncate(1);
        summary.pairs.clear();
        let page = page(&summary, &Digest::of_rows(&[row(0, "a", 1.0, Recovered)], &["a".to_string()]), Path::new(""))
            .unwrap();
        assert!(page.contains("<h1") && !page.contains("NaN") && !page.contains("id=\"pairs\""), "{page}");
    }

    #[test]
    fn a_set_that_was_stopped_has_its_own_trials() {
        let (summary, rows) = ragged(&[]);
        let page = page(&summary, &rows, Path::new("")).unwrap();
        for told in [
            "up to 100 trials of 3 gain sets",
            ">5/25<",
            "b after 25 trials. Each rate",
            "<span class=\"fine\">of 25</span>",
        ] {
            let told = html_page::together(told);
            assert!(page.replace('\u{a0}', " ").contains(&told.replace('\u{a0}', " ")), "{told}");
        }
        // The outcome of a trial that a set has not met.
        assert!(page.contains("\"R-R\"") && !page.contains("NaN"));
        assert!(!usual().contains("up to 5 trials"));
    }

    #[test]
    fn two_engines_have_a_map_for_each_set_and_a_row_for_each_trial_on_which_they_disagree() {
        let recovered: Vec<[bool; 4]> = (0..40).map(|i| [i < 10, true, i < 30, i != 7]).collect();
        let (mut summary, rows) = compared(&recovered);
        summary.agreement.as_mut().unwrap().sets[0].set = HOSTILE.into();
        let page = page(&summary, &rows, Path::new("")).unwrap();
        assert!(page.contains("id=\"engines\"") && page.contains("How far the two engines agree"));
        let (from, to) = (page.find("id=\"engines\"").unwrap(), page.find("id=\"rates\"").unwrap());
        let section = &page[from..to];
        assert_eq!(section.matches("data-sets=").count(), 2, "{section}");
        assert!(section.contains("data-sets=\"0 2\"") && section.contains("data-sets=\"1 3\""), "{section}");
        assert_eq!(section.matches("<td>recovered</td>").count(), 21, "{section}");
        assert!(section.contains(">only MuJoCo<") && !section.contains("<b onclick"), "{section}");
        // No other map has the same pair, and a page of one engine has no such section.
        assert!(["0 2", "2 0"].iter().all(|pair| !page[to..].contains(&format!("data-sets=\"{pair}\""))));
        assert!(!usual().contains("id=\"engines\""));
    }

    #[test]
    fn with_many_trials_the_maps_have_cells_but_no_dots() {
        let page = |trials: usize| {
            let one_in_three = |k: usize| if k.is_multiple_of(3) { Fell } else { Recovered };
            let outcomes: Vec<_> = (0..trials).map(|k| [one_in_three(k), one_in_three(k + 1)]).collect();
            page(&summary(&outcomes, &[], &[]), &digest(&outcomes), Path::new("")).unwrap()
        };
        let (few, many) = (page(1000), page(20_000));
        assert!(few.contains("class=\"won\"") && !many.contains("class=\"won\""));
        assert!(few.len() < 200_000 && many.len() < 100_000, "{} and {} bytes", few.len(), many.len());
    }
}
