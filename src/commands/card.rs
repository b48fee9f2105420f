//! `standfast card`: one page about a robot with a controller to hang up in a lab, with pushes to try on hardware.

use super::arguments::{DryRunArgs, MOST_THREADS, PendulumArgs, SettingArgs, count, fine, number};
use super::batch::{BatchArgs, write_once};
use super::interrupt::stop_on_ctrl_c;
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_report::{card_page, text};
use standfast_stats::sheet::MOST_PUSHES;
use standfast_study::batch::Batch;
use standfast_study::card::observed::sheet;
use standfast_study::card::{self, CARD, CardOptions, CardSearch, MOST_TRIALS, OBSERVED};
use standfast_study::limit::MOST_HEADINGS;
use standfast_study::{Campaign, Overrides};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast card                          UT-mu2 with catch, ten minutes
  standfast card g1.urdf --controller mine.toml -o lab
  standfast card ut-mu2 --controller hold --trials 40       a quick look
  standfast card --pendulum 1kg,1.75m     strikes by a bob on a rope, as D in metres
  standfast compare --observed lab/observed.csv             after the experiment

The folder of --out gets card.html, which prints on A4, card.json, and
observed.csv, the sheet to fill in. The page says what the robot takes by
heading, what of friction, motors, delay, load, ground and height of the push
costs most, how it is lost, and which pushes to try on hardware first, with
their predicted chances.

Robots and grounds vary as in the campaign standard; what costs most is asked
with the ranges of harsh, one at a time, by pushes near the limits. What is
finished is kept: the same command goes on after an interruption.")]
pub struct CardArgs {
    /// Robot by name, or URDF or MJCF file
    #[arg(value_name = "ROBOT", default_value = "ut-mu2")]
    pub robot: String,
    /// Controller by name or file
    #[arg(long, value_name = "NAME|FILE", default_value = "catch")]
    pub controller: String,
    #[command(flatten)]
    pub settings: SettingArgs,
    #[command(flatten)]
    pub pendulum: PendulumArgs,
    /// Number of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = count::<usize>(1..=MOST_HEADINGS as u64))]
    pub headings: usize,
    /// Precision of the limits (N s) [default: 0.0463 sole impulses]
    #[arg(long, value_name = "N_S", allow_negative_numbers = true, value_parser = number)]
    pub precision: Option<f64>,
    /// Trials for each difference, and the most for a limit
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub trials: u64,
    /// Pushes to try on hardware
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = count::<usize>(1..=MOST_PUSHES as u64))]
    pub tries: usize,
    /// Simulated robots by which the chances are predicted
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub replicas: u64,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    /// Number of threads, or 0 for one on each core
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = count::<usize>(0..=MOST_THREADS))]
    pub threads: usize,
    /// Folder for the result [default: standfast-results/card-standard]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// Makes the card, prints its text and writes it.
pub fn run(args: &CardArgs) -> Result<ExitCode> {
    let mut overrides = Overrides {
        robot: Some(args.robot.clone()),
        controllers: vec![args.controller.clone()],
        ..args.settings.overrides()
    };
    overrides.set.extend(args.pendulum.change(None));
    let files = Campaign::robot_files("standard", &overrides)?;
    let campaign = card::campaign(&files.robot()?, &overrides)?;
    let [campaign] = &campaign.of_each_entrant()[..] else {
        return Err(Error::option(
            "--engine",
            "both",
            "a card is of one engine",
            "rapier or mujoco",
        ));
    };
    stop_on_ctrl_c();
    let options = CardOptions {
        headings: args.headings,
        precision_n_s: args.precision,
        trials: args.trials,
        replicas: args.replicas,
        pushes: args.tries,
        threads: args.threads,
        untried: args.untried,
    };
    let search = CardSearch::new(campaign, files, options)?;
    let task = search.task();
    let folder = task.folder(args.out.as_deref())?;
    if args.dry_run.dry_run {
        search.prepare()?;
        return fine(&format!(
            "limits at {} headings, {} trials for each difference, {} replicas of {} pushes",
            args.headings, args.trials, args.replicas, args.tries
        ));
    }
    let batch = BatchArgs {
        threads: args.threads,
        shard: None,
        out: args.out.clone(),
        json: args.json,
    };
    let prepare = || search.prepare();
    let limits = |at: &Batch| search.limits(at);
    let Some(limits) = batch.search(
        &task,
        &folder,
        &search.limit_jobs,
        "searches",
        prepare,
        limits,
    )?
    else {
        return Ok(ExitCode::SUCCESS);
    };
    let trials = |at: &Batch| search.trials(&limits, at);
    let Some(trials) = batch.search(
        &task,
        &folder,
        &search.trial_jobs,
        "trials",
        prepare,
        trials,
    )?
    else {
        return Ok(ExitCode::SUCCESS);
    };
    let replicas = |at: &Batch| search.replicas(&limits, at);
    let Some(replicas) = batch.search(
        &task,
        &folder,
        &search.push_jobs,
        "predictions",
        prepare,
        replicas,
    )?
    else {
        return Ok(ExitCode::SUCCESS);
    };
    let card = search.card(limits, &trials, &replicas)?;
    let as_json = standfast_report::json(&card);
    print(&if args.json {
        as_json.clone()
    } else {
        text::card::card(&card, &folder)
    })?;
    let page = card_page::page(&card, &folder)?;
    write_once(&folder.join("card.html"), page.as_bytes())?;
    let observed = folder.join(OBSERVED);
    if observed.exists() {
        note(&format!("left as it is: {}", observed.display()));
    } else {
        write_once(&observed, sheet(&card.pushes).as_bytes())?;
    }
    write_once(&folder.join(CARD), as_json.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
