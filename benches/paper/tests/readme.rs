//! The commands of this program in the guide and in its help are valid, as far as this can be checked without running
//! them.

use crate::common::program::{folder, standfast as program, stderr, stdout};
use crate::shown::{commands_of, documents, words_of};
use standfast_paper::scenario::BUILTIN;
use std::fs;
use std::path::Path;

/// Why a command is not valid; None if it is.
fn wrong(command: &str, folder: &Path) -> Option<String> {
    let words = words_of(command);
    // Only `scenario` can check everything without running. Arguments are parsed before help is printed, so an unknown
    // one or an invalid value is an error.
    let only = if words[1] == "scenario" {
        "--dry-run"
    } else {
        "--help"
    };
    let args: Vec<&str> = words[1..]
        .iter()
        .map(String::as_str)
        .chain([only])
        .collect();
    let run = program(folder, &args);
    (!run.get_output().status.success()).then(|| format!("{command}: {}", stderr(&run)))
}

#[test]
fn every_command_that_is_shown_is_good() {
    let dir = folder();
    fs::write(dir.path().join("my-scenario.toml"), BUILTIN[2].1).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shown = documents(&root)
        .into_iter()
        .flat_map(|path| commands_of(&fs::read_to_string(path).unwrap(), "standfast-paper"));
    let examples = ["scenario", "response", "page"]
        .into_iter()
        .flat_map(|command| {
            let help = stdout(&program(dir.path(), &[command, "--help"]).success());
            let examples = help
                .lines()
                .map(str::trim_start)
                .filter(|line| line.starts_with("standfast-paper "));
            examples.map(String::from).collect::<Vec<_>>()
        });
    let (shown, examples): (Vec<_>, Vec<_>) = (shown.collect(), examples.collect());
    assert!(
        shown.len() > 5 && examples.len() > 5,
        "only {} and {} found",
        shown.len(),
        examples.len()
    );
    let wrong: Vec<String> = shown
        .iter()
        .chain(&examples)
        .filter_map(|command| wrong(command, dir.path()))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The test above can fail because of names inside of a command, and not only because of its options.
#[test]
fn a_command_that_is_wrong_inside_is_not_good() {
    let dir = folder();
    for (command, words) in [
        (
            "standfast-paper scenario push-ahead",
            "scenario \"push-ahead\" not found",
        ),
        (
            "standfast-paper response --axis z",
            "'z' for '--axis <AXIS>'",
        ),
        ("standfast-paper paper", "unrecognized subcommand"),
    ] {
        let told =
            wrong(command, dir.path()).unwrap_or_else(|| panic!("{command} is taken for good"));
        assert!(told.contains(words), "{told}");
    }
}
