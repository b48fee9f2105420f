//! The files of a result that people and CI services read.

use crate::text::layout::wrapped;
use crate::{figure, html, junit, markdown};
use standfast_core::error::Result;
use standfast_files::write_atomic;
use standfast_study::Summary;
use standfast_study::verdict::trial_columns::TrialColumns;
use std::path::Path;

/// Names of the files.
pub const FILES: [&str; 4] = ["report.html", "summary.md", "junit.xml", "success.svg"];

/// Writes the files to the result folder. `rows` are the rows of the summary. Fails if a file cannot be written.
pub fn write(summary: &Summary, rows: &TrialColumns, folder: &Path) -> Result<()> {
    let [report, markdown, junit, success] = FILES.map(|name| folder.join(name));
    figure::success::write(&success, summary)?;
    write_atomic(&report, html::page(summary, rows, folder)?.as_bytes())?;
    write_atomic(&markdown, markdown::text(summary).as_bytes())?;
    write_atomic(&junit, junit::xml(summary)?.as_bytes())
}

/// The message that names the written files and `others`, the report first.
pub fn written(folder: &Path, others: &[&str]) -> String {
    let [report, more @ ..] = FILES;
    let (report, more) = (folder.join(report), [&more[..], others].concat().join(", "));
    wrapped(
        "written: ",
        &format!("{} (for a browser), {more}", report.display()),
    )
    .trim_end()
    .into()
}

/// Whether a comparison may be written to a folder. The folder must be new, be empty, or hold an earlier comparison.
pub fn may_be_written_to(folder: &Path) -> bool {
    let Ok(mut entries) = std::fs::read_dir(folder) else {
        return !folder.exists();
    };
    entries.next().is_none()
        || folder.join("summary.json").is_file() && !folder.join("parts").exists()
}
