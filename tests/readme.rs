//! The commands that the README shows are commands that the program takes.

mod common;

use common::program::{folder, standfast, stderr};

/// Every `standfast ...` of the README: lines of its blocks of commands, and code within text.
fn commands() -> Vec<String> {
    let readme = include_str!("../README.md");
    let (mut found, mut in_block, mut joined) = (Vec::new(), None, String::new());
    for line in readme.lines() {
        if let Some(language) = line.strip_prefix("```") {
            in_block = if in_block.is_some() { None } else { Some(language) };
        } else if matches!(in_block, Some("sh" | "console" | "yaml")) {
            joined += line.trim().trim_start_matches("$ ").trim_start_matches("- run: ");
            // A line that goes on in the next one.
            if let Some(start) = joined.strip_suffix('\\') {
                joined = start.into();
                continue;
            }
            found.extend(joined.starts_with("standfast ").then(|| joined.clone()));
            joined.clear();
        } else if in_block.is_none() {
            let code = line.split('`').skip(1).step_by(2).filter(|code| code.starts_with("standfast "));
            found.extend(code.map(String::from));
        }
    }
    found
}

#[test]
fn every_command_of_the_readme_is_one() {
    let commands = commands();
    assert!(commands.len() > 30, "only {} commands found", commands.len());
    let dir = folder();
    for command in &commands {
        // As a shell reads it; a comment ends it.
        let words = shlex::split(command.split(" #").next().unwrap()).unwrap_or_else(|| panic!("{command}"));
        // Arguments are read before help is given: one that is unknown, or a value that is none, is an error.
        let args: Vec<&str> = words[1..].iter().map(String::as_str).chain(["--help"]).collect();
        let run = standfast(dir.path(), &args);
        assert!(run.get_output().status.success(), "{command}: {}", stderr(&run));
    }
}

/// Pictures and files that it links are there.
#[test]
fn every_link_of_the_readme_leads_somewhere() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let links = include_str!("../README.md").split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files: Vec<&str> = links.filter(|link| !link.starts_with("https://") && !link.starts_with('#')).collect();
    assert!(files.len() > 8, "only {files:?}");
    for file in files {
        assert!(root.join(file).is_file(), "{file} is not there");
    }
}
