//! The program: a file for each command, which holds its arguments and what it does, in the order in which it happens.
//!
//! What several commands need stands beside them: arguments (`arguments`), what is said and where (`terminal`,
//! `progress`), Ctrl-C (`interrupt`), how a campaign ends (`result`) and how one episode is told (`episode`).

mod arguments;
mod compare;
mod completions;
mod cpi;
mod episode;
mod interrupt;
mod limit;
mod merge;
mod model;
mod paper;
pub mod progress;
mod push;
mod replay;
mod response;
mod result;
mod run;
mod scenario;
mod status;
mod terminal;
mod view;

pub use terminal::note;

use crate::error::Result;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// How hard can a humanoid be pushed before it falls, and which gain set makes it stand better?
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each of four gain sets.
What a command computes goes to the standard output, and everything else to the standard error.

Exit codes: 0 done, 1 error, 2 wrong input, 3 incomplete or foreign parts, 100 a gate failed, 130 interrupted"
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Chosen>,
}

#[derive(Debug, Subcommand)]
enum Chosen {
    /// Run a campaign: random pushes, the same for every gain set, and count who stays up
    Run(run::RunArgs),
    /// Join the parts of a campaign that was run in shards
    Merge(merge::MergeArgs),
    /// Two finished campaigns with the same pushes, paired trial by trial
    Compare(compare::CompareArgs),
    /// Say what is missing in the folder of a campaign (exit code 3 if anything is)
    Status(status::StatusArgs),
    /// One push: what happened and why, a picture of it, and a trace
    Push(push::PushArgs),
    /// A trial of a campaign, as it was: a page that shows it in 3D, in any browser, offline
    Replay(replay::ReplayArgs),
    /// Largest recoverable impulse by heading, beside what the pendulum allows without a step, with one, with any number
    Limit(limit::LimitArgs),
    /// A disturbance with a name, those of the paper first; without a name, what there is
    Scenario(scenario::ScenarioArgs),
    /// The paper's figures, from its own scenarios, and what of the paper they bear out
    Paper(paper::PaperArgs),
    /// The maximal CPI sets of a gain set: size, inclusion, horizon, picture, export
    Cpi(cpi::CpiArgs),
    /// How well the ZMP follows the one wanted: gain, phase and bandwidth against the poles
    Response(response::ResponseArgs),
    /// What was understood of a robot; kinematics at given joint angles
    Model(model::ModelArgs),
    /// The robot in a 3D window: live, to be pushed and pulled, or a trial of a result
    View(view::ViewArgs),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
}

/// Runs the command that the program was called with. A command line that cannot be read ends the program here, with what
/// is wrong and exit code 2.
pub fn run() -> Result<ExitCode> {
    match Cli::parse().command.unwrap_or_else(|| Chosen::Run(run::RunArgs::standard())) {
        Chosen::Run(args) => run::run(&args),
        Chosen::Merge(args) => merge::run(&args),
        Chosen::Compare(args) => compare::run(&args),
        Chosen::Status(args) => status::run(&args),
        Chosen::Push(args) => push::run(&args),
        Chosen::Replay(args) => replay::run(&args),
        Chosen::Limit(args) => limit::run(&args),
        Chosen::Scenario(args) => scenario::run(&args),
        Chosen::Paper(args) => paper::run(&args),
        Chosen::Cpi(args) => cpi::run(&args),
        Chosen::Response(args) => response::run(&args),
        Chosen::Model(args) => model::run(&args),
        Chosen::View(args) => view::run(args),
        Chosen::Completions(args) => completions::run(&args, Cli::command()),
    }
}
