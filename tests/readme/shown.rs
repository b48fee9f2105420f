//! The commands that the README and the guide show, for the tests of both programs.

use std::fs;
use std::path::{Path, PathBuf};

/// The README and the chapters of the guide.
pub fn documents(root: &Path) -> Vec<PathBuf> {
    let chapters = fs::read_dir(root.join("src/guide"))
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    let chapters =
        chapters.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    std::iter::once(root.join("README.md"))
        .chain(chapters)
        .collect()
}

/// Every command of `program` in a document: lines in blocks of commands, and code within text.
pub fn commands_of(document: &str, program: &str) -> Vec<String> {
    let (mut found, mut in_block, mut joined) = (Vec::new(), None, String::new());
    let is_its = |command: &str| {
        let name = Path::new(command.split(' ').next().unwrap()).file_name();
        name.is_some_and(|name| name == program)
    };
    for line in document.lines() {
        if let Some(language) = line.strip_prefix("```") {
            in_block = if in_block.is_some() {
                None
            } else {
                Some(language)
            };
        } else if matches!(in_block, Some("sh" | "console" | "yaml")) {
            joined += line
                .trim()
                .trim_start_matches("$ ")
                .trim_start_matches("- ")
                .trim_start_matches("run: ");
            // The line continues in the next one.
            if let Some(start) = joined.strip_suffix('\\') {
                joined = start.into();
                continue;
            }
            found.extend(Some(by_name(&joined)).filter(|command| is_its(command)));
            joined.clear();
        } else if in_block.is_none() {
            let code = line
                .split('`')
                .skip(1)
                .step_by(2)
                .filter(|code| code.contains(' '))
                .map(by_name);
            found.extend(code.filter(|command| is_its(command)));
        }
    }
    found
}

/// The command with the name of its program. A command from a clone calls the program through cargo.
fn by_name(command: &str) -> String {
    match command
        .split_once(" -- ")
        .filter(|(start, _)| start.starts_with("cargo run "))
    {
        Some((start, arguments)) => {
            format!(
                "{} {arguments}",
                start
                    .split_once(" -p ")
                    .map_or("standfast", |(_, program)| program)
            )
        }
        None => command.into(),
    }
}

/// The words of a command, as a shell reads them. The command ends at a comment, at a pipe or redirection of its output, or,
/// in a help text, at two spaces.
pub fn words_of(command: &str) -> Vec<String> {
    let ends = [" #", " > ", " | ", "  "]
        .into_iter()
        .filter_map(|end| command.find(end));
    shlex::split(&command[..ends.min().unwrap_or(command.len())])
        .unwrap_or_else(|| panic!("{command}"))
}
