//! `standfast ceiling`: tries again what a controller loses, with knowledge of the push, and tells what can be caught.

use super::arguments::{
    CampaignArgs, ChangeArgs, CheckArgs, MOST_THREADS, check_new_result, count, fine,
};
use super::interrupt::{STOP, nothing_kept, stop_on_ctrl_c};
use super::progress::Progress;
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_files::write_atomic;
use standfast_report::text::ceiling as text;
use standfast_study::ask::spec::MOST_TRIALS;
use standfast_study::ceiling::{CeilingOptions, CeilingSearch, MOST_TRIES};
use standfast_study::{Campaign, Overrides};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(mut_arg("first", |arg| arg.default_value("standard")))]
#[command(mut_arg("gains", |arg| arg.help("Controller by name or file, a gain set with [catching] [default: catch]")))]
#[command(after_help = "Examples:
  standfast ceiling --out ceiling                   what catch loses in the standard campaign
  standfast ceiling --campaign harsh --trials 200 --engine mujoco
  standfast ceiling --campaign nominal --trials 1 --set push.impulse_n_s=4.4

Each trial that the controller loses is tried again with other numbers for its
first four footsteps: when which foot is lifted, where and when it lands, where
the ZMP is meanwhile, and how the trunk turns and the COM sinks. CMA-ES changes
the 44 numbers until the robot recovers. So the robot knows the push, itself and
the ground; but it moves only after the push has begun, and within the torques
of its joints.

A push that is recovered from so can be caught, and the text tells by what. Of
one that is not, nothing is proven. With --out, each recovery is written as a
gain set, which push can show beside the controller.")]
pub struct CeilingArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Number of trials [default: that of the campaign]
    #[arg(long, value_name = "N", value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub trials: Option<u64>,
    /// Most tries for a push, in steps of 24
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = count::<u64>(1..=MOST_TRIES))]
    pub tries: u64,
    /// Number of threads, or 0 for one on each core; the result does not depend on it
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = count::<usize>(0..=MOST_THREADS))]
    pub threads: usize,
    /// Write ceiling.json and the recoveries (trial-N.toml) to this folder
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// The file of the result.
const RESULT: &str = "ceiling.json";

/// Tries the lost trials, prints what was found and writes it. Nothing of an interrupted search is kept.
pub fn run(args: &CeilingArgs) -> Result<ExitCode> {
    let name = args.campaign.or_standard();
    let mut overrides = Overrides {
        trials: args.trials,
        ..args.change.overrides()
    };
    if overrides.gains.is_empty() {
        overrides.gains = vec!["catch".into()];
    }
    let robot_files = Campaign::robot_files(name, &overrides)?;
    let campaign = Campaign::load_for(&robot_files.robot()?, name, &overrides)?;
    let [campaign] = &campaign.of_each_entrant()[..] else {
        return Err(Error::option(
            "--controller",
            campaign.gains.join(", "),
            "is more than one entrant",
            "one, such as catch or catch@mujoco",
        ));
    };
    if let Some(folder) = &args.out {
        check_new_result(folder, [&folder.join(RESULT)])?;
    }
    stop_on_ctrl_c();
    let options = CeilingOptions {
        tries: args.tries,
        threads: args.threads,
        untried: args.untried,
    };
    let clairvoyant = CeilingSearch::new(campaign, robot_files, options)?;
    if args.check.check {
        let most = format!(
            "up to {} tries for each of {} trials",
            args.tries, campaign.trials
        );
        return fine(&format!(
            "campaign {}: {most}, if it is lost",
            campaign.name
        ));
    }
    let progress = Progress::of(campaign.trials, "trials");
    let ceiling = clairvoyant.run(&STOP, &|| progress.episode(), &|| progress.tick());
    progress.finish();
    let ceiling = nothing_kept(ceiling)?;
    let as_json = standfast_report::json(&ceiling);
    // The campaign's file may state fewer trials.
    let trials = args.trials.map(|trials| format!(" --set trials={trials}"));
    let changes = args.change.settings.options() + &trials.unwrap_or_default();
    print(&if args.json {
        as_json.clone()
    } else {
        text::text(&ceiling, args.out.as_deref(), &changes)
    })?;
    if let Some(folder) = &args.out {
        for lost in &ceiling.lost {
            let Some(recovery) = &lost.found else {
                continue;
            };
            let gains = toml::to_string(&clairvoyant.gains(lost.trial, recovery))
                .expect("a gain set is a table");
            write_atomic(&folder.join(text::file(lost.trial)), gains.as_bytes())?;
        }
        write_atomic(&folder.join(RESULT), as_json.as_bytes())?;
        note(&format!("written: {}", folder.join(RESULT).display()));
    }
    Ok(ExitCode::SUCCESS)
}
