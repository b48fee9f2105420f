//! `standfast paper`: the paper's figures, from its own scenarios.

use super::terminal::print;
use crate::error::Result;
use crate::render;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Writes index.html, which holds everything and opens from the disk, and one SVG for each figure."
)]
pub struct PaperArgs {
    /// Folder: a new one, an empty one, or that of an earlier `standfast paper`
    #[arg(long, value_name = "DIR", default_value = "standfast-paper")]
    pub out: PathBuf,
    /// Print the numbers behind the captions as one JSON object
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &PaperArgs) -> Result<ExitCode> {
    print(&render::paper::run(&args.out, args.json)?)?;
    Ok(ExitCode::SUCCESS)
}
