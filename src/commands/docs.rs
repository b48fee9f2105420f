//! `standfast docs`: what the columns of trials and traces mean, what public policies survived, the manual pages, and
//! completions for a shell.

use super::terminal::{note, print};
use clap_complete::Shell;
use standfast_core::error::{Error, Result};
use standfast_files::columns::CHAPTER;
use standfast_report::baselines;
use standfast_report::text::layout::wrapped;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Subcommand)]
pub enum DocsArgs {
    /// Say what the columns of trials and traces mean
    Columns,
    /// Print what public policies survived, as Markdown
    Baselines,
    /// Write the manual pages of all commands
    Man {
        /// Folder for the pages, such as ~/.local/share/man/man1
        dir: PathBuf,
    },
    /// Print a completion script for a shell
    Completions {
        /// Shell for which the script is made
        shell: Shell,
    },
}

/// Prints or writes what is asked for. `program` holds all commands and their arguments.
pub fn run(args: &DocsArgs, mut program: clap::Command) -> Result<ExitCode> {
    match args {
        DocsArgs::Columns => {
            let paragraphs: Vec<String> = CHAPTER.split("\n\n").skip(1).map(plain).collect();
            print(&paragraphs.join("\n"))
        }
        DocsArgs::Baselines => print(&baselines::page()?),
        DocsArgs::Man { dir } => {
            let failed = |source| Error::Write {
                path: dir.clone(),
                source,
            };
            std::fs::create_dir_all(dir).map_err(failed)?;
            clap_mangen::generate_to(program, dir).map_err(failed)?;
            let dir = dir.display();
            note(&format!(
                "written: {dir}; to read it: man {dir}/standfast.1"
            ));
            Ok(ExitCode::SUCCESS)
        }
        DocsArgs::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut program, "standfast", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
    }
}

/// A paragraph without marks; of a table, a line for each row.
fn plain(paragraph: &str) -> String {
    if !paragraph.starts_with('|') {
        let text = paragraph.trim_start_matches(['#', ' ']).replace('\n', " ");
        return wrapped("", &text.replace('`', ""));
    }
    let mut text = String::new();
    for row in paragraph.lines() {
        if let Some((name, meaning)) = row.split_once("` | ") {
            let mark = format!(" {:<26} ", name.trim_start_matches("| `"));
            text += &wrapped(&mark, &meaning.trim_end_matches(" |").replace('`', ""));
        }
    }
    text
}
