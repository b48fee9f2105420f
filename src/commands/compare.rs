//! `standfast compare`: compares two finished campaigns with the same pushes, trial by trial, or what was observed on
//! hardware with the card that predicts it.

use super::result::{Printing, exit_code, say_failed_gates};
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_files::folder_of;
use standfast_report::{json, result, text};
use standfast_study::Folder;
use standfast_study::card::observed::Observed;
use standfast_study::verdict::compare::Comparison;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    override_usage = "standfast compare [OPTIONS] <DIR_A> <DIR_B>
       standfast compare [--json] --observed <FILE.csv> [CARD_FOLDER]",
    after_help = "Controllers of the same name are compared with each other, and called by their
folders, as in `catch (DIR_A)`. If the two results share no name, every
controller of one is compared with every controller of the other. A gate names
them so: --gate 'catch (new) >= catch (old) - 0.01'. The folder of --out gets
report.html, summary.md, summary.json, junit.xml, trials.parquet and
success.svg. The exit code is 3 if the two folders do not hold the same trials.

With --observed, the sheet of a card (`standfast card`) is compared with what
the card predicts: whether the hardware agrees with it, stands worse or better,
or whether that cannot be told from so few pushes. The card is looked for
beside the sheet, or in CARD_FOLDER."
)]
pub struct CompareArgs {
    /// A result folder of `run`; with --observed, the folder of the card
    #[arg(required_unless_present = "observed")]
    pub dir_a: Option<PathBuf>,
    /// Another result folder, of a campaign with the same pushes
    #[arg(required_unless_present = "observed", conflicts_with = "observed")]
    pub dir_b: Option<PathBuf>,
    /// Sheet of a card, with what was observed on hardware
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["out", "gate", "full"])]
    pub observed: Option<PathBuf>,
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
    if let Some(sheet) = &args.observed {
        let folder = args.dir_a.as_deref().unwrap_or(folder_of(sheet));
        let observed = Observed::read(sheet, folder)?;
        return print(&match args.printing.json {
            true => json(&observed),
            false => text::card::observed(&observed),
        });
    }
    let [Some(a), Some(b)] = [&args.dir_a, &args.dir_b] else {
        unreachable!("both are required");
    };
    if let Some(out) = args.out.as_deref() {
        check_out(out)?;
    }
    let [a, b] = [Folder::existing(a)?, Folder::existing(b)?];
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
