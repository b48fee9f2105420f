//! `standfast limit`: the largest recoverable impulse by heading, beside what the pendulum allows.

use super::arguments::{ChangeArgs, CheckArgs, check_output, fine};
use super::interrupt::{STOP, stop_on_ctrl_c};
use super::progress::Progress;
use super::terminal::{note, print};
use crate::campaign::Campaign;
use crate::campaign::limit::{LimitOptions, Limits, Searches};
use crate::error::{Error, Result};
use crate::files::write_atomic;
use crate::render::{self, figure, text};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast limit                                   all gain sets and 16 headings, with the standard campaign
  standfast limit --gains hold --gains paper --headings 8 --out limits
  standfast limit --campaign nominal                without noise and variations, where no impulse is tried twice
  standfast limit --gains hold --headings 4 --precision 0.3 --plot limit.svg             a quick look

For each gain set and heading, an adaptive search (Bayesian, by least expected entropy) finds the impulse of 50 %
recovery with a 95 % interval. The search uses everything of the campaign but the impulse and heading of its first push.
A heading of 0 degrees pushes forward, and one of 90 to the left. The bounds of the pendulum are for the mean duration
of the push. If the push acts above the COM on average, a second line has the bound / (1 + height / COM height). The
robot's settings need a table `reach`.

The search assumes that 2 % of the trials are lost, and 2 % won, by accident, and 50 % and 90 % are shares of the others.
Without noise and variations there is no 90 %, and the interval is a bracket: every push below it is recovered from, and
every push above it is lost. The trials of a search are not those of `run`, and cannot be replayed by their number.

A run of limit that was interrupted starts again from the beginning.")]
pub struct LimitArgs {
    /// A campaign that is compiled in (smoke, nominal, standard, harsh) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "standard")]
    pub campaign: String,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Count of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub headings: usize,
    /// A search ends when the 95 % interval of its impulse is no wider than +- this (N s)
    #[arg(long, value_name = "N_S", default_value_t = 0.1, allow_negative_numbers = true)]
    pub precision: f64,
    /// A search ends after so many trials at the latest, and its result is marked then
    #[arg(long, value_name = "N", default_value_t = 150)]
    pub max_trials: u64,
    /// Count of threads, or 0 for one on each core. The result is the same for any count
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Write limit.json and limit.svg to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw limits and bounds around the robot to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Nothing of an interrupted run is kept.
pub fn run(args: &LimitArgs) -> Result<ExitCode> {
    args.check_outputs()?;
    let campaign = Campaign::load(&args.campaign, &args.change.overrides())?;
    let options = LimitOptions {
        headings: args.headings,
        precision_n_s: args.precision,
        max_trials: args.max_trials,
        threads: args.threads,
    };
    stop_on_ctrl_c();
    let searches = Searches::new(&campaign, options)?;
    if args.check.check {
        return fine(&format!("campaign {}, {} searches to run", campaign.name, searches.count()));
    }
    let progress = Progress::of(searches.count(), "searches");
    let limits = searches.run(&STOP, &|| progress.episode(), &|| progress.tick());
    progress.finish();
    if let Err(Error::Interrupted) = limits {
        note("interrupted: nothing of it is kept; the same command starts again");
    }
    let limits = limits?;
    // First what the user waited for: a folder that cannot be written must not cost it.
    print(&if args.json { render::json(&limits) } else { text::limit(&limits) })?;
    args.write(&limits)?;
    Ok(ExitCode::SUCCESS)
}

impl LimitArgs {
    /// Errors: a file that could not be written in the end, or a folder that has a result already.
    fn check_outputs(&self) -> Result<()> {
        if let Some(path) = &self.plot {
            check_output("--plot", path, &["svg"])?;
        }
        if let Some(folder) = &self.out {
            let fail =
                |problem| Err(Error::value("arguments", "--out", folder.display(), problem, "a new or empty folder"));
            if folder.exists() && !folder.is_dir() {
                return fail("it is a file");
            }
            if ["limit.json", "limit.svg"].iter().any(|name| folder.join(name).exists()) {
                return fail("it holds a result");
            }
        }
        Ok(())
    }

    /// Writes what was asked for, each file whole, and says what.
    fn write(&self, limits: &Limits) -> Result<()> {
        let written = |path: &PathBuf| note(&format!("written: {}", path.display()));
        if let Some(folder) = &self.out {
            let (json, svg) = (folder.join("limit.json"), folder.join("limit.svg"));
            write_atomic(&json, render::json(limits).as_bytes())?;
            figure::limit::write(&svg, limits)?;
            [json, svg].iter().for_each(written);
        }
        if let Some(path) = &self.plot {
            figure::limit::write(path, limits)?;
            written(path);
        }
        Ok(())
    }
}
