//! The files of a result that people and CI services look at.

use crate::campaign::{Row, Summary};
use crate::error::Result;
use crate::files::write_atomic;
use crate::report::{html, junit, markdown, plot};
use std::path::Path;

/// Their names, in the order in which they are written.
pub const FILES: [&str; 4] = ["success.svg", "report.html", "summary.md", "junit.xml"];

/// Writes them beside `summary.json`. `rows` are sorted by trial, then by set.
pub fn write(summary: &Summary, rows: &[Row], folder: &Path) -> Result<()> {
    let [success, report, markdown, junit] = FILES.map(|name| folder.join(name));
    plot::write_success(summary, &success)?;
    write_atomic(&report, html::page(summary, rows)?.as_bytes())?;
    write_atomic(&markdown, markdown::text(summary).as_bytes())?;
    write_atomic(&junit, junit::xml(summary)?.as_bytes())
}
