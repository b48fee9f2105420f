//! `standfast columns`: prints what the columns of trials and traces mean.

use super::terminal::print;
use standfast_core::error::Result;
use standfast_files::columns::CHAPTER;
use standfast_report::text::layout::wrapped;
use std::process::ExitCode;

/// Prints the chapter, with tables as lists.
pub fn run() -> Result<ExitCode> {
    let paragraphs: Vec<String> = CHAPTER.split("\n\n").skip(1).map(plain).collect();
    print(&paragraphs.join("\n"))
}

/// A paragraph without marks; of a table, a line for each row.
fn plain(paragraph: &str) -> String {
    if !paragraph.starts_with('|') {
        let text = paragraph.trim_start_matches(['#', ' ']).replace('\n', " ");
        return wrapped("", &text.replace('`', ""));
    }
    let mut text = String::new();
    for row in paragraph.lines() {
        if let Some((name, meaning)) = row.split_once("` | ") {
            let mark = format!(" {:<26} ", name.trim_start_matches("| `"));
            text += &wrapped(&mark, &meaning.trim_end_matches(" |").replace('`', ""));
        }
    }
    text
}
