//! The commands in the README, the guide and the help are valid, as far as this can be checked without running them:
//! files, names, keys and gates are checked, and not only the options.

mod common;

use common::program::{folder, standfast, stderr, stdout};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Commands that can check everything without running. For the others only the options are checked.
const CHECKED: [&str; 4] = ["run", "push", "limit", "scenario"];
const COMMANDS: [&str; 13] = [
    "run", "merge", "compare", "status", "push", "replay", "limit", "scenario", "paper", "cpi", "response", "model",
    "view",
];

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

/// The README and the chapters of the guide.
fn documents() -> Vec<PathBuf> {
    let chapters = fs::read_dir(root().join("src/guide")).into_iter().flatten().map(|entry| entry.unwrap().path());
    let chapters = chapters.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    std::iter::once(root().join("README.md")).chain(chapters).collect()
}

/// Every `standfast ...` in a document: lines in blocks of commands, and code within text.
fn commands_of(document: &str) -> Vec<String> {
    let (mut found, mut in_block, mut joined) = (Vec::new(), None, String::new());
    for line in document.lines() {
        if let Some(language) = line.strip_prefix("```") {
            in_block = if in_block.is_some() { None } else { Some(language) };
        } else if matches!(in_block, Some("sh" | "console" | "yaml")) {
            joined += line.trim().trim_start_matches("$ ").trim_start_matches("- ").trim_start_matches("run: ");
            // The line continues in the next one.
            if let Some(start) = joined.strip_suffix('\\') {
                joined = start.into();
                continue;
            }
            let program = Path::new(joined.split(' ').next().unwrap()).file_name();
            found.extend(program.is_some_and(|name| name == "standfast").then(|| joined.clone()));
            joined.clear();
        } else if in_block.is_none() {
            let code = line.split('`').skip(1).step_by(2).filter(|code| code.starts_with("standfast "));
            found.extend(code.map(String::from));
        }
    }
    found
}

/// The commands of the examples in the help of a command.
fn examples_of(command: &str) -> Vec<String> {
    let help = stdout(&standfast(Path::new("."), &[command, "--help"]).success());
    help.lines().filter_map(|line| line.strip_prefix("  standfast ")).map(|rest| format!("standfast {rest}")).collect()
}

/// A folder with the files that a reader of these commands has.
fn reader() -> TempDir {
    let dir = folder();
    let put = |asset: &str, name: &str, file: &str| {
        let text = fs::read_to_string(root().join("assets").join(asset)).unwrap();
        let old = text.lines().find(|line| line.starts_with("name = ")).unwrap();
        fs::write(dir.path().join(file), text.replacen(old, &format!("name = '{name}'"), 1)).unwrap();
    };
    put("campaigns/smoke.toml", "my", "my.toml");
    put("gains/switching.toml", "mine", "mine.toml");
    put("scenarios/push-behind.toml", "my-scenario", "my-scenario.toml");
    // A placeholder for a name.
    put("scenarios/push-behind.toml", "name", "NAME");
    dir
}

/// Creates the earlier result with which a command compares, unless it exists.
fn put_baseline(words: &[String], folder: &Path) {
    let Some(at) = words.iter().position(|word| word == "--baseline") else { return };
    if !folder.join(&words[at + 1]).exists() {
        let few = ["run", "standard", "--trials=1", "--gains=hold", "--gains=catch", "--replays=0", "--out"];
        standfast(folder, &[&few[..], &[&words[at + 1]]].concat()).success();
    }
}

/// Why a command is not valid; None if it is.
fn wrong(command: &str, folder: &Path) -> Option<String> {
    // Read as a shell does. The command ends at a comment or, in a help text, at two spaces.
    let end = [command.find(" #"), command.find("  ")].into_iter().flatten().min().unwrap_or(command.len());
    let words = shlex::split(&command[..end]).unwrap_or_else(|| panic!("{command}"));
    let checked = words.get(1).is_some_and(|name| CHECKED.contains(&name.as_str()));
    // Arguments are parsed before help is printed, so an unknown one or an invalid value is an error.
    let only = if checked { "--check" } else { "--help" };
    let given = words[1..].iter().map(String::as_str).filter(|word| *word != only);
    put_baseline(&words, folder);
    let args: Vec<&str> = given.chain([only]).collect();
    let run = standfast(folder, &args);
    (!run.get_output().status.success()).then(|| format!("{command}: {}", stderr(&run)))
}

#[test]
fn every_command_that_is_shown_is_good() {
    let shown = documents().into_iter().flat_map(|path| commands_of(&fs::read_to_string(path).unwrap()));
    let (shown, examples): (Vec<_>, Vec<_>) = (shown.collect(), COMMANDS.into_iter().flat_map(examples_of).collect());
    assert!(shown.len() > 40 && examples.len() > 30, "only {} and {} found", shown.len(), examples.len());
    let dir = reader();
    let wrong: Vec<String> = shown.iter().chain(&examples).filter_map(|command| wrong(command, dir.path())).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The test above can fail because of names inside of a command, and not only because of its options.
#[test]
fn a_command_that_is_wrong_inside_is_not_good() {
    let dir = folder();
    for (command, words) in [
        ("standfast run --gate nonsense", "gate = nonsense"),
        ("standfast run --set foo=bar", "--set: foo = bar: unknown key"),
        ("standfast run --gate nonsense --set foo=bar", "foo"),
        ("standfast run --gate 'best >= 0.8'", "no set is named `best`"),
        ("standfast run --gains hold --until-resolved", "nothing to decide"),
        ("standfast run --vary paper:stepping.beta=2", "stepping.beta"),
        ("standfast run --until-resolved --shard 1/4", "shards know nothing of each other"),
        ("standfast run missing.toml", "missing.toml: cannot read"),
        ("standfast push --impulse 2 --gains best", "gain set \"best\" not found"),
        ("standfast push --impulse 2 --trace push.txt", "--trace = push.txt: unknown kind"),
        ("standfast limit --headings 0", "--headings = 0: out of range"),
        ("standfast scenario push-ahead", "scenario \"push-ahead\" not found"),
    ] {
        let told = wrong(command, dir.path()).unwrap_or_else(|| panic!("{command} is taken for good"));
        assert!(told.contains(words), "{told}");
        // Without the check it fails in the same way.
        let args = shlex::split(command).unwrap();
        let run = standfast(dir.path(), &args[1..].iter().map(String::as_str).collect::<Vec<_>>()).code(2);
        assert_eq!(told, format!("{command}: {}", stderr(&run)));
    }
}

/// The pictures and files to which it links exist.
#[test]
fn every_link_of_the_readme_leads_somewhere() {
    let links = include_str!("../README.md").split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files: Vec<&str> = links.filter(|link| !link.starts_with("https://") && !link.starts_with('#')).collect();
    assert!(files.len() > 8, "only {files:?}");
    for file in files {
        assert!(root().join(file).is_file(), "{file} is not there");
    }
}
