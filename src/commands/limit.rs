//! `standfast limit`: searches the largest impulse that each controller recovers from, by heading, and prints it beside
//! the pendulum bounds.

use super::arguments::{
    CampaignArgs, ChangeArgs, DryRunArgs, PendulumArgs, check_output, count, fine, number,
};
use super::batch::{BatchArgs, write_once};
use super::episode::{Origin, OutputArgs, command_line, film, write_replay};
use super::interrupt::stop_on_ctrl_c;
use super::progress::duration;
use super::terminal::{note, print};
use standfast_core::error::Result;
use standfast_report::{figure, text};
use standfast_sim::episode::EpisodeRun;
use standfast_study::Campaign;
use standfast_study::batch::Batch;
use standfast_study::limit::{
    LimitOptions, Limits, MOST_HEADINGS, MOST_REPLICAS, MOST_TRIALS, Searches,
};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(mut_arg("first", |arg| arg.default_value("standard")))]
#[command(after_help = "Examples:
  standfast limit               the standard campaign: 4 controllers, 16 headings
  standfast limit --controller hold --controller paper --headings 8 -o limits
  standfast limit --campaign nominal            without noise and variations
  standfast limit --controller catch@rapier --controller catch@mujoco
  standfast limit --controller hold --headings 4 --precision 0.3   a quick look
  standfast limit --campaign nominal --pendulum 3kg,1.75m    as D in metres
  standfast limit --campaign nominal --dense --out maps   every push, as a map

For each controller and heading, an adaptive search (Bayesian, by least expected
entropy) finds the impulse from which the robot recovers in 50 % of trials, and
its 95 % interval. The trials are as in the campaign, but for impulse and
heading of the first push. A heading of 0 degrees pushes forward, one of 90
degrees to the left.

Beside the limits stand the pendulum bounds with no footstep (none), with one
(one), and with any number that reach as far and land as early as those of
`catch` can (early), for the mean duration of the push. If the push acts above
the COM on average, a second line has the bounds divided by 1 + height / COM
height. The bounds need the regions `[[reach]]` in the robot's settings.

The search assumes that 2 % of the trials are lost, and 2 % are won, whatever
the impulse; 50 % and 90 % refer to the other trials. With controllers that take
footsteps, outcomes change within a degree, so the pushes of a search differ in
heading (by up to 11.25 degrees, or half of what two headings are apart) and in
start. With others, and without noise and variations, there is no 90 %, and the
interval is a bracket: every push below it is recovered from, and every push
above it is lost. The trials of a search are not those of `run`: `push` takes
their numbers by --trial, as the printed commands do. A search ends when the
95 % interval of its impulse is no wider than +- the precision (0.1 N s for
ut-mu2), or is marked if --trials do not suffice; --replicas are the pushes at
each step of the search for the first loss, and 0 leaves it out: the nominal
campaign then takes a sixth of the pushes.

Each search that is finished is kept in the folder of --out: the same command
goes on after an interruption, and shards on several machines can share it.")]
#[command(mut_arg("out", |arg| arg.help("Folder [default: standfast-results/limit-NAME]")))]
pub struct LimitArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    #[command(flatten)]
    pub pendulum: PendulumArgs,
    /// Number of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = count::<usize>(1..=MOST_HEADINGS as u64))]
    pub headings: usize,
    /// Precision (N s) [default: 0.0463 sole impulses]
    #[arg(long, value_name = "N_S", allow_negative_numbers = true, value_parser = number)]
    pub precision: Option<f64>,
    /// Most trials of a search
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub trials: u64,
    /// Pushes at each step of the search for the first loss; 0 leaves it out
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = count::<u64>(0..=MOST_REPLICAS))]
    pub replicas: u64,
    /// Try every impulse, in steps of the precision, and draw map.svg
    #[arg(long)]
    pub dense: bool,
    /// Draw limits and bounds around the robot
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    #[command(flatten)]
    pub batch: BatchArgs,
}

/// Searches the limits, prints them and writes them.
pub fn run(args: &LimitArgs) -> Result<ExitCode> {
    let name = args.campaign.or_standard();
    let mut overrides = args.change.overrides();
    overrides.set.extend(args.pendulum.change(None));
    let robot_files = Campaign::robot_files(name, &overrides)?;
    let campaign = Campaign::load_for(&robot_files.robot()?, name, &overrides)?;
    if let Some(path) = &args.plot {
        check_output("--plot", path, &["svg"])?;
    }
    let options = LimitOptions {
        headings: args.headings,
        precision_n_s: args.precision,
        max_trials: args.trials,
        replicas: args.replicas,
        is_dense: args.dense,
        threads: args.batch.threads,
        untried: args.untried,
    };
    stop_on_ctrl_c();
    let searches = Searches::new(&campaign, robot_files, options)?;
    let (task, jobs) = (searches.task(), &searches.jobs);
    let folder = task.folder(args.batch.out.as_deref())?;
    if args.dry_run.dry_run {
        return args.say_what_is_to_run(&searches, &folder);
    }
    let prepare = || searches.controllers().map(drop);
    let run = |batch: &Batch| searches.run(batch);
    let Some(limits) = args
        .batch
        .search(&task, &folder, jobs, "searches", prepare, run)?
    else {
        return Ok(ExitCode::SUCCESS);
    };
    // The result is printed before it is written, so that it is not lost if it cannot be written.
    let as_json = standfast_report::json(&limits);
    print(&if args.batch.json {
        as_json.clone()
    } else {
        let changes = args.change.settings.options() + &args.pendulum.option();
        text::limits(&limits, &changes)
    })?;
    if let Some(plot) = &args.plot {
        figure::limit::write(plot, &limits)?;
        note(&format!("written: {}", plot.display()));
    }
    // The JSON comes last: where it is, all is.
    let result = folder.join("limit.json");
    if !result.exists() {
        if args.dense {
            write_map(&folder, &campaign, &searches, &limits)?;
        }
        let picture = folder.join("limit.svg");
        figure::limit::write(&picture, &limits)?;
        note(&format!("written: {}", picture.display()));
    }
    write_once(&result, as_json.as_bytes())?;
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
        let Some((robot, factory, config)) = searches.case(&limit.name)? else {
            continue;
        };
        let disturbance = hole.disturbance(campaign, heading_deg);
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
    /// Says for --dry-run how many searches there are to run, and how long they take.
    fn say_what_is_to_run(&self, searches: &Searches, folder: &Path) -> Result<ExitCode> {
        let count = searches.jobs.lacking(folder, self.batch.shard).len();
        let word = if count == 1 { "search" } else { "searches" };
        let takes = match count {
            0 => String::new(),
            _ => format!(
                "; that takes some {} on this machine",
                duration(searches.estimated_s(count)?)
            ),
        };
        fine(&format!(
            "campaign {}: {count} {word} to run{takes}",
            searches.task().manifest.campaign.name
        ))
    }
}
