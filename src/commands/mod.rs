//! The command line: one file for each command, with its arguments and its steps in the order in which they happen.
//!
//! Several commands share arguments (`arguments`), printing (`terminal`), the progress bar (`progress`), Ctrl-C
//! (`interrupt`), the end of a campaign (`result`), and the simulation of one episode (`episode`).

pub mod arguments;
mod compare;
mod completions;
mod cpi;
pub mod episode;
mod init;
mod interrupt;
mod limit;
mod merge;
mod model;
pub mod progress;
mod push;
mod replay;
mod result;
mod run;
mod slurm;
mod status;
pub mod terminal;
mod view;

pub use interrupt::exit_code;
pub use terminal::note;

use crate::error::Result;
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// The command line of the program.
#[derive(Debug, Parser)]
#[command(
    version,
    about = "How hard can a humanoid be pushed before it falls, and which controller makes it
stand better?",
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each of four
controllers. What a command computes goes to the standard output, and everything
else to the standard error. The paper is that of K. Yamamoto and Y. Nakamura on
switching control and quick stepping with maximal CPI sets (constraint
positively invariant sets).

Exit codes: 0 done, 1 error, 2 wrong input, 3 a result that is missing,
incomplete or does not belong here, 75 try again (terminated, disk full, folder
in use), 100 a gate failed, 130 interrupted"
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Chosen>,
}

#[derive(Debug, Subcommand)]
enum Chosen {
    /// Run a campaign, and count how often each controller recovers
    Run(run::RunArgs),
    /// Join the parts of a campaign that was run in shards
    Merge(merge::MergeArgs),
    /// Run a campaign as a job array on a Slurm cluster
    Slurm(slurm::SlurmArgs),
    /// Compare two finished campaigns of the same pushes, trial by trial
    Compare(compare::CompareArgs),
    /// Say which trials are missing (exit code 3 if any are)
    Status(status::StatusArgs),
    /// Simulate one push and tell what happened and why
    Push(push::PushArgs),
    /// Simulate a trial of a result again, and show it in 3D
    Replay(replay::ReplayArgs),
    /// Find the largest recoverable impulse by heading
    Limit(limit::LimitArgs),
    /// Compute the maximal CPI sets of a gain set
    Cpi(cpi::CpiArgs),
    /// Show a robot as it was read, and its kinematics
    Model(model::ModelArgs),
    /// Write the settings of a robot, inferred from its URDF
    Init(init::InitArgs),
    /// Show the robot, or a trial of a result, in a 3D window
    View(view::ViewArgs),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
}

/// Runs the command that the program was called with. A command line that cannot be read ends the program here, with
/// what is wrong and exit code 2.
pub fn run() -> Result<ExitCode> {
    let chosen = Cli::parse().command.unwrap_or_else(|| Chosen::Run(run::RunArgs::standard()));
    arguments::check_environment()?;
    interrupt::survive_large_files();
    match chosen {
        Chosen::Run(args) => run::run(&args),
        Chosen::Merge(args) => merge::run(&args),
        Chosen::Slurm(args) => slurm::run(&args),
        Chosen::Compare(args) => compare::run(&args),
        Chosen::Status(args) => status::run(&args),
        Chosen::Push(args) => push::run(&args),
        Chosen::Replay(args) => replay::run(&args),
        Chosen::Limit(args) => limit::run(&args),
        Chosen::Cpi(args) => cpi::run(&args),
        Chosen::Model(args) => model::run(&args),
        Chosen::Init(args) => init::run(&args),
        Chosen::View(args) => view::run(args),
        Chosen::Completions(args) => completions::run(&args, Cli::command()),
    }
}
