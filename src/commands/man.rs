//! `standfast man`: writes the manual pages of all commands.

use super::terminal::note;
use standfast_core::error::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Folder for the pages, such as ~/.local/share/man/man1
    pub dir: PathBuf,
}

/// Writes the pages. `program` holds all commands and their arguments.
pub fn run(args: &ManArgs, program: clap::Command) -> Result<ExitCode> {
    let failed = |source| Error::Write {
        path: args.dir.clone(),
        source,
    };
    std::fs::create_dir_all(&args.dir).map_err(failed)?;
    clap_mangen::generate_to(program, &args.dir).map_err(failed)?;
    note(&format!(
        "written: {}; to read it: man {0}/standfast.1",
        args.dir.display()
    ));
    Ok(ExitCode::SUCCESS)
}
