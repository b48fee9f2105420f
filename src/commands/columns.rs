//! `standfast columns`: prints what the columns of trials and traces mean.

use super::terminal::print;
use standfast_core::error::Result;
use standfast_files::columns::CHAPTER;
use standfast_report::text::layout::wrapped;
use std::process::ExitCode;

/// Prints the chapter, with tables as lists.
pub fn run() -> Result<ExitCode> {
    let row = |row: &str| {
        let (name, meaning) = row.split_once("` | ")?;
        let name = format!(" {:<26} ", name.trim_start_matches("| `"));
        Some(wrapped(
            &name,
            &meaning.trim_end_matches(" |").replace('`', ""),
        ))
    };
    let plain = |paragraph: &str| match paragraph.starts_with('|') {
        true => paragraph.lines().filter_map(row).collect(),
        false => wrapped(
            "",
            &paragraph
                .trim_start_matches(['#', ' '])
                .replace('\n', " ")
                .replace('`', ""),
        ),
    };
    print(
        &CHAPTER
            .split("\n\n")
            .skip(1)
            .map(plain)
            .collect::<Vec<String>>()
            .join("\n"),
    )
}
