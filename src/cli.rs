//! The command line, as data.

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use standfast::campaign::Shard;
use standfast::report::{self, ChangeArgs};
use std::path::PathBuf;

/// How hard can a humanoid be pushed before it falls, and which gain set makes it stand better?
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each gain set.
What a command computes goes to the standard output, all else to the standard error.

Exit codes: 0 done, 1 error, 2 wrong input, 3 incomplete or foreign parts, 130 interrupted"
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a campaign: random pushes, the same for every gain set, and count who stays up
    Run(RunArgs),
    /// Join the parts of a campaign that was run in shards
    Merge(FolderArgs),
    /// Say what is missing in the folder of a campaign (exit code 3 if anything is)
    Status(FolderArgs),
    /// One push: what happened and why, a picture of it, and a trace
    Push(report::push::PushArgs),
    /// Largest recoverable impulse by heading, beside what the pendulum allows without a step, with one, with any number
    Limit(report::limit::LimitArgs),
    /// A disturbance with a name, those of the paper first; without a name, what there is
    Scenario(report::scenario::ScenarioArgs),
    /// The maximal CPI sets of a gain set: size, inclusion, horizon, picture, export
    Cpi(report::cpi::CpiArgs),
    /// How well the ZMP follows the one wanted: gain, phase and bandwidth against the poles
    Response(report::response::ResponseArgs),
    /// What was understood of a robot; kinematics at given joint angles
    Model(report::model::Args),
    /// Print a completion script for a shell
    Completions { shell: Shell },
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  standfast run                                    the standard campaign, all cores
  standfast run smoke                              a small one, seconds
  standfast run my.toml --trials 200 --gains switching --gains my-gains.toml
  standfast run --set push.impulse_n_s=2.5 --set 'push.heading_deg={uniform=[-45, 45]}'
  standfast run --vary paper:stepping.alpha=2,5,15,60   a sweep
  standfast run --vary 'fixed:gains.0.x=[0.15, 1, 5],[1, 1, 5]' --gains fixed
  standfast run --shard 1/4 --out results          a quarter of it, on this machine
  standfast merge results                          ... joined when all four are there

Interrupted, the same command goes on where it stopped.")]
pub struct RunArgs {
    /// A campaign that is compiled in (smoke, nominal, standard, harsh) or a TOML file
    #[arg(default_value = "standard")]
    pub campaign: String,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Count of pushes
    #[arg(long, value_name = "N")]
    pub trials: Option<u64>,
    /// Threads; 0: one per core. The result is the same for any
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Run only share k of n (1/n to n/n) and leave parts for `merge`
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Result folder [default: standfast-results/NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl Default for RunArgs {
    fn default() -> Self {
        Self {
            campaign: "standard".into(),
            change: ChangeArgs::default(),
            trials: None,
            threads: 0,
            shard: None,
            out: None,
            json: false,
        }
    }
}

#[derive(Debug, Args)]
pub struct FolderArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}
