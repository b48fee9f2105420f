//! `standfast completions`: prints a completion script for a shell.

use super::terminal::print;
use clap_complete::Shell;
use standfast_core::error::Result;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct CompletionsArgs {
    /// Shell for which the script is made
    pub shell: Shell,
}

/// Prints the script. `program` holds all commands and their arguments.
pub fn run(args: &CompletionsArgs, mut program: clap::Command) -> Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "standfast", &mut script);
    print(&String::from_utf8_lossy(&script))
}
