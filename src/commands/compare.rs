//! `standfast compare`: compares two finished campaigns with the same pushes, trial by trial.

use super::arguments::{MOST_EXTRAS, count};
use super::interrupt::{STOP, stop_on_ctrl_c};
use super::progress::Progress;
use super::result::{Printing, exit_code, say_failed_gates};
use super::terminal::{note, print, warn};
use standfast_core::error::{Error, Result};
use standfast_report::result;
use standfast_study::Folder;
use standfast_study::partings::Partings;

use standfast_study::verdict::compare::Comparison;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Controllers of the same name are compared with each other, and called by their
folders, as in `catch (DIR_A)`. If the two results share no name, every
controller of one is compared with every controller of the other. The exit code
is 3 if the two folders do not hold the same trials.

Results that differ in the physics engine alone are compared engine by engine:
how far the two agree trial by trial, where they part company, and which
verdicts hold in one engine only. Controllers are then called by the engine, as in
`catch (mujoco)`. To find where, trials are simulated again: a controller that is
a program is started out of the result's folder. If this machine has not made its
files, you are asked first; where there is no terminal, --run-inputs allows it,
and --traces 0 does without."
)]
pub struct CompareArgs {
    /// A result folder of `run`
    pub dir_a: PathBuf,
    /// Another result folder, of a campaign with the same pushes
    pub dir_b: PathBuf,
    /// Write report.html, summary.md, summary.json, junit.xml, trials.parquet and success.svg to this folder
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What the result must show, as for `run`; a controller of both results is named with its folder, as in
    /// 'catch (new) >= catch (old) - 0.01'
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    #[command(flatten)]
    pub traces: TracesArgs,
    #[command(flatten)]
    pub printing: Printing,
}

#[derive(Debug, clap::Args)]
pub struct TracesArgs {
    /// Where two engines disagree on a trial, simulate it again in both, to find the moment at which they part: the first
    /// N such trials of each controller
    #[arg(long, value_name = "N", default_value_t = TracesArgs::default().traces, value_parser = count::<usize>(0..=MOST_EXTRAS))]
    pub traces: usize,
}

impl Default for TracesArgs {
    fn default() -> Self {
        Self { traces: 10 }
    }
}

pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(out) = args.out.as_deref() {
        check_out(out)?;
    }
    let [a, b] = [
        Folder::existing(&args.dir_a)?,
        Folder::existing(&args.dir_b)?,
    ];
    stop_on_ctrl_c();
    let comparison = compared([&a, &b], &args.gate, &args.traces)?;
    print(&args.printing.of(&comparison.summary, Path::new("")))?;
    if let Some(out) = &args.out {
        write(&comparison, out)?;
    }
    say_failed_gates(&comparison.summary, Path::new(""));
    Ok(exit_code(&[comparison.summary]))
}

/// Fails if a comparison may not be written to this folder.
pub fn check_out(out: &Path) -> Result<()> {
    if result::may_be_written_to(out) {
        return Ok(());
    }
    let problem = "holds other files than those of a comparison; give a new or empty folder";
    Err(Error::Parts {
        path: out.into(),
        problem: problem.into(),
    })
}

/// Sets two results beside each other; of two engines it also finds where their traces part.
pub fn compared([a, b]: [&Folder; 2], gates: &[String], args: &TracesArgs) -> Result<Comparison> {
    let mut comparison = Comparison::new(a, b, gates)?;
    let Some(agreement) = &mut comparison.summary.agreement else {
        return Ok(comparison);
    };
    if args.traces == 0 || agreement.sets.iter().all(|set| set.parted.is_empty()) {
        return Ok(comparison);
    }
    if a.is_of_another_build() || b.is_of_another_build() {
        warn(
            "",
            "A result was made by another build of standfast, with which its trials may have run otherwise than now.",
        );
    }
    match Partings::new([a, b], agreement, args.traces) {
        Ok(partings) => {
            let progress = Progress::of_episodes(2 * partings.count(), 0, false);
            let run = partings.run(&STOP, &|| {
                progress.episode();
                progress.episode();
            });
            progress.finish();
            run?;
        }
        // The comparison is complete without the times at which the traces part.
        Err(error) => warn(
            "",
            &format!("Where the traces of the two engines part was not looked for: {error}"),
        ),
    }
    Ok(comparison)
}

/// Writes the files of a comparison, and says which.
pub fn write(comparison: &Comparison, out: &Path) -> Result<()> {
    result::write(&comparison.write(out)?, &comparison.rows, out)?;
    note(&result::written(out, &["summary.json", "trials.parquet"]));
    Ok(())
}
