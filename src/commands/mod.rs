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
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each of four
gain sets. What a command computes goes to the standard output, and everything
else to the standard error. The paper is that of K. Yamamoto and Y. Nakamura on
switching control and quick stepping with maximal CPI sets (constraint
positively invariant sets).

Exit codes: 0 done, 1 error, 2 wrong input, 3 a result that is missing,
incomplete or does not belong here, 100 a gate failed, 130 interrupted"
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
    /// Compare two finished campaigns of the same pushes, trial by trial
    Compare(compare::CompareArgs),
    /// Say which trials of a campaign are still missing (exit code 3 if any are)
    Status(status::StatusArgs),
    /// Simulate one push and tell what happened and why
    Push(push::PushArgs),
    /// Simulate a trial of a result again and write a page that shows it in 3D
    Replay(replay::ReplayArgs),
    /// Find the largest recoverable impulse by heading, and what a pendulum allows
    Limit(limit::LimitArgs),
    /// Simulate a disturbance that has a name; without one, list the names
    Scenario(scenario::ScenarioArgs),
    /// Draw the paper's figures from simulations and check what the paper states
    Paper(paper::PaperArgs),
    /// Compute the maximal CPI sets of a gain set, their sizes and their inclusion
    Cpi(cpi::CpiArgs),
    /// Measure how well the ZMP follows the commanded one: gain, phase, bandwidth
    Response(response::ResponseArgs),
    /// Show a robot as it was read, and its kinematics at given joint angles
    Model(model::ModelArgs),
    /// Show the robot in a 3D window: live, to be pushed, or in a trial of a result
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
