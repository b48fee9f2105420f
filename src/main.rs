//! The program: runs the command with which it is called, and turns an error into an exit code.

#![forbid(unsafe_code)]

use standfast::Error;
use standfast::commands::{self, note};
use std::process::ExitCode;

fn main() -> ExitCode {
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn")).init();
    commands::run().unwrap_or_else(|error| {
        // Whoever was interrupted has said what is left of it.
        if !matches!(error, Error::Interrupted) {
            note(&format!("error: {error}"));
        }
        ExitCode::from(commands::exit_code(&error))
    })
}
