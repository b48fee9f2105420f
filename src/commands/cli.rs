//! The command line, as data.

use crate::campaign::{Overrides, Shard};
use crate::render::{self, ChangeArgs};
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use std::path::PathBuf;

/// How hard can a humanoid be pushed before it falls, and which gain set makes it stand better?
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each gain set.
What a command computes goes to the standard output, all else to the standard error.

Exit codes: 0 done, 1 error, 2 wrong input, 3 incomplete or foreign parts, 100 a gate failed, 130 interrupted"
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
    Merge(MergeArgs),
    /// Two finished campaigns with the same pushes, paired trial by trial
    Compare(CompareArgs),
    /// Say what is missing in the folder of a campaign (exit code 3 if anything is)
    Status(FolderArgs),
    /// One push: what happened and why, a picture of it, and a trace
    Push(render::push::PushArgs),
    /// A trial of a campaign, as it was: a page that shows it in 3D, in any browser, offline
    Replay(render::replays::ReplayArgs),
    /// Largest recoverable impulse by heading, beside what the pendulum allows without a step, with one, with any number
    Limit(render::limit::LimitArgs),
    /// A disturbance with a name, those of the paper first; without a name, what there is
    Scenario(render::scenario::ScenarioArgs),
    /// The paper's figures, from its own scenarios, and what of the paper they bear out
    Paper(super::paper::PaperArgs),
    /// The maximal CPI sets of a gain set: size, inclusion, horizon, picture, export
    Cpi(render::cpi::CpiArgs),
    /// How well the ZMP follows the one wanted: gain, phase and bandwidth against the poles
    Response(render::response::ResponseArgs),
    /// What was understood of a robot; kinematics at given joint angles
    Model(render::model::Args),
    /// The robot in a 3D window: live, to be pushed and pulled, or a trial of a result
    View(crate::view::ViewArgs),
    /// Print a completion script for a shell
    Completions { shell: Shell },
}

#[derive(Debug, Default, Args)]
#[command(after_help = "Examples:
  standfast run                                    the standard campaign, all cores
  standfast run smoke                              a small one, seconds
  standfast run my.toml --trials 200 --gains switching --gains my-gains.toml
  standfast run --set push.impulse_n_s=2.5 --set 'push.heading_deg={uniform=[-45, 45]}'
  standfast run --vary paper:stepping.alpha=2,5,15,60   a sweep
  standfast run --vary 'fixed:gains.0.x=[0.15, 1, 5],[1, 1, 5]' --gains fixed
  standfast run --shard 1/4 --out results          a quarter of it, on this machine
  standfast merge results                          ... joined when all four are there
  standfast run --gains hold --gains catch --until-resolved      as few pushes as it takes
  standfast run --gate 'catch >= 0.80' --gate 'catch >= hold + 0.10'
  standfast run --gate 'catch >= baseline - 0.01' --baseline results-of-main

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
    /// Stop as soon as every gate is decided or, without gates, every pair of gain sets.
    ///
    /// It looks at the result after 25 trials, 50, 75, and so on, each time after about a quarter more. Its intervals are
    /// valid however often one looks (betting confidence sequences): of its gates, or of its pairs, all together are
    /// decided wrongly in at most 5 % of runs. It may be taken up again with more trials.
    #[arg(long)]
    pub until_resolved: bool,
    /// Two gain sets that differ by less than this share are the same, and their pair is resolved [default: 0.02]
    #[arg(long, value_name = "SHARE")]
    pub margin: Option<f64>,
    /// Most pushes with --until-resolved, in whole parts of 25 [default: those of the campaign]
    #[arg(long, value_name = "N", conflicts_with = "trials")]
    pub max_trials: Option<u64>,
    #[command(flatten)]
    pub gates: GateArgs,
    /// Threads; 0: one per core. The result is the same for any
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Run only share k of n (1/n to n/n) and leave parts for `merge`
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub replays: ReplaysArgs,
    /// Result folder [default: standfast-results/NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl RunArgs {
    /// The standard campaign as it is.
    pub fn standard() -> Self {
        Self { campaign: "standard".into(), ..Self::default() }
    }

    /// All that these change of the campaign.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            gates: self.gates.gate.clone(),
            until_resolved: self.until_resolved,
            margin: self.margin,
            ..self.change.overrides(self.max_trials.or(self.trials))
        }
    }
}

#[derive(Debug, Default, Args)]
pub struct GateArgs {
    /// What the result must show: 'A >= 0.80', 'A >= B + 0.10', 'A >= baseline - 0.01', A and B gain sets by their names
    /// in the results.
    ///
    /// May be given several times, beside the campaign's own. A gate passes if its whole 95 % interval is at least what
    /// is asked, and fails (exit code 100) if none of it is; else it is unresolved, which is no failure unless
    /// `gates.unresolved` is "fail" (`run --set gates.unresolved=fail`). `gates.confidence` changes the 95 %.
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    /// Result folder of an earlier run with the same pushes, for gates that compare with the baseline
    #[arg(long, value_name = "DIR")]
    pub baseline: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct MergeArgs {
    #[command(flatten)]
    pub folder: FolderArgs,
    #[command(flatten)]
    pub gates: GateArgs,
    #[command(flatten)]
    pub replays: ReplaysArgs,
}

#[derive(Debug, Args)]
pub struct ReplaysArgs {
    /// Pages that show telling trials in 3D, for each gain set, of those that report.html names; 0: no new ones.
    ///
    /// First the easiest push that it lost, the lost one nearest to its limit of 50 %, and the hardest that it survived (by
    /// impulse over m omega d), then the others.
    #[arg(long, value_name = "N", default_value_t = ReplaysArgs::default().replays)]
    pub replays: usize,
}

impl Default for ReplaysArgs {
    fn default() -> Self {
        Self { replays: 3 }
    }
}

#[derive(Debug, Args)]
#[command(
    after_help = "Gain sets of the same name are compared with each other (and told apart by their folders: `catch (DIR_A)`);
if the results share no name, every set of the one with every set of the other.
Exit code 3 if the folders' trials are not the same."
)]
pub struct CompareArgs {
    /// Result folder of `run`
    pub dir_a: PathBuf,
    /// Another one with the same pushes
    pub dir_b: PathBuf,
    /// Write report.html, summary.md, summary.json, junit.xml, trials.parquet and success.svg to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What the result must show, as for `run`; sets that both have are named by their folders, e.g.
    /// 'catch (new) >= catch (old) - 0.01'
    #[arg(long, value_name = "EXPR")]
    pub gate: Vec<String>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct FolderArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}
