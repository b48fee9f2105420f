//! `standfast paper`: what the paper's figures show, from simulations of its own scenarios, each beside what the paper
//! states and whether that was found.
//!
//! `study` simulates and searches everything once (`watch`: what is seen of a pushed run on the way; `footwork`: which foot
//! goes); `numbers` is what that comes to; `render::paper` draws it and has the words. Everything is a function of the
//! program alone, but for the times of `timing`.

mod footwork;
mod numbers;
mod study;
mod timing;
mod watch;

use crate::error::Result;
use crate::files::write_atomic;
use crate::render::paper::Page;
use crate::render::paper::words::{Count, Words, counts};
use crate::render::{self, own_folder};
use numbers::{Found, with};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use timing::Timing;

/// The page.
const PAGE: &str = "index.html";

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(
    after_help = "Writes index.html, which holds everything and opens from the disk, and one SVG for each figure."
)]
pub struct PaperArgs {
    /// Folder: a new one, an empty one, or that of an earlier `standfast paper`
    #[arg(long, value_name = "DIR", default_value = "standfast-paper")]
    pub out: PathBuf,
    /// Print the numbers behind the captions as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Computes, writes page and figures, and prints. Errors: `--out` holds other things (found out before anything is
/// computed), or cannot be written; the solver gives up.
pub fn run(args: &PaperArgs) -> Result<ExitCode> {
    let words = Words::load()?;
    let is_own = |name: &str| name == PAGE || words.figure.iter().any(|figure| figure.file == name);
    let accepted = "a new folder, an empty one, or that of an earlier `standfast paper`";
    own_folder("--out", &args.out, is_own, accepted)?;
    let study = study::run()?;
    let found = numbers::all(&study)?;
    // Last, when nothing else is going on.
    let timing = timing::measure(&study);
    let mut all: Map<String, Value> =
        found.iter().map(|it| (it.figure.into(), with(it.numbers.clone(), it.more.clone()))).collect();
    all.insert("update_time".into(), timing.as_ref().map_or(Value::Null, |it| with(json!(it), it.more.clone())));
    let page = Page::new(words, &study, &Value::Object(all))?;
    let html = page.html(&study, timing.as_ref().map(|timing| timing.repetitions))?;
    for figure in &page.figures {
        write_atomic(&args.out.join(&figure.words.file), figure.svg().as_bytes())?;
    }
    write_atomic(&args.out.join(PAGE), html.as_bytes())?;
    render::print(&if args.json {
        let figure = |(figure, found): (&render::paper::Figure, &Found)| {
            json!({
                "figure": figure.words.number, "file": figure.words.file, "title": figure.words.title,
                "verdicts": counts(&figure.claims), "claims": figure.claims, "numbers": found.numbers,
            })
        };
        render::json(&json!({
            "robot": study.robot.name,
            "gains": study.design.family.name,
            "figures": page.figures.iter().zip(&found).map(figure).collect::<Vec<_>>(),
            "not_made": page.not_made,
            "update_time": timing,
        }))
    } else {
        tell(&args.out, &page, timing.as_ref())
    })?;
    Ok(ExitCode::SUCCESS)
}

fn tell(folder: &Path, page: &Page, timing: Option<&Timing>) -> String {
    let mut text = String::new();
    for figure in &page.figures {
        let told: Vec<String> = counts(&figure.claims).into_iter().map(|Count { told, .. }| told).collect();
        let number = format!("Fig. {}", figure.words.number);
        _ = writeln!(text, "{number:<8}{:<30}{}", figure.words.file, told.join(", "));
    }
    if let Some(Timing { paper_ms, online, stored_phi, .. }) = timing {
        let [online, stored] = [online, stored_phi].map(|spread| format!("{:.4} ms", spread.median_ms));
        _ = writeln!(text, "update  {online} here, {stored} by eq. 25; printed {paper_ms} ms");
    }
    _ = writeln!(text, "\nopen {}", folder.join(PAGE).display());
    text
}
