//! The command line: one file for each command, with its arguments and its steps in the order in which they happen.

mod foretold;
mod page;
mod published;
mod response;
mod scenario;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use standfast::Result;
use standfast::commands::note;
use std::process::ExitCode;

/// The command line of the program.
#[derive(Debug, Parser)]
#[command(
    version,
    about = "What the paper says of its controller, simulated again",
    after_help = "What a command computes goes to the standard output, and everything else to the
standard error. The paper is that of K. Yamamoto and Y. Nakamura on switching
control and quick stepping with maximal CPI sets (constraint positively
invariant sets). Its controller is in the program standfast.

Exit codes: 0 done, 1 error, 2 wrong input",
    subcommand_required = true,
    arg_required_else_help = true
)]
struct Cli {
    #[command(subcommand)]
    command: Chosen,
}

#[derive(Debug, Subcommand)]
enum Chosen {
    /// Draw the paper's figures, and check what the paper states
    Page(page::PageArgs),
    /// Count recoveries by where the state was in the CPI sets after the push
    Foretold(foretold::ForetoldArgs),
    /// Simulate a disturbance that has a name, or list the names
    Scenario(scenario::ScenarioArgs),
    /// Measure how well the ZMP follows the commanded ZMP
    Response(response::ResponseArgs),
    /// Set the pendulum bounds beside pushes that others published, as Markdown
    Published,
}

/// Runs the command that the program was called with. A command line that cannot be read ends the program here, with
/// what is wrong and exit code 2.
pub fn run() -> Result<ExitCode> {
    let cli = Cli::try_parse().unwrap_or_else(|error| {
        // A user who names an unknown command is shown all commands.
        if error.kind() == ErrorKind::InvalidSubcommand {
            note(&Cli::command().render_help().to_string());
        }
        error.exit()
    });
    match cli.command {
        Chosen::Page(args) => page::run(&args),
        Chosen::Foretold(args) => foretold::run(&args),
        Chosen::Scenario(args) => scenario::run(&args),
        Chosen::Response(args) => response::run(&args),
        Chosen::Published => published::run(),
    }
}
