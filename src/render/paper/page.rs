//! `index.html`: all figures as one page that asks for nothing else.

use super::figure::{Claim, Count, Figure, counts};
use super::timing::Timing;
use crate::error::Result;
use crate::render::html_page;
use minijinja::UndefinedBehavior;
use serde_json::{Value, json};

const TEMPLATE: &str = include_str!("paper.html.jinja");
const STYLE: &str = include_str!("paper.css");
const FIGURE_STYLE: &str = include_str!("figure.css");

/// Figures of the paper that nothing here can show.
pub const NOT_MADE: [(&str, &str); 4] = [
    ("1", "a sketch of the mass concentrated model and the inverted pendulum: eq. 1 to 4, nothing to compute."),
    ("2", "a sketch of a contact region and its convex hull: Fig. 4 shows real ones."),
    ("10", "a photograph of the force gauge on its wires: pushes are simulated here."),
    ("11", "a block diagram of the controller: it is a drawing; Fig. 5 shows the controller at work."),
];

/// What the curves and bands of Fig. 9 and 14 are, where their own legend is scrolled out of sight.
const KEYS: [(&str, &str); 9] = [
    ("<line class=\"com\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "COM"),
    ("<line class=\"wanted\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "ZMP wanted"),
    ("<line class=\"zmp\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "ZMP"),
    ("<line class=\"dcm dashed\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "DCM"),
    ("<line class=\"left dashed\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "left foot"),
    ("<line class=\"right\" x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\"/>", "right foot"),
    ("<rect class=\"band\" width=\"26\" height=\"10\"/>", "soles on the ground"),
    ("<rect class=\"pushed\" width=\"26\" height=\"10\"/>", "push"),
    ("<rect class=\"swing\" width=\"26\" height=\"10\"/>", "footstep in the air"),
];

/// The page. Errors: none but a template that is wrong.
pub fn page(figures: &[Figure], timing: Option<&Timing>, facts: &Value) -> Result<String> {
    let figures: Vec<Value> = figures.iter().map(shown).collect();
    let context = json!({
        "style": STYLE,
        "figure_style": FIGURE_STYLE,
        "figures": figures,
        "not_made": NOT_MADE,
        "keys": KEYS,
        "timing": timing.map(|timing| json!({
            "claims": timing.claims, "repetitions": timing.repetitions, "counts": told(&timing.claims),
        })),
        "facts": facts,
    });
    html_page::render("index.html", TEMPLATE, UndefinedBehavior::Strict, |_| (), &context)
}

fn shown(figure: &Figure) -> Value {
    let layout = match figure.panels.iter().map(|panel| panel.width).fold(0.0, f64::max) {
        w if w < 300.0 => "strip",
        w if w < 420.0 => "thirds",
        w if w < 600.0 => "halves",
        _ => "wide",
    };
    let label = |i: usize| format!("role=\"img\" aria-label=\"Fig. {}, part {}\"", figure.number, i + 1);
    json!({
        "number": figure.number,
        "title": figure.title,
        "file": figure.file,
        "reading": figure.reading,
        "layout": layout,
        "panels": figure.panels.iter().enumerate().map(|(i, panel)| panel.svg(&label(i))).collect::<Vec<_>>(),
        "table": figure.table,
        "claims": figure.claims,
        "counts": told(&figure.claims),
    })
}

/// The verdicts of a list of claims: how many of each, in words.
fn told(claims: &[Claim]) -> Vec<Value> {
    counts(claims).iter().map(|count: &Count| json!({ "verdict": count.verdict, "told": count.told() })).collect()
}
