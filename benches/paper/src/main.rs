//! The program: runs the command with which it is called, and turns an error into an exit code.

#![forbid(unsafe_code)]

use standfast::commands::{exit_code, note};
use std::process::ExitCode;

fn main() -> ExitCode {
    standfast::leaves::add();
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn")).init();
    standfast_paper::commands::run().unwrap_or_else(|error| {
        note(&format!("error: {error}"));
        ExitCode::from(exit_code(&error))
    })
}
