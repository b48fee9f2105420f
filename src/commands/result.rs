//! What `run` and `merge` end with: the result is judged, written, printed, and its telling trials are shown.

use super::arguments::{GateArgs, ReplaysArgs};
use super::interrupt::STOP;
use super::replay::write_telling;
use super::terminal::{note, print};
use crate::campaign::verdict::compare::is_same_folder;
use crate::campaign::verdict::gates::Gates;
use crate::campaign::{Folder, Summary};
use crate::error::{Error, Result};
use crate::render::{self, result, text};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

/// How a result is printed.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Printing {
    /// Print all tables, not only rates, verdicts and gates
    #[arg(long)]
    pub full: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

impl Printing {
    /// `folder` holds the result.
    pub fn of(self, summary: &Summary, folder: &Path) -> String {
        if self.json { render::json(summary) } else { text::campaign(summary, folder, self.full) }
    }
}

/// Exit code if a gate did not pass.
const GATE_FAILED: u8 = 100;

/// The gates of a result. Errors: those of [`Gates::new`], or the baseline is the result itself.
pub fn gates_of(folder: &Folder, args: &GateArgs) -> Result<Gates> {
    if let Some(baseline) = args.baseline.as_deref().filter(|baseline| is_same_folder(baseline, &folder.path)) {
        let problem =
            "is the result folder itself; name the folder of an earlier result, or give this one another --out";
        return Err(Error::Parts { path: baseline.into(), problem: problem.into() });
    }
    Gates::new(&folder.manifest, args.baseline.as_deref())
}

/// Writes the result files and prints the result; then the replays, which nobody should have to wait for.
pub fn conclude(folder: &Folder, gates: &Gates, args: &ReplaysArgs, printing: Printing) -> Result<ExitCode> {
    let (summary, rows) = Summary::of_folder(folder, gates)?;
    result::write(&summary, &rows, &folder.path)?;
    print(&printing.of(&summary, &folder.path))?;
    note(&result::written(&folder.path, &["summary.json", "trials.parquet", "campaign.toml"]));
    let verdict = exit_code(&summary, &folder.path);
    let stop = || STOP.load(Ordering::Relaxed);
    match write_telling(folder, &summary, args.replays, &stop) {
        Ok(0) => {}
        Ok(replays) => {
            // Now with links to them.
            result::write(&summary, &rows, &folder.path)?;
            let these = if replays == 1 { "replay of a telling trial" } else { "replays of telling trials" };
            note(&format!("written: {}: {replays} {these}", folder.path.join("replays").display()));
        }
        // The result is none the worse.
        Err(error) => log::warn!("no replays: {error}"),
    }
    if stop() {
        note("interrupted: the result is complete; the same command writes the replays that are missing");
        return Err(Error::Interrupted);
    }
    Ok(verdict)
}

/// Says which gates did not pass, each with the command that replays a trial that was lost.
pub fn exit_code(summary: &Summary, folder: &Path) -> ExitCode {
    text::failed_gates(summary, folder).iter().for_each(|line| note(line));
    if summary.gates.iter().all(|gate| gate.passes) { ExitCode::SUCCESS } else { ExitCode::from(GATE_FAILED) }
}
