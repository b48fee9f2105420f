//! `standfast-paper page`: draws the paper's figures from simulations of its scenarios, and says of each statement of the
//! paper whether the simulations bear it out.
//!
//! `study` runs all simulations and searches once, `gauge` those of the paper's apparatus, and `watch` observes the pushed ones. `numbers` computes the numbers
//! of each figure from them, `timing` measures how fast the sets are updated, and `report::page` draws the page and
//! holds its words. Two runs of the same program differ only in what `timing` measures.

mod gauge;
mod numbers;
mod study;
mod timing;
mod watch;

use crate::render::page::study::Study;
use crate::render::page::words::{Claim, Count, Words, counts};
use crate::render::page::{Figure, Page};
use serde_json::{Value, json};
use standfast::commands::terminal::print;
use standfast::core::error::Result;
use standfast::files::own_folder;
use standfast::files::write_atomic;
use standfast::report;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// File name of the page.
const PAGE: &str = "index.html";

/// Arguments of `standfast-paper page`.
#[derive(Debug, Clone, clap::Args)]
#[command(
    after_help = "Writes index.html, which holds everything and needs no server, and one SVG for\neach figure. The paper is that of K. Yamamoto and Y. Nakamura on switching\ncontrol and quick stepping with maximal CPI sets."
)]
pub struct PageArgs {
    /// Folder to write to: new, empty, or of an earlier `standfast-paper page`
    #[arg(long, value_name = "DIR", default_value = "standfast-paper")]
    pub out: PathBuf,
    /// Print the numbers behind the captions as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Computes everything, writes the page and its figures, and prints a summary. Fails if the folder of `--out` holds
/// other files (which is checked first) or cannot be written, or if the solver gives up.
pub fn run(args: &PageArgs) -> Result<ExitCode> {
    let words = Words::load()?;
    let is_own = |name: &str| name == PAGE || words.figure.iter().any(|figure| figure.file == name);
    let accepted = "a new folder, an empty one, or that of an earlier `standfast-paper page`";
    own_folder("--out", &args.out, is_own, accepted)?;
    let study = study::run()?;
    let mut numbers = numbers::all(&study)?;
    // The timing comes last, when nothing else runs.
    numbers.insert("update_time".into(), timing::measure(&study));
    let numbers = Value::Object(numbers);
    let page = Page::new(words, &study, &numbers)?;
    let html = page.html(&study)?;
    for figure in &page.figures {
        write_atomic(&args.out.join(&figure.words.file), figure.svg().as_bytes())?;
    }
    write_atomic(&args.out.join(PAGE), html.as_bytes())?;
    let text = if args.json {
        as_json(&study, &page, &numbers)
    } else {
        tell(&args.out, &page, &numbers["update_time"])
    };
    print(&text)
}

/// All claims and numbers as one JSON object.
fn as_json(study: &Study, page: &Page, numbers: &Value) -> String {
    let mut figures = Vec::new();
    for Figure { words, claims, .. } in &page.figures {
        figures.push(json!({
            "figure": words.number, "file": words.file, "title": words.title, "verdicts": counts(claims),
            "claims": claims, "numbers": numbers[&words.number],
        }));
    }
    report::json(&json!({
        "robot": study.robot.name,
        "gains": study.design.family.name,
        "verdicts": counts(page.claims()),
        "found": page.found,
        "figures": figures,
        "not_made": page.not_made,
        "update_time": numbers["update_time"],
    }))
}

/// The summary for the terminal: the counts of verdicts for each figure and in all, and the measured times.
fn tell(folder: &Path, page: &Page, timing: &Value) -> String {
    fn told<'a>(claims: impl IntoIterator<Item = &'a Claim>) -> String {
        counts(claims)
            .iter()
            .map(Count::in_words)
            .collect::<Vec<_>>()
            .join(", ")
    }
    let mut text = String::new();
    for Figure { words, claims, .. } in &page.figures {
        let number = format!("Fig. {}", words.number);
        _ = writeln!(text, "{number:<8}{:<30}{}", words.file, told(claims));
    }
    _ = writeln!(
        text,
        "in all  {:<30}{}",
        format!("{} statements", page.claims().count()),
        told(page.claims())
    );
    if let [Some(online), Some(stored)] =
        ["online", "stored_phi"].map(|way| timing[way]["median_ms"].as_f64())
    {
        let printed = &timing["paper_ms"];
        _ = writeln!(
            text,
            "update  of the sets takes {online:.4} ms, by eq. 25 {stored:.4} ms; the paper has {printed} ms"
        );
    }
    _ = writeln!(text, "\nopen {}", folder.join(PAGE).display());
    text
}
