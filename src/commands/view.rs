//! `standfast view`: the robot in a 3D window, live or a trial of a result.

use super::arguments::check_output;
use super::terminal::print;
use crate::error::Result;
use crate::view::{self, Options};
use std::process::ExitCode;

pub fn run(options: &Options) -> Result<ExitCode> {
    if let Some(path) = &options.screenshot {
        check_output("--screenshot", path, &["png"])?;
    }
    print(&view::run(options)?)?;
    Ok(ExitCode::SUCCESS)
}
