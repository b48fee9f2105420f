//! `standfast status`: prints which trials are missing in a result folder, and how to compute them.

use super::arguments::{MOST_TRIAL, count};
use super::result::Printing;
use super::terminal::print;
use serde_json::json;
use standfast_core::error::Result;
use standfast_report::result::FILES;
use standfast_report::text::{self, next_command};
use standfast_study::store::folder::joined;
use standfast_study::until_resolved::UntilResolved;
use standfast_study::verdict::gates::Gates;
use standfast_study::{Folder, Summary};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exit code if parts are missing.
const INCOMPLETE: u8 = 3;

#[derive(Debug, clap::Args)]
pub struct StatusArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Print only which of N shards lack parts: 3,7-9, or `none`
    #[arg(long, value_name = "N", conflicts_with_all = ["json", "full"], value_parser = count::<u64>(1..=MOST_TRIAL))]
    pub shards: Option<u64>,
    /// Result folder of an earlier run, for gates with `baseline`
    #[arg(long, value_name = "DIR")]
    pub baseline: Option<PathBuf>,
    #[command(flatten)]
    pub printing: Printing,
}

pub fn run(args: &StatusArgs) -> Result<ExitCode> {
    let (folder, baseline) = (Folder::existing(&args.dir)?, args.baseline.as_deref());
    folder.check_rows()?;
    if let Some(shards) = args.shards {
        let missing = missing(&folder, baseline)?;
        print(&format!("{}\n", shards_of(&missing, shards)))?;
        return Ok(if missing.is_empty() {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(INCOMPLETE)
        });
    }
    let complete = print_status(&folder, baseline, args.printing)?;
    if complete && args.printing.full && !args.printing.json {
        let (summary, _) = Summary::read(&folder, &Gates::new(&folder.manifest, baseline)?)?;
        print(&format!(
            "\n{}",
            text::campaign(&summary, &folder.path, true)
        ))?;
    }
    Ok(if complete {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(INCOMPLETE)
    })
}

/// The blocks that a result still lacks. Of a campaign that ends when decided and has not ended, the looks that its
/// parts allow are taken: what was decided by then lacks nothing.
fn missing(folder: &Folder, baseline: Option<&Path>) -> Result<Vec<u64>> {
    let lacking = |controller_trials: &[u64]| {
        (0..folder.blocks())
            .filter(|&block| folder.lacks(block, controller_trials).contains(&true))
            .collect()
    };
    if folder.controller_trials().is_some() {
        return Ok(folder.missing());
    }
    let gates = match Gates::new(&folder.manifest, baseline) {
        // What is decided can be known only with a baseline.
        Err(_) if baseline.is_none() => {
            return Ok(lacking(&vec![
                folder.trials();
                folder.manifest.controllers.len()
            ]));
        }
        gates => gates?,
    };
    let Some(mut looks) = UntilResolved::new(folder, &gates) else {
        return Ok(folder.missing());
    };
    looks.go_on(&|_| {})?;
    Ok(lacking(&looks.controller_trials))
}

/// The controllers that have fewer trials than the result, with their number.
fn stopped_early(folder: &Folder) -> Vec<(&String, u64)> {
    let trials = folder.controller_trials().unwrap_or_default();
    folder
        .manifest
        .controllers
        .iter()
        .zip(trials)
        .filter(|(_, trials)| *trials < folder.trials())
        .collect()
}

/// Prints which parts are complete and what to run next. Returns whether all parts are.
pub fn print_status(folder: &Folder, baseline: Option<&Path>, printing: Printing) -> Result<bool> {
    let (missing, blocks) = (missing(folder, baseline)?, folder.blocks());
    let (complete, trials) = (missing.is_empty(), folder.trials_of(&missing));
    let parts_complete = blocks - missing.len() as u64;
    let next = if complete {
        next_command::merge(folder)
    } else {
        next_command::resume(folder)
    };
    if printing.json {
        print(&standfast_report::json(&json!({
            "name": folder.manifest.campaign.name,
            "engine": folder.manifest.engine(),
            "config_hash": folder.manifest.config_hash,
            "complete": complete,
            "parts": blocks,
            "parts_complete": parts_complete,
            "missing_trials": trials,
            "controller_trials": folder.controller_trials(),
            "next_command": next,
        })))?;
        return Ok(complete);
    }
    let (path, engine) = (folder.name(), folder.manifest.engine());
    let mut head =
        format!("{path}: {parts_complete} of {blocks} parts are complete, simulated by {engine}");
    for (controller, trials) in stopped_early(folder) {
        head += &format!(
            "\n{controller} has {trials} trials: all that was to be decided about it was decided by then"
        );
    }
    let report = folder.path.join(FILES[0]);
    print(&if complete && report.is_file() {
        format!("{head}\nThe result is there: {}\n", report.display())
    } else if folder.is_packed() {
        format!("{head}\nIt is packed. --full prints the result.\n")
    } else if complete {
        format!("{head}\nto join them: {next}\n")
    } else {
        let merge = next_command::merge(folder);
        format!(
            "{head}\nmissing: trials {trials}\nto compute the rest: {next}\n\
             or copy what the folders of other shards hold into this one, and then: {merge}\n"
        )
    })?;
    Ok(complete)
}

/// The shards that have these blocks, if there are `shards` in all, as ranges: `3,7-9`; or `none`.
fn shards_of(blocks: &[u64], shards: u64) -> String {
    let numbers: BTreeSet<u64> = blocks.iter().map(|block| block % shards + 1).collect();
    match numbers.is_empty() {
        // The answer is not an empty line, because a command that fails also prints an empty line.
        true => "none".into(),
        false => joined(numbers.into_iter().map(|number| (number, number + 1))).join(","),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_told_by_their_shards() {
        assert_eq!(shards_of(&[0, 2, 10, 12, 13, 14], 10), "1,3-5");
        assert_eq!(shards_of(&[], 4), "none");
    }
}
