//! `standfast ceiling`: tries the pushes that a controller loses again, with knowledge of them, and tells which can be caught.

use super::arguments::{CampaignArgs, ChangeArgs, MOST_THREADS, up_to};
use super::interrupt::{STOP, stop_on_ctrl_c};
use super::progress::Progress;
use super::terminal::print;
use crate::assets::{self, Kind};
use crate::campaign::ceiling::{CeilingOptions, Clairvoyant};
use crate::campaign::{Campaign, Overrides};
use crate::error::Result;
use crate::lipm::GainSet;
use crate::render;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct CeilingArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Number of trials
    #[arg(long, value_name = "N")]
    pub trials: Option<u64>,
    /// Tries for a push, at most
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub tries: u64,
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = up_to(MOST_THREADS))]
    pub threads: usize,
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &CeilingArgs) -> Result<ExitCode> {
    let name = args.campaign.or_standard();
    let mut overrides = Overrides { trials: args.trials, ..args.change.overrides() };
    if overrides.gains.is_empty() {
        overrides.gains = vec!["catch".into()];
    }
    let robot_files = Campaign::robot_files(name, &overrides)?;
    let robot = robot_files.robot()?;
    let campaign = Campaign::load_for(&robot, name, &overrides)?;
    let gains = GainSet::parse(&assets::open(Kind::Controller, &campaign.gains[0])?)?;
    stop_on_ctrl_c();
    let clairvoyant =
        Clairvoyant::new(&campaign, &gains, robot_files, CeilingOptions { tries: args.tries, threads: args.threads })?;
    let progress = Progress::of(campaign.trials, "trials");
    let found = clairvoyant.run(&STOP, &|| progress.tick());
    progress.finish();
    print(&render::json(&found?))?;
    Ok(ExitCode::SUCCESS)
}
