//! The end of `run` and of `merge`: it judges the result, writes and prints it, and writes replays of its telling
//! trials.

use super::arguments::{GateArgs, ReplaysArgs};
use super::interrupt::STOP;
use super::replay::{Replays, write_telling};
use super::terminal::{alert, note, print};
use standfast_core::error::{Error, Result};
use standfast_files::is_same_folder;
use standfast_report::{result, text};
use standfast_study::verdict::compare::Comparison;
use standfast_study::verdict::gates::Gates;
use standfast_study::{Folder, Summary};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

/// How a result is printed.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Printing {
    /// Print all tables
    #[arg(long)]
    pub full: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

impl Printing {
    /// The text to print of a result; `folder` is the one that holds it.
    pub fn of(self, summary: &Summary, folder: &Path) -> String {
        if self.json {
            standfast_report::json(summary)
        } else {
            text::campaign(summary, folder, self.full)
        }
    }
}

/// What is printed of a result.
pub struct Told<'a> {
    pub printing: Printing,
    /// The packed baseline beside which the result is told.
    pub baseline: Option<&'a Folder>,
}

impl Told<'_> {
    /// The text to print of the result in `folder`. Beside a baseline it is that of the comparison, whose report is written
    /// to the folder `beside` there. It fails if the two cannot be compared, or if that folder is not writable.
    fn text(&self, summary: &Summary, folder: &Folder) -> Result<String> {
        let Some(baseline) = self.baseline else {
            return Ok(self.printing.of(summary, &folder.path));
        };
        let mut comparison = Comparison::new(folder, baseline, &[])?;
        let beside = folder.path.join("beside");
        result::write(&comparison.write(&beside)?, &comparison.rows, &beside)?;
        note(&result::written(
            &beside,
            &["summary.json", "trials.parquet"],
        ));
        comparison.summary.gates.clone_from(&summary.gates);
        comparison.summary.baseline.clone_from(&summary.baseline);
        Ok(self.printing.of(&comparison.summary, Path::new("")))
    }
}

/// The exit code of the program if a gate did not pass.
const GATE_FAILED: u8 = 100;

/// The gates of the campaign in a folder. It fails as [`Gates::new`] does, and if the baseline is the folder itself.
pub fn gates_of(folder: &Folder, args: &GateArgs) -> Result<Gates> {
    if let Some(baseline) = args
        .baseline
        .as_deref()
        .filter(|baseline| is_same_folder(baseline, &folder.path))
    {
        let problem = "is the result folder itself; name the folder of an earlier result, or give this one another --out";
        return Err(Error::Parts {
            path: baseline.into(),
            problem: problem.into(),
        });
    }
    Gates::new(&folder.manifest, args.baseline.as_deref())
}

/// Writes the files of the result, prints it (unless `told` is None), and says which gates did not pass. The
/// replays are written after that, so that nobody has to wait for them to read the result. With the summary it returns how
/// trials differ that did not end in their replay as they did in the result; `afresh` writes replays that are there, too.
pub fn conclude(
    folder: &Folder,
    gates: &Gates,
    args: &ReplaysArgs,
    told: Option<Told>,
    afresh: bool,
) -> Result<(Summary, Vec<String>)> {
    let (summary, rows) = Summary::of_folder(folder, gates)?;
    result::write(&summary, &rows, &folder.path)?;
    if let Some(told) = told {
        print(&told.text(&summary, folder)?)?;
    }
    note(&result::written(
        &folder.path,
        &["summary.json", "trials.parquet", "campaign.toml"],
    ));
    say_failed_gates(&summary, &folder.path);
    let stop = || STOP.load(Ordering::Relaxed);
    let Replays {
        wanted,
        written: replays,
        differ,
        refused,
    } = write_telling(folder, &summary, args.replays, afresh, &stop);
    if replays > 0 {
        // The page is written again, now with links to the replays.
        result::write(&summary, &rows, &folder.path)?;
        let these = if replays == 1 {
            "replay of a telling trial"
        } else {
            "replays of telling trials"
        };
        note(&format!(
            "written: {}: {replays} {these}",
            folder.path.join("replays").display()
        ));
    }
    if let Some(refused) = refused {
        return Err(refused);
    }
    if stop() && replays < wanted {
        alert(
            "interrupted: the result is complete; the same command writes the replays that are missing",
        );
        return Err(Error::Interrupted);
    }
    Ok((summary, differ))
}

/// Says which gates did not pass, each with the command that replays a trial that was lost.
pub fn say_failed_gates(summary: &Summary, folder: &Path) {
    for line in text::failed_gates(summary, folder) {
        alert(&line);
    }
}

/// Whether all gates of all results pass.
pub fn exit_code(results: &[Summary]) -> ExitCode {
    exit_code_of_gates(
        results
            .iter()
            .flat_map(|result| &result.gates)
            .all(|gate| gate.passes),
    )
}

/// The exit code for gates all of which pass, or not.
pub fn exit_code_of_gates(passes: bool) -> ExitCode {
    if passes {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(GATE_FAILED)
    }
}
