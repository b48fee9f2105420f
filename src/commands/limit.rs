//! `standfast limit`: searches the largest impulse that each controller recovers from, by heading, and prints it beside
//! the pendulum bounds.

use super::arguments::{
    CampaignArgs, ChangeArgs, CheckArgs, MOST_THREADS, check_new_result, check_output, count, fine,
    number,
};
use super::episode::{Origin, OutputArgs, command_line, film, write_replay};
use super::interrupt::{STOP, nothing_kept, stop_on_ctrl_c};
use super::progress::{Progress, duration};
use super::terminal::{note, print};
use standfast_core::error::Result;
use standfast_files::write_atomic;
use standfast_report::{figure, text};
use standfast_sim::episode::EpisodeRun;
use standfast_study::Campaign;
use standfast_study::limit::{
    LimitOptions, Limits, MOST_HEADINGS, MOST_REPLICAS, MOST_TRIALS, Searches, pushed,
};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(mut_arg("first", |arg| arg.default_value("standard")))]
#[command(after_help = "Examples:
  standfast limit                                   all controllers and 16 headings, with the standard campaign
  standfast limit --controller hold --controller paper --headings 8 -o limits
  standfast limit --campaign nominal                without noise and variations
  standfast limit --controller catch@rapier --controller catch@mujoco    in two physics engines
  standfast limit --controller hold --headings 4 --precision 0.3    a quick look
  standfast limit --campaign nominal --dense --out maps             every push, as a map

For each controller and heading, an adaptive search (Bayesian, by least expected
entropy) finds the impulse from which the robot recovers in 50 % of trials, and
its 95 % interval. The trials are as in the campaign, but for impulse and
heading of the first push. A heading of 0 degrees pushes forward, one of 90
degrees to the left.

Beside it stand the pendulum bounds with no footstep, one, or any
number, for the mean duration of the push. If the push acts above the COM on
average, a second line has the bounds divided by 1 + height / COM height. The
bounds need the regions `[[reach]]` in the robot's settings.

The search assumes that 2 % of the trials are lost, and 2 % are won, whatever
the impulse; 50 % and 90 % refer to the other trials. Without noise and
variations there is no 90 %, and the interval is a bracket: every push below it
is recovered from, and every push above it is lost. The trials of a search are
not those of `run`: `push` takes their numbers by --limit-trial, as the printed
commands do.

A run of limit that was interrupted starts again from the beginning.")]
pub struct LimitArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Number of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = count::<usize>(1..=MOST_HEADINGS as u64))]
    pub headings: usize,
    /// End a search when the 95 % interval of its impulse is no wider than +- this (N s) [default: 0.0463 sole impulses of the
    /// robot, 0.1 N s for ut-mu2]
    #[arg(long, value_name = "N_S", allow_negative_numbers = true, value_parser = number)]
    pub precision: Option<f64>,
    /// End a search after so many trials at the latest, and mark its result
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub max_trials: u64,
    /// Pushes at each step of the search for the first loss, which goes up in steps of the precision; 0 leaves it out; the
    /// nominal campaign then takes a fourteenth of the pushes
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = count::<u64>(0..=MOST_REPLICAS))]
    pub replicas: u64,
    /// Try every impulse, in steps of the precision, and with --out draw map.svg, in which a hole is seen, with a replay of
    /// each hole
    #[arg(long)]
    pub dense: bool,
    /// Number of threads, or 0 for one on each core; the result does not depend on it
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = count::<usize>(0..=MOST_THREADS))]
    pub threads: usize,
    /// Write limit.json and limit.svg to this folder
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw limits and bounds around the robot to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// Searches the limits, prints them and writes them. Nothing of an interrupted search is kept.
pub fn run(args: &LimitArgs) -> Result<ExitCode> {
    let name = args.campaign.or_standard();
    let overrides = args.change.overrides();
    let robot_files = Campaign::robot_files(name, &overrides)?;
    let campaign = Campaign::load_for(&robot_files.robot()?, name, &overrides)?;
    let files = args.files()?;
    let options = LimitOptions {
        headings: args.headings,
        precision_n_s: args.precision,
        max_trials: args.max_trials,
        replicas: args.replicas,
        is_dense: args.dense,
        threads: args.threads,
        untried: args.untried,
    };
    stop_on_ctrl_c();
    let searches = Searches::new(&campaign, robot_files, options)?;
    let count = searches.count();
    if args.check.check {
        let word = if count == 1 { "search" } else { "searches" };
        let takes = duration(searches.estimated_s()?);
        return fine(&format!(
            "campaign {}: {count} {word} to run; that takes some {takes} on this machine",
            campaign.name
        ));
    }
    let progress = Progress::of(count, "searches");
    let limits = searches.run(&STOP, &|| progress.episode(), &|| progress.tick());
    progress.finish();
    let limits = nothing_kept(limits)?;
    // The result is printed before it is written, so that it is not lost if it cannot be written.
    let as_json = standfast_report::json(&limits);
    print(&if args.json {
        as_json.clone()
    } else {
        text::limits(&limits, &args.change.settings.options())
    })?;
    for path in files {
        match path
            .extension()
            .is_some_and(|extension| extension == "json")
        {
            true => write_atomic(&path, as_json.as_bytes())?,
            false => figure::limit::write(&path, &limits)?,
        }
        note(&format!("written: {}", path.display()));
    }
    if let Some(folder) = args.out.as_ref().filter(|_| args.dense) {
        write_map(folder, &campaign, &searches, &limits)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Most holes of which a replay is written.
const MOST_REPLAYS: usize = 24;

/// Writes the map and, beside it, replays of its holes.
fn write_map(
    folder: &Path,
    campaign: &Campaign,
    searches: &Searches,
    limits: &Limits,
) -> Result<()> {
    let holes: Vec<_> = limits.holes().take(MOST_REPLAYS).collect();
    let file = |number: usize| format!("hole-{}.html", number + 1);
    for (number, &(heading_deg, limit, hole)) in holes.iter().enumerate() {
        let Some((robot, factory, config)) = searches.case(&limit.name) else {
            continue;
        };
        let disturbance = pushed(campaign, hole.trial, hole.impulse_n_s, heading_deg);
        let episode = EpisodeRun {
            robot,
            factory,
            config: &config,
        };
        let shown = film(episode, disturbance, &OutputArgs::default())?;
        let title = Some(format!("Hole {} of {}", number + 1, limit.name));
        let origin = Origin {
            title,
            command: command_line("standfast"),
            ..Origin::default()
        };
        write_replay(&shown, None, &folder.join(file(number)), origin)?;
    }
    let map = folder.join("map.svg");
    figure::limit_map::write(&map, limits, |number| {
        (number < holes.len()).then(|| file(number))
    })?;
    let replays = match holes.len() {
        0 => "no hole".into(),
        1 => "a replay of its hole".into(),
        count => format!("replays of {count} holes"),
    };
    note(&format!("written: {}, and {replays}", map.display()));
    Ok(())
}

impl LimitArgs {
    /// The files to write. Checks before any work that they can be written, and that no result would be overwritten.
    fn files(&self) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        if let Some(folder) = &self.out {
            files.extend(["limit.json", "limit.svg"].map(|name| folder.join(name)));
            let map = self.dense.then(|| folder.join("map.svg"));
            check_new_result(folder, files.iter().chain(&map))?;
        }
        if let Some(path) = &self.plot {
            check_output("--plot", path, &["svg"])?;
            files.push(path.clone());
        }
        Ok(files)
    }
}
