//! What the paper's figures show, from simulations of its own scenarios, each beside what the paper
//! states and whether that was found.
//!
//! `study` simulates and searches everything once (`watch`: what is seen of a pushed run on the way); a module for each
//! kind of figure draws it and judges; `figure` is what they have in common. Everything is a function of the program alone, but for the times of `timing`.

mod convergence;
mod decision;
mod figure;
mod inclusion;
mod machine;
mod page;
mod panel;
mod pictures;
mod pushed;
mod regions;
mod responses;
mod sequence;
mod study;
mod timing;
mod watch;

use crate::error::Result;
use crate::files::write_atomic;
use crate::render::{self, own_folder};
use figure::{Count, Figure};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;
use study::Study;
use timing::Timing;

/// The page.
const PAGE: &str = "index.html";
/// One for each figure, in their order.
const FILES: [&str; 10] = [
    "fig03-inclusion.svg",
    "fig04-regions.svg",
    "fig05-sequence.svg",
    "fig06-swing-foot.svg",
    "fig07-robot.svg",
    "fig08-imposed.svg",
    "fig09-responses-imposed.svg",
    "fig12-push-behind.svg",
    "fig13-push-diagonal.svg",
    "fig14-responses-pushed.svg",
];

/// Computes, writes page and figures to a folder, and returns what to print. Errors: `--out` holds other things (found out before
/// anything is computed), or cannot be written; the solver gives up.
pub fn run(out: &Path, json: bool) -> Result<String> {
    let accepted = "a new folder, an empty one, or that of an earlier `standfast paper`";
    own_folder("--out", out, |name| name == PAGE || FILES.contains(&name), accepted)?;
    let study = Study::run()?;
    let figures = figures(&study)?;
    // Last, when nothing else is going on.
    let timing = timing::measure(&study)?;
    let facts = json!({ "robot": study.robot.name, "gains": study.design.family.name, "judge": study.judge });
    let page = page::page(&figures, timing.as_ref(), &facts)?;
    for figure in &figures {
        write_atomic(&out.join(figure.file), figure.svg().as_bytes())?;
    }
    write_atomic(&out.join(PAGE), page.as_bytes())?;
    Ok(if json {
        render::json(&as_json(&study, &figures, timing.as_ref()))
    } else {
        tell(out, &figures, timing.as_ref())
    })
}

fn figures(study: &Study) -> Result<Vec<Figure>> {
    let figures = [
        Some(inclusion::figure(study)?),
        regions::figure(study)?,
        Some(sequence::figure(study)),
        Some(decision::figure(study)),
        Some(machine::figure(study)),
        Some(pictures::imposed(study)),
        Some(responses::imposed(study)?),
        Some(pushed::from_behind(study)),
        Some(pushed::from_diagonal(study)),
        Some(responses::pushed(study)?),
    ];
    Ok(figures.into_iter().flatten().collect())
}

fn as_json(study: &Study, figures: &[Figure], timing: Option<&Timing>) -> Value {
    let shown = |figure: &Figure| {
        json!({
            "figure": figure.number, "file": figure.file, "title": figure.title, "verdicts": figure::counts(&figure.claims),
            "claims": figure.claims, "numbers": figure.numbers,
        })
    };
    json!({
        "robot": study.robot.name,
        "gains": study.design.family.name,
        "figures": figures.iter().map(shown).collect::<Vec<_>>(),
        "not_made": page::NOT_MADE.map(|(figure, why)| json!({ "figure": figure, "why": why })),
        "update_time": timing,
    })
}

fn tell(folder: &Path, figures: &[Figure], timing: Option<&Timing>) -> String {
    let mut text = String::new();
    for figure in figures {
        let told: Vec<String> = figure::counts(&figure.claims).iter().map(Count::told).collect();
        let number = format!("Fig. {}", figure.number);
        _ = writeln!(text, "{number:<8}{:<30}{}", figure.file, told.join(", "));
    }
    if let Some(Timing { paper_ms, online, stored_phi, .. }) = timing {
        let [online, stored] = [online, stored_phi].map(|spread| format!("{:.4} ms", spread.median_ms));
        _ = writeln!(text, "update  {online} here, {stored} by eq. 25; printed {paper_ms} ms");
    }
    _ = writeln!(text, "\nopen {}", folder.join(PAGE).display());
    text
}
