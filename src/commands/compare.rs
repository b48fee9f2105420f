//! `standfast compare`: compares two finished campaigns with the same pushes, trial by trial.

use super::result::{Printing, exit_code, say_failed_gates};
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_report::result;
use standfast_study::Folder;
use standfast_study::verdict::compare::Comparison;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Controllers of the same name are compared with each other, and called by their
folders, as in `catch (DIR_A)`. If the two results share no name, every
controller of one is compared with every controller of the other. A gate names
them so: --gate 'catch (new) >= catch (old) - 0.01'. The folder of --out gets
report.html, summary.md, summary.json, junit.xml, trials.parquet and
success.svg. The exit code is 3 if the two folders do not hold the same trials."
)]
pub struct CompareArgs {
    /// A result folder of `run`
    pub dir_a: PathBuf,
    /// Another result folder, of a campaign with the same pushes
    pub dir_b: PathBuf,
    /// Folder for report and tables
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// A requirement, such as 'catch (new) >= catch (old) - 0.01'
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    #[command(flatten)]
    pub printing: Printing,
}

pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(out) = args.out.as_deref() {
        check_out(out)?;
    }
    let [a, b] = [
        Folder::existing(&args.dir_a)?,
        Folder::existing(&args.dir_b)?,
    ];
    let comparison = Comparison::new(&a, &b, &args.gate)?;
    print(&args.printing.of(&comparison.summary, Path::new("")))?;
    if let Some(out) = &args.out {
        write(&comparison, out)?;
    }
    say_failed_gates(&comparison.summary, Path::new(""));
    Ok(exit_code(&[comparison.summary]))
}

/// Fails if a comparison may not be written to this folder.
fn check_out(out: &Path) -> Result<()> {
    if result::may_be_written_to(out) {
        return Ok(());
    }
    let problem = "holds other files than those of a comparison; give a new or empty folder";
    Err(Error::Parts {
        path: out.into(),
        problem: problem.into(),
    })
}

/// Writes the files of a comparison, and says which.
fn write(comparison: &Comparison, out: &Path) -> Result<()> {
    result::write(&comparison.write(out)?, &comparison.rows, out)?;
    note(&result::written(out, &["summary.json", "trials.parquet"]));
    Ok(())
}
