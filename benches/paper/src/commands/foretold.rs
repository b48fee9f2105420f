//! `standfast-paper foretold`: prints how often a controller recovered, by where the state was at the end of the push.

use crate::foretold::by_margin;
use standfast::commands::terminal::print;
use standfast::core::error::Result;
use standfast::report;
use standfast::study::Folder;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct ForetoldArgs {
    /// Result folder of `standfast run`
    pub dir: PathBuf,
    /// Name of a controller in the result that has CPI sets
    #[arg(long, value_name = "NAME", default_value = "switching")]
    pub controller: String,
}

pub fn run(args: &ForetoldArgs) -> Result<ExitCode> {
    let bins = by_margin(&Folder::existing(&args.dir)?, &args.controller)?;
    print(&report::json(&bins))
}
