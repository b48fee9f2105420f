//! `standfast status`: prints which trials are missing in a result folder, and how to compute them.

use super::result::Printing;
use super::terminal::print;
use crate::campaign::verdict::gates::Gates;
use crate::campaign::{Folder, Summary};
use crate::error::Result;
use crate::render::result::FILES;
use crate::render::{self, text};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

/// Exit code if parts are missing.
const INCOMPLETE: u8 = 3;

#[derive(Debug, clap::Args)]
pub struct StatusArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    #[command(flatten)]
    pub printing: Printing,
}

pub fn run(args: &StatusArgs) -> Result<ExitCode> {
    let folder = Folder::existing(&args.dir)?;
    let complete = print_status(&folder, args.printing)?;
    if complete && args.printing.full && !args.printing.json {
        let (summary, _) = Summary::read(&folder, &Gates::new(&folder.manifest, None)?)?;
        print(&format!("\n{}", text::campaign(&summary, &folder.path, true)))?;
    }
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::from(INCOMPLETE) })
}

/// The gain sets that have fewer trials than the result, with their number.
fn stopped_early(folder: &Folder) -> Vec<(&String, u64)> {
    let trials = folder.set_trials().unwrap_or_default();
    folder.manifest.sets.iter().zip(trials).filter(|(_, trials)| *trials < folder.trials()).collect()
}

/// Prints which parts are complete and what to run next. Returns whether all parts are.
pub fn print_status(folder: &Folder, printing: Printing) -> Result<bool> {
    let (missing, blocks) = (folder.missing(), folder.blocks());
    let (complete, trials) = (missing.is_empty(), folder.trials_of(&missing));
    let there = blocks - missing.len() as u64;
    let next = if complete { folder.merge_command() } else { folder.resume_command() };
    if printing.json {
        print(&render::json(&json!({
            "name": folder.manifest.campaign.name,
            "engine": folder.manifest.engine,
            "config_hash": folder.manifest.config_hash,
            "complete": complete,
            "parts": blocks,
            "parts_complete": there,
            "missing_trials": trials,
            "set_trials": folder.set_trials(),
            "next_command": next,
        })))?;
        return Ok(complete);
    }
    let (path, engine) = (folder.path.display(), &folder.manifest.engine);
    let mut head = format!("{path}: {there} of {blocks} parts are complete, simulated by {engine}");
    for (set, trials) in stopped_early(folder) {
        head += &format!("\n{set} has {trials} trials: all that was to be decided about it was decided by then");
    }
    let report = folder.path.join(FILES[0]);
    print(&if complete && report.is_file() {
        format!("{head}\nThe result is there: {}\n", report.display())
    } else if complete {
        format!("{head}\nto join them: {next}\n")
    } else {
        let merge = folder.merge_command();
        format!(
            "{head}\nmissing: trials {trials}\nto compute the rest: {next}\n\
             or copy what the folders of other shards hold into this one, and then: {merge}\n"
        )
    })?;
    Ok(complete)
}
