//! The program: reads the command line, runs one command, turns its error into an exit code.

use clap::Parser;
use standfast::commands::{
    self,
    cli::{Cli, Command, RunArgs},
};
use standfast::render::progress::note;
use std::process::ExitCode;

fn main() -> ExitCode {
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn")).init();
    let command = Cli::parse().command.unwrap_or(Command::Run(RunArgs::standard()));
    let done = match command {
        Command::Run(args) => commands::run(&args),
        Command::Merge(args) => commands::merge(&args),
        Command::Compare(args) => commands::compare(&args),
        Command::Status(args) => commands::status(&args),
        Command::Push(args) => commands::push(&args),
        Command::Replay(args) => commands::replay(&args),
        Command::Limit(args) => commands::limit(&args),
        Command::Scenario(args) => commands::scenario(&args),
        Command::Paper(args) => commands::paper::run(&args),
        Command::Cpi(args) => commands::cpi(&args),
        Command::Response(args) => commands::response(&args),
        Command::Model(args) => commands::model(&args),
        Command::View(args) => commands::view(&args),
        Command::Completions { shell } => commands::completions(shell),
    };
    done.unwrap_or_else(|error| {
        note(&format!("error: {error}"));
        ExitCode::from(error.exit_code())
    })
}
