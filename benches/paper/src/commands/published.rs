//! `standfast-paper published`: sets the pendulum bounds beside pushes that others published.

use crate::published::Published;
use crate::render;
use standfast::commands::terminal::print;
use standfast::core::error::Result;
use std::process::ExitCode;

pub fn run() -> Result<ExitCode> {
    print(&render::published::text(&Published::builtin()?))
}
