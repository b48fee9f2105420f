//! `card.html`: what a robot with a controller takes, as one page to hang up in a lab, with a sheet of pushes to try.

use super::figure::{limit, page_style};
use super::html_page;
use super::text::card as text;
use super::text::layout::signed;
use minijinja::UndefinedBehavior;
use serde_json::{Value, json};
use standfast_core::error::Result;
use standfast_study::card::{Card, Cost};
use std::path::Path;

const TEMPLATE: &str = include_str!("card_page.html.jinja");
/// Words for headings that are multiples of 45 degrees.
const DIRECTIONS: [&str; 8] = [
    "forward",
    "forward left",
    "left",
    "backward left",
    "backward",
    "backward right",
    "right",
    "forward right",
];

/// The page. `folder` is where the card is written. Fails only if the template is wrong.
pub fn page(card: &Card, folder: &Path) -> Result<String> {
    let limits = &card.limits;
    let mut headings = Vec::new();
    for heading in &limits.headings {
        let limit = &heading.controllers[0];
        let n_s = |x: Option<f64>| x.map_or("\u{2013}".into(), |x| format!("{x:.2}"));
        headings.push(json!({
            "heading": heading_words(heading.heading_deg),
            "fifty": format!("{:.2}", limit.impulse50_n_s),
            "interval": limit.ci95.map(|end| format!("{end:.2}")).join("\u{2013}"),
            "dv": format!("{:.2}", limit.dv_m_s),
            "draw": limit.pendulum.map(|of| format!("{:.2}", of.draw50_m)),
            "ninety": n_s(limit.impulse90_n_s),
            "safe": n_s(limit.safe_n_s),
            "resolved": limit.resolved,
        }));
    }
    let costs = card.factors.iter().chain([&card.together]);
    let ends = costs.clone().flat_map(|cost| cost.difference_ci);
    let (least, most) = ends.fold((0.0_f64, 0.0_f64), |(a, b), end| (a.min(end), b.max(end)));
    let costs: Vec<Value> = costs.map(|cost| bar(cost, least, most)).collect();
    let of_way = |way: &str| card.losses.iter().find(|loss| loss.way == way);
    let losses: Vec<Value> = text::WAYS
        .into_iter()
        .filter_map(|(way, words)| {
            let loss = of_way(way)?;
            Some(
                json!({ "way": words, "as_designed": loss.as_designed, "together": loss.together }),
            )
        })
        .collect();
    let mut pushes = Vec::new();
    for push in &card.pushes {
        let [low, high] = push.predicted_ci95.map(|end| format!("{:.0}", 100.0 * end));
        pushes.push(json!({
            "push": push.push,
            "impulse": match push.draw_m {
                Some(draw_m) => format!("{draw_m:.2}"),
                None => push.impulse_n_s.to_string(),
            },
            "heading": heading_words(push.heading_deg),
            "predicted": text::share(push.predicted),
            "interval": format!("{low}\u{2013}{high} %"),
        }));
    }
    let first = &card.pushes[0];
    let bob = limits
        .pendulum
        .map(|of| format!("{} kg on a rope of {} m", of.mass_kg, of.rope_m));
    let height_m = first.height_m;
    let at = match height_m == 0.0 {
        true => format!("level with {}", card.height_from),
        false => format!("{} m above {}", signed(height_m, 3), card.height_from),
    };
    let lost = card.designed.trials - card.designed.recovered;
    let context = json!({
        "robot": limits.robot,
        "controller": card.controller,
        "engines": limits.engines.iter().map(|of| &of.engine).collect::<Vec<_>>(),
        "seed": limits.seed,
        "conclusion": text::conclusion(card),
        "most_expensive": text::most_expensive(card).replace('-', "\u{2212}"),
        "power": text::power(card),
        "safe": format!("{:.2}", card.safe_n_s),
        "weakest": format!("{:.2}", text::weakest(card).controllers[0].impulse50_n_s),
        "weakest_heading": heading_words(text::weakest(card).heading_deg),
        "figure_style": page_style(),
        "picture": limit::panel(limits).svg("role=\"img\""),
        "headings": headings,
        "unresolved": limits.headings.iter().any(|heading| !heading.controllers[0].resolved),
        "safe_trials": limits.replicas,
        "sector_deg": limits.sector_deg,
        "precision": limits.precision_n_s,
        "costs": costs,
        "zero": 100.0 * -least / (most - least).max(1e-9),
        "near": card.near_limit.map(|share| format!("{:.0}", 100.0 * share)),
        "trials": card.designed.trials,
        "designed": text::share(card.designed.success_rate),
        "losses": losses,
        "lost": [lost, card.designed.trials - card.together.survived],
        "pushes": pushes,
        "replicas": card.replicas,
        "overdispersion": card.overdispersion.map(|ratio| format!("{ratio:.1}")),
        "duration_ms": format!("{:.0}", 1e3 * first.duration_s),
        "at": at,
        "bob": bob,
        "com_height_m": format!("{:.2}", limits.pendulum_bounds.com_height_m),
        "link": limits.pendulum_bounds.push_link,
        "command": text::compare_command(folder),
    });
    html_page::render(
        "card.html",
        TEMPLATE,
        UndefinedBehavior::SemiStrict,
        |_| {},
        &context,
    )
}

/// A heading in degrees and, if it has a word, in words.
fn heading_words(heading_deg: f64) -> String {
    let word = heading_deg.rem_euclid(360.0) / 45.0;
    match word.fract() == 0.0 {
        true => format!("{heading_deg:.0}\u{b0} {}", DIRECTIONS[word as usize % 8]),
        false => format!("{heading_deg:.1}\u{b0}"),
    }
}

/// A row of the costs, with the places of its bar and its interval between `least` and `most` (percent of the width).
fn bar(cost: &Cost, least: f64, most: f64) -> Value {
    let at = |x: f64| 100.0 * (x - least) / (most - least).max(1e-9);
    let [low, high] = cost.difference_ci;
    let (from, to) = (cost.difference.min(0.0), cost.difference.max(0.0));
    let minus = |text: String| text.replace('-', "\u{2212}");
    json!({
        "name": cost.name,
        "spread": minus(cost.spread.clone()),
        "points": minus(signed(100.0 * cost.difference, 1)),
        "interval": format!("{} to {}", minus(signed(100.0 * low, 0)), minus(signed(100.0 * high, 0))),
        "from": at(from),
        "width": at(to) - at(from),
        "low": at(low),
        "reach": at(high) - at(low),
        "is_sure": low > 0.0 || high < 0.0,
    })
}
