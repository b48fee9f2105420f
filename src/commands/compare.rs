//! `standfast compare`: compares two finished campaigns with the same pushes, trial by trial.

use super::result::{Printing, exit_code};
use super::terminal::{note, print};
use crate::campaign::Folder;
use crate::campaign::verdict::compare::Comparison;
use crate::error::{Error, Result};
use crate::render::result;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Gain sets of the same name are compared with each other, and called by their
folders, as in `catch (DIR_A)`. If the two results share no name, every gain
set of one is compared with every gain set of the other. The exit code is 3 if
the two folders do not hold the same trials.")]
pub struct CompareArgs {
    /// A result folder of `run`
    pub dir_a: PathBuf,
    /// Another result folder, of a campaign with the same pushes
    pub dir_b: PathBuf,
    /// Write report.html, summary.md, summary.json, junit.xml, trials.parquet and success.svg to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What the result must show, as for `run`; a gain set of both results is named with its folder, as in
    /// 'catch (new) >= catch (old) - 0.01'
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    #[command(flatten)]
    pub printing: Printing,
}

pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(out) = args.out.as_deref().filter(|out| !result::may_be_written_to(out)) {
        let problem = "holds other files than those of a comparison; give a new or empty folder";
        return Err(Error::Parts { path: out.into(), problem: problem.into() });
    }
    let comparison = Comparison::new(&Folder::existing(&args.dir_a)?, &Folder::existing(&args.dir_b)?, &args.gate)?;
    let summary = &comparison.summary;
    print(&args.printing.of(summary, Path::new("")))?;
    if let Some(out) = &args.out {
        result::write(&comparison.write(out)?, &comparison.rows, out)?;
        note(&result::written(out, &["summary.json", "trials.parquet"]));
    }
    Ok(exit_code(summary, Path::new("")))
}
