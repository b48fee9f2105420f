//! The floors of the house: a module imports from lower floors only.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules by floor, lowest first. Modules of one floor do not import each other, but for the floors named below.
const FLOORS: [&[&str]; 10] = [
    &["error"],
    &["geometry", "stats", "assets", "columns", "files"],
    &["lipm", "robot"],
    &["control", "sim"],
    &["episode"],
    &["campaign"],
    &["render"],
    &["view"],
    &["commands"],
    &["main"],
];
/// Small helpers may use their neighbours.
const SOCIABLE: [usize; 1] = [1];

/// Crates that only some modules may name: what Rapier, the viewer and random numbers are kept behind.
const RESERVED: [(&str, &[&str]); 5] = [
    ("rapier3d", &["sim"]),
    ("kiss3d", &["view"]),
    ("egui_plot", &["view"]),
    ("rand", &["campaign"]),
    ("rand_distr", &["campaign"]),
];

fn floor(module: &str) -> usize {
    let floor = FLOORS.iter().position(|modules| modules.contains(&module));
    floor.unwrap_or_else(|| panic!("module {module} has no floor: give it one in tests/floors.rs"))
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Words of Rust text without its comments: identifiers, and every other character by itself.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for line in text.lines() {
        let code = line.split("//").next().unwrap_or_default();
        let mut in_word = false;
        for c in code.chars() {
            let part_of_word = c.is_alphanumeric() || c == '_';
            match words.last_mut() {
                Some(word) if in_word && part_of_word => word.push(c),
                _ if c.is_whitespace() => {}
                _ => words.push(c.into()),
            }
            in_word = part_of_word;
        }
    }
    words
}

/// Modules of this crate that are named by `crate::module` (or `standfast::module` in the binary), groups included.
fn named_modules(words: &[String]) -> Vec<String> {
    let mut named = Vec::new();
    for i in 0..words.len().saturating_sub(3) {
        if !matches!(words[i].as_str(), "crate" | "standfast") || words[i + 1] != ":" || words[i + 2] != ":" {
            continue;
        }
        if words[i + 3] != "{" {
            named.push(words[i + 3].clone());
            continue;
        }
        let (mut depth, mut at) = (1, i + 4);
        while depth > 0 {
            if depth == 1 && (words[at - 1] == "{" || words[at - 1] == ",") && words[at] != "}" {
                named.push(words[at].clone());
            }
            depth += i32::from(words[at] == "{") - i32::from(words[at] == "}");
            at += 1;
        }
    }
    // The root hands on two types.
    for name in &mut named {
        if matches!(name.as_str(), "Error" | "Result") {
            *name = "error".into();
        }
    }
    named
}

/// What a file breaks, in words.
fn breaches(module: &str, text: &str) -> Vec<String> {
    let words = words(text);
    let mut breaches = Vec::new();
    let mine = floor(module);
    for name in named_modules(&words).iter().filter(|name| name.as_str() != module) {
        let theirs = floor(name);
        if theirs > mine || (theirs == mine && !SOCIABLE.contains(&mine)) {
            breaches.push(format!("{module} (floor {mine}) names {name} (floor {theirs})"));
        }
    }
    for (name, allowed) in RESERVED {
        // A path `name::`, or `name` in a use.
        let is_crate = |i: usize| words[i] == name && words.get(i + 1).is_some_and(|w| w == ":" || w == ";");
        if !allowed.contains(&module) && (0..words.len()).any(is_crate) {
            breaches.push(format!("{module} names the crate {name}"));
        }
    }
    breaches
}

/// Whoever reads a module needs to know only what is below it.
#[test]
fn modules_import_from_lower_floors_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    assert!(files.len() > 20, "only {} files under src", files.len());
    let mut found = Vec::new();
    for file in &files {
        let inside = file.strip_prefix(&root).unwrap();
        let top = inside.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = top.trim_end_matches(".rs");
        if module == "lib" {
            continue;
        }
        let text = fs::read_to_string(file).unwrap();
        found.extend(breaches(module, &text).into_iter().map(|b| format!("{}: {b}", inside.display())));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn breaches_are_seen() {
    let seen = |module, text| breaches(module, text).len();
    assert_eq!(seen("control", "use crate::sim::Plant;"), 1);
    assert_eq!(seen("sim", "fn f(c: &crate::control::Controller) {}"), 1);
    assert_eq!(seen("lipm", "use crate::{error::Error, robot::{Foot, Robot}, geometry};"), 1);
    assert_eq!(seen("episode", "use crate::{control::{Design, Phase},\n    sim::Plant, campaign::Row};"), 1);
    assert_eq!(seen("commands", "use standfast::render;"), 0);
    assert_eq!(seen("robot", "use rapier3d::prelude::*;"), 1);
    assert_eq!(seen("sim", "use rand::RngExt;"), 1);
    assert_eq!(seen("sim", "// crate::control is not ours\nuse crate::robot::Robot; use rapier3d::prelude::*;"), 0);
}
