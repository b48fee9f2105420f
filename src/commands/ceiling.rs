//! `standfast ceiling`: tries again what a controller loses, with knowledge of the push, and tells what can be caught.

use super::arguments::{CampaignArgs, ChangeArgs, DryRunArgs, count, fine};
use super::batch::{BatchArgs, write_once};
use super::interrupt::stop_on_ctrl_c;
use super::terminal::print;
use standfast_core::error::{Error, Result};
use standfast_report::text::ceiling as text;
use standfast_study::ask::spec::MOST_TRIALS;
use standfast_study::batch::Batch;
use standfast_study::ceiling::{CeilingOptions, CeilingSearch, MOST_TRIES};
use standfast_study::{Campaign, Overrides};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(mut_arg("first", |arg| arg.default_value("standard")))]
#[command(mut_arg("gains", |arg| arg.help("A gain set with [catching] [default: catch]")))]
#[command(after_help = "Examples:
  standfast ceiling --out ceiling      what catch loses in the standard campaign
  standfast ceiling --campaign harsh --trials 200 --engine mujoco
  standfast ceiling --campaign nominal --trials 1 --set push.impulse_n_s=4.4

Each trial that the controller loses is tried again with other numbers for its
first four footsteps: when which foot is lifted, where and when it lands, where
the ZMP is meanwhile, and how the trunk turns and the COM sinks. CMA-ES changes
the 44 numbers until the robot recovers from the push and from six of eight
neighbours (3 % weaker or harder, 10 ms earlier or later, with other noise), so
that a recovery is no luck. The robot knows the push, itself and the ground; but
it moves only after the push has begun, and within the torques of its joints.

A push that is recovered from so can be caught, and the text tells by what. Of
one that is not, nothing is proven. The folder of --out gets ceiling.json, and
each recovery as a gain set (trial-N.toml), which push can show beside the
controller. It keeps each trial that is finished: the same command goes on
after an interruption, and shards on several machines can share it.")]
#[command(mut_arg("out", |arg| arg.help("Folder [default: standfast-results/ceiling-NAME]")))]
pub struct CeilingArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Number of trials
    #[arg(long, value_name = "N", value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub trials: Option<u64>,
    /// Most tries for a push
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = count::<u64>(1..=MOST_TRIES))]
    pub tries: u64,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    #[command(flatten)]
    pub batch: BatchArgs,
}

/// The file of the result.
const RESULT: &str = "ceiling.json";

/// Tries the lost trials, prints what was found and writes it.
pub fn run(args: &CeilingArgs) -> Result<ExitCode> {
    let name = args.campaign.or_standard();
    let mut overrides = Overrides {
        trials: args.trials,
        ..args.change.overrides()
    };
    if overrides.controllers.is_empty() {
        overrides.controllers = vec!["catch".into()];
    }
    let robot_files = Campaign::robot_files(name, &overrides)?;
    let campaign = Campaign::load_for(&robot_files.robot()?, name, &overrides)?;
    let [campaign] = &campaign.of_each_entrant()[..] else {
        return Err(Error::option(
            "--controller",
            campaign.controllers.join(", "),
            "is more than one entrant",
            "one, such as catch or catch@mujoco",
        ));
    };
    stop_on_ctrl_c();
    let options = CeilingOptions {
        tries: args.tries,
        threads: args.batch.threads,
        untried: args.untried,
    };
    let clairvoyant = CeilingSearch::new(campaign, robot_files, options)?;
    let (task, jobs) = (clairvoyant.task(), &clairvoyant.jobs);
    let folder = task.folder(args.batch.out.as_deref())?;
    if args.dry_run.dry_run {
        clairvoyant.controller()?;
        let most = format!(
            "up to {} tries for each of {} trials",
            args.tries, campaign.trials
        );
        return fine(&format!(
            "campaign {}: {most}, if it is lost",
            campaign.name
        ));
    }
    let prepare = || clairvoyant.controller().map(drop);
    let run = |batch: &Batch| clairvoyant.run(batch);
    let Some(ceiling) = args
        .batch
        .search(&task, &folder, jobs, "trials", prepare, run)?
    else {
        return Ok(ExitCode::SUCCESS);
    };
    let as_json = standfast_report::json(&ceiling);
    // The campaign's file may state fewer trials.
    let trials = args.trials.map(|trials| format!(" --set trials={trials}"));
    let changes = args.change.settings.options() + &trials.unwrap_or_default();
    print(&if args.batch.json {
        as_json.clone()
    } else {
        text::text(&ceiling, &folder, &changes)
    })?;
    for lost in &ceiling.lost {
        let Some(recovery) = &lost.found else {
            continue;
        };
        let gains = toml::to_string(&clairvoyant.gains(lost.trial, recovery))
            .expect("a gain set is a table");
        write_once(&folder.join(text::file(lost.trial)), gains.as_bytes())?;
    }
    write_once(&folder.join(RESULT), as_json.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
