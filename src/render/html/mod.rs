//! `report.html`: a campaign as one page that people look at.
//!
//! One file that asks for nothing else: pictures are SVG and drawn here, so that they show without JavaScript; a little
//! of it adds tooltips, replay commands to copy, and the choice of a pair. What it shows is `summary.json` and the
//! rows, nothing of machine, path or clock: the same bytes everywhere. What the summary lacks, the page leaves out.

mod curve;
mod polar;
pub(super) mod svg;
mod telling;
mod trials;
mod words;

use crate::campaign::{Summary, TrialRow};
use crate::error::{Error, Result};
use crate::render::{html_page, replay_parts, result, text};
use minijinja::value::Kwargs;
use minijinja::{Environment, UndefinedBehavior, Value as Cell};
use serde_json::{Value, json};
use std::path::Path;

const TEMPLATE: &str = include_str!("report.html.jinja");
const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// More pairs than this are told in the table of pairs alone.
const MOST_PAIRS: usize = 28;

/// The page of a campaign: its `summary` and all `rows`, sorted by trial, then by set in the order of the summary. It links
/// to the replays that are there, as seen from `folder`.
///
/// Errors: none but a template that is wrong.
pub fn page(summary: &Summary, rows: &[TrialRow], folder: &Path) -> Result<String> {
    let fail = |e: serde_json::Error| Error::Numeric { what: "report.html".into(), problem: e.to_string() };
    let gates: Vec<String> = summary.gates.iter().map(text::gate_seen).collect();
    let words = json!({ "gates": gates, "baseline": text::baseline(summary) });
    page_of(&serde_json::to_value(summary).map_err(fail)?, words, rows, folder)
}

/// The same of what becomes `summary.json`, and of sentences that other reports have, too.
fn page_of(summary: &Value, words: Value, rows: &[TrialRow], folder: &Path) -> Result<String> {
    let mut context = context(summary, rows, folder);
    context["words"] = words;
    html_page::render("report.html", TEMPLATE, UndefinedBehavior::Chainable, add_to, &context)
}

/// What the template calls.
fn add_to(environment: &mut Environment) {
    words::add_to(environment);
    environment.add_function("whisker", |at: Cell, ci: Cell, options: Kwargs| {
        let part = |name| options.get::<Option<f64>>(name).ok().flatten();
        let scale = svg::Scale { from: part("from").unwrap_or(0.0), to: part("to").unwrap_or(1.0) };
        let class = options.get::<Option<String>>("class").ok().flatten().unwrap_or_default();
        Cell::from_safe_string(svg::whisker(scale, number(&at), interval(&ci), part("mark"), &class))
    });
    environment.add_function("axis", |from: f64, to: f64, unit: String| {
        Cell::from_safe_string(svg::axis(svg::Scale { from, to }, &unit))
    });
    environment.add_function("share_bar", |parts: Vec<Cell>, to: f64| {
        Cell::from_safe_string(svg::share_bar(&parts.iter().filter_map(part).collect::<Vec<_>>(), to))
    });
}

/// What the template reads: the summary as `s`, and what it cannot make itself.
fn context(summary: &Value, rows: &[TrialRow], folder: &Path) -> Value {
    let names: Vec<&str> = list(&summary["sets"]).iter().map(|set| set["name"].as_str().unwrap_or("?")).collect();
    let pairs = list(&summary["pairs"]);
    let index = |name: &Value| names.iter().position(|n| Some(*n) == name.as_str());
    let sets = list(&summary["sets"]);
    let named = telling::Named::new(sets, sets.iter().map(replay_command).collect());
    let telling_ids = sets.iter().enumerate().map(|(i, set)| named.row_ids(i, list(&set["telling"])));
    let lost = |gate: &Value| named.point(&gate["lost_trial"], &[index(&gate["set"])?]);
    let trials = trials::Trials::new(&names, rows);
    let maps = trials.as_ref().map(|trials| polar::Maps::new(summary, trials));
    let pair_views: Vec<Value> = pairs
        .iter()
        .enumerate()
        .map(|(i, pair)| {
            let (a, b) = (index(&pair["a"]), index(&pair["b"]));
            let map = maps.as_ref().filter(|_| i < MOST_PAIRS).zip(a.zip(b)).and_then(|(m, (a, b))| m.pair(a, b));
            let trials = a.zip(b).map(|sets| named.of_pair(pair, sets));
            json!({ "index": i, "a": a.unwrap_or(0), "b": b.unwrap_or(0), "map": map, "trials": trials })
        })
        .collect();
    let shown = |pair: &&Value| pair["a"].is_string() && pair["b"].is_string();
    json!({
        "s": summary,
        "style": STYLE,
        "script": SCRIPT,
        "palette": svg::palette(),
        "colors": svg::colors(),
        "data": trials.as_ref().filter(|t| t.as_dots()).map(|t| t.as_json(named.commands())),
        "commands": named.commands(),
        "replays": sets.iter().map(|set| replays_of(set, folder)).collect::<Vec<_>>(),
        "telling_ids": telling_ids.collect::<Vec<_>>(),
        "lost": list(&summary["gates"]).iter().map(lost).collect::<Vec<_>>(),
        "maps": maps.as_ref().map(|maps| (0..names.len()).map(|set| maps.set(set)).collect::<Vec<_>>()),
        "rings": maps.as_ref().map_or(0, polar::Maps::rings),
        "pair_views": pair_views,
        "most_pairs": MOST_PAIRS,
        "has_pairs": pairs.iter().any(|pair| shown(&pair)),
        "curve": curve::draw(summary),
        "footsteps": trials.as_ref().map(trials::Trials::footsteps),
        "scale": {
            "difference": reach(pairs.iter(), "/ci95", 0.05),
            "strata": reach(pairs.iter().flat_map(|pair| list(&pair["strata"])), "/ci95", 0.05),
            "homing": reach(pairs.iter(), "/homing_s/ci95", 0.05),
            "settling": reach(pairs.iter(), "/settling_s/ci95", 0.05),
            "footsteps": reach(pairs.iter(), "/footsteps/ci95", 0.5),
            "lost": most_lost(summary),
        },
    })
}

/// What stands before and after a trial's number in the command that replays it with a set, in the folder of the page.
fn replay_command(set: &Value) -> [String; 2] {
    let origin = |key: &str| set["origin"][key].as_str();
    let gains = origin("gains").or(set["name"].as_str()).unwrap_or_default();
    replay_parts(origin("campaign").unwrap_or("campaign.toml"), gains)
}

/// For each telling trial of a set its replay, if there is one: a path as seen from the folder of the page.
fn replays_of(set: &Value, folder: &Path) -> Vec<Option<String>> {
    let text = |value: &Value| value.as_str().map(String::from);
    let campaign = text(&set["origin"]["campaign"]).unwrap_or("campaign.toml".into());
    let name = text(&set["origin"]["gains"]).or(text(&set["name"])).unwrap_or_default();
    let replay = |telling: &Value| result::replay_found(folder, &campaign, telling["trial"].as_u64()?, &name);
    list(&set["telling"]).iter().map(replay).collect()
}

/// Half the width of a scale about 0 that holds the intervals at `pointer`, rounded up to a multiple of `step`.
fn reach<'a>(values: impl Iterator<Item = &'a Value>, pointer: &str, step: f64) -> f64 {
    let ends = values.filter_map(|value| value.pointer(pointer)).flat_map(list).filter_map(Value::as_f64);
    let most = ends.map(f64::abs).fold(0.0, f64::max);
    ((most / step).ceil() * step).max(step)
}

/// Largest share of lost trials of any set, rounded up to 10 %.
fn most_lost(summary: &Value) -> f64 {
    let lost = list(&summary["sets"]).iter().filter_map(|set| set["success_rate"].as_f64()).map(|rate| 1.0 - rate);
    ((lost.fold(0.0, f64::max) * 10.0 - 1e-9).ceil() / 10.0).max(0.1)
}

/// Elements of an array; of anything else, none.
fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(cell: &Cell) -> Option<f64> {
    f64::try_from(cell.clone()).ok().filter(|x| x.is_finite())
}

fn interval(cell: &Cell) -> Option<[f64; 2]> {
    let end = |i| number(&cell.get_item_by_index(i).ok()?);
    Some([end(0)?, end(1)?])
}

/// Of a bar: `[class, share, words]`.
fn part(cell: &Cell) -> Option<(String, f64, String)> {
    let item = |i| cell.get_item_by_index(i).ok();
    Some((item(0)?.to_string(), number(&item(1)?)?, item(2)?.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::row::tests::row;
    use crate::episode::Outcome;

    const HOSTILE: &str = "</script><b onclick='x()'>&";

    fn rows(sets: [&str; 2], trials: u64) -> Vec<TrialRow> {
        let outcome = |k: u64| if k.is_multiple_of(3) { Outcome::Fell } else { Outcome::Recovered };
        (0..trials)
            .flat_map(|k| {
                [row(k, sets[0], k as f64 / 9.0, outcome(k)), row(k, sets[1], k as f64 / 9.0, outcome(k + 1))]
            })
            .collect()
    }

    #[test]
    fn names_are_text_wherever_they_stand() {
        let telling = json!([{ "trial": 7, "impulse_n_s": 2.0, "heading_deg": 10.0, "why": HOSTILE }]);
        let gate = json!({ "name": HOSTILE, "status": "failed", "set": HOSTILE, "lost_trial": 3 });
        let pair = json!({ "a": HOSTILE, "b": "hold", "both": 1, "ci95": [-0.1, 0.2], "difference": 0.1 });
        let by_impulse = json!([{ "from_n_s": 0.0, "to_n_s": 2.0, "success_rate": 0.5, "ci95": [0.2, 0.8] }]);
        let set = json!({ "name": HOSTILE, "telling": telling, "by_impulse": by_impulse, "success_rate": 0.5 });
        let summary = json!({ "name": HOSTILE, "sets": [set, { "name": "hold" }], "pairs": [pair], "gates": [gate],
            "warnings": [HOSTILE], "robot": HOSTILE });
        let page = page_of(&summary, Value::Null, &rows([HOSTILE, "hold"], 30), Path::new("")).unwrap();
        assert!(!page.contains("</script><b") && !page.contains("<b onclick"));
        assert!(page.contains("&lt;b onclick"));
        // Two elements of data and code, each closed once.
        assert_eq!(page.matches("</script>").count(), 2);
    }

    #[test]
    fn what_a_summary_lacks_is_left_out() {
        for summary in
            [json!({}), json!({ "name": "x", "sets": [{ "name": "hold" }, { "name": null }], "pairs": [{}] })]
        {
            let page = page_of(&summary, Value::Null, &[], Path::new("")).unwrap();
            assert!(page.contains("<h1") && !page.contains("NaN"), "{page}");
        }
    }

    #[test]
    fn many_trials_are_cells_without_dots() {
        let sets = ["hold", "catch"];
        let summary = json!({ "name": "x", "sets": [{ "name": "hold" }, { "name": "catch" }] });
        let page = |trials| page_of(&summary, Value::Null, &rows(sets, trials), Path::new("")).unwrap();
        let (few, many) = (page(1000), page(20_000));
        assert!(few.contains("class=\"won\"") && !many.contains("class=\"won\""));
        assert!(few.len() < 200_000 && many.len() < 100_000, "{} and {} bytes", few.len(), many.len());
    }
}
