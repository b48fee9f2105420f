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
  standfast limit                                   all gain sets, 16 headings, the standard campaign
  standfast limit --gains hold --gains paper --headings 8 --out limits
  standfast limit --campaign nominal                without noise and variations: no impulse is tried twice
  standfast limit --gains hold --headings 4 --precision 0.3 --plot limit.svg             a quick look

For each gain set and heading an adaptive search (Bayesian, least expected entropy) finds the impulse of 50 % recovery,
with a 95 % interval; of the campaign everything is used but the impulse and heading of its first push. Pendulum
bounds hold for the mean duration of that push; where it acts above the COM (on the mean), also bound / (1 + height /
COM height). The robot's settings need a table `reach`. Headings count from 0 (pushed forward), 90 is to the left.

The 50 % and 90 % are of what is not left to chance: 2 % of the trials are taken to be lost, and won, by accident.
Without noise and variations there is no 90 %, and the interval is a bracket: recovered below, lost above.
The trials of a search are not those of `run`: they cannot be replayed by number.

An interrupted run of limit does not go on where it stopped: it starts again.")]
pub struct LimitArgs {
    /// A campaign that is compiled in (smoke, nominal, standard, harsh) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "standard")]
    pub campaign: String,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Count of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub headings: usize,
    /// A search ends when the 95 % interval of its impulse is no wider than +- this (N s) ...
    #[arg(long, value_name = "N_S", default_value_t = 0.1, allow_negative_numbers = true)]
    pub precision: f64,
    /// ... or after so many trials (then it is marked)
    #[arg(long, value_name = "N", default_value_t = 150)]
    pub max_trials: u64,
    /// Threads; 0: one per core. The result is the same for any
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Write limit.json and limit.svg to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw limits and bounds around the robot
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub check: CheckArgs,
    /// One JSON object on stdout
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
