//! `standfast open`: shows the page of a result in the browser.

use super::terminal::{alert, print};
use standfast_core::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What there is to see in a folder, the best first: of a campaign or a comparison, of a card, of a `limit --dense`.
const PAGES: [&str; 3] = ["report.html", "card.html", "map.svg"];
const ENDINGS: [&str; 2] = ["html", "svg"];

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast open standfast-results/standard
  standfast open push.html

Where there is no display, only the path is printed.")]
pub struct OpenArgs {
    /// Result folder of `run`, `merge`, `compare`, `limit --dense` or `card`, or a page (.html or .svg)
    #[arg(value_name = "DIR|FILE")]
    pub result: PathBuf,
}

pub fn run(args: &OpenArgs) -> Result<ExitCode> {
    let page = page(&args.result)?;
    if has_display()
        && let Err(problem) = open::that_detached(&page)
    {
        alert(&format!("no browser could be started: {problem}"));
    }
    print(&format!("{}\n", page.display()))
}

/// The page of a result, with its whole path.
fn page(result: &Path) -> Result<PathBuf> {
    let is_page = result
        .extension()
        .is_some_and(|ending| ENDINGS.iter().any(|page| ending == *page));
    let pages = PAGES.map(|page| result.join(page));
    let page = if is_page {
        result
    } else {
        pages
            .iter()
            .find(|page| page.is_file())
            .unwrap_or(&pages[0])
    };
    match std::fs::canonicalize(page) {
        Ok(path) => Ok(path),
        Err(_) if result.is_dir() => {
            let merge = "`standfast status` says what the result lacks, and `standfast merge` writes its report";
            Err(Error::Parts {
                path: result.into(),
                problem: format!("there is no {}; {merge}", PAGES.join(", no ")),
            })
        }
        Err(source) => Err(Error::Read {
            path: page.into(),
            source,
        }),
    }
}

fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
