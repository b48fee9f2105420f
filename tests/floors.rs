//! The floors of the crate: a file imports from lower floors only, files form no import circle, and some crates may
//! only be used in one room each.

#[path = "floors/imports.rs"]
mod imports;

use imports::{Crate, File, Named};
use std::path::Path;

/// Rooms by floor, lowest first. `render` and `view` have floors of their own, since the window uses the drawings.
const FLOORS: [&[&str]; 10] = [
    &["error", "files", "columns", "assets", "foreign"],
    &["stats", "geometry"],
    &["lipm", "robot"],
    &["control", "sim"],
    &["contest", "episode"],
    &["campaign"],
    &["render"],
    &["view"],
    &["commands"],
    &["main"],
];
/// Number of the floor on which rooms may import from each other. On any other floor they may not.
const SOCIABLE: usize = 0;

/// Floors within a room, lowest first.
const INNER_FLOORS: [(&str, &[&str]); 1] =
    [("campaign", &["ask", "store", "verdict", "run", "limit", "partings", "cma_es", "ceiling", "tune"])];

/// Crates that only one room or file may use.
const RESERVED: [(&str, &str); 17] = [
    ("rapier3d", "sim/rapier"),
    ("mujoco_rs", "sim/mujoco"),
    ("tract_onnx", "contest/onnx"),
    ("kiss3d", "view"),
    ("egui_plot", "view"),
    ("parry3d", "view"),
    ("clap", "commands"),
    ("clap_complete", "commands"),
    ("clap_mangen", "commands"),
    ("open", "commands"),
    ("mcap", "render/mcap"),
    ("indicatif", "commands"),
    ("rustix", "contest/child"),
    ("signal_hook", "commands"),
    ("parquet", "columns"),
    ("rand", "campaign/ask"),
    ("rand_distr", "campaign/ask"),
];

fn floor(room: &str) -> usize {
    let floor = FLOORS.iter().position(|rooms| rooms.contains(&room));
    floor.unwrap_or_else(|| panic!("room {room} has no floor: give it one in tests/floors.rs"))
}

/// The violations of these rules, in words.
fn breaches(house: &Crate) -> Vec<String> {
    let mut found = house.circles();
    for (module, file) in house.files.iter().filter(|(module, _)| !module.is_empty()) {
        for named in &file.named {
            let breach = match named.is_ours {
                true => not_below(house, module, &named.path),
                false => reserved_for_others(file, named, house.is_test(module)),
            };
            found.extend(breach.map(|breach| format!("{}: {} {breach}", file.name, named.path.join("::"))));
        }
    }
    found.sort();
    found.dedup();
    found
}

fn not_below(house: &Crate, module: &[String], path: &[String]) -> Option<String> {
    let (room, made_in) = (&module[0], house.made_in(path)?);
    // Checked are the room that is named and, for a re-export, the room in which the item is defined.
    let named = path.first().filter(|name| house.files.contains_key(std::slice::from_ref(*name)));
    let too_high = |other: &&String| {
        let (mine, theirs) = (floor(room), floor(other));
        *other != room && (theirs > mine || theirs == mine && mine != SOCIABLE)
    };
    if let Some(other) = named.into_iter().chain(made_in.first()).find(too_high) {
        return Some(format!("is of {other}, which is not below {room}"));
    }
    let (_, inner) = INNER_FLOORS.iter().find(|(outer, _)| room == outer && made_in.first() == Some(room))?;
    let place = |module: &[String]| inner.iter().position(|floor| module.get(1).is_some_and(|name| name == floor));
    let (mine, theirs) = (place(module)?, place(made_in)?);
    (theirs > mine).then(|| format!("is of {room}/{}, which is not below {room}/{}", inner[theirs], inner[mine]))
}

/// Unit tests may use any crate.
fn reserved_for_others(file: &File, named: &Named, is_test_file: bool) -> Option<String> {
    let (_, place) = RESERVED.iter().find(|(name, _)| named.path[0] == *name)?;
    let is_there = file.name.trim_end_matches(".rs") == *place || file.name.starts_with(&format!("{place}/"));
    (!is_there && !named.in_test && !is_test_file).then(|| format!("is for {place} only"))
}

/// To understand a file, one needs to know only what is below it.
#[test]
fn files_name_what_is_below_them_and_form_no_circle() {
    let house = Crate::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(house.files.len() > 100, "only {} files under src", house.files.len());
    let found = breaches(&house);
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// Files as in the crate's rooms, for other files to import from.
const NEIGHBOURS: [(&str, &str); 6] = [
    ("lib.rs", "pub mod error; pub use error::Error;"),
    ("error.rs", "pub enum Error {}"),
    ("robot/mod.rs", "pub struct Robot;"),
    ("sim/mod.rs", "pub mod plant; pub use plant::Plant;"),
    ("sim/plant.rs", "pub struct Plant;"),
    ("campaign/mod.rs", "pub mod ask; pub mod store; pub use store::row::Row as TrialRow;"),
];

fn seen(files: &[(&str, &str)]) -> Vec<String> {
    breaches(&Crate::of(NEIGHBOURS.into_iter().chain(files.iter().copied())))
}

#[test]
fn breaches_are_seen() {
    let row = ("campaign/store/row.rs", "pub struct Row;");
    for (name, text, expected) in [
        (
            "control/mod.rs",
            "use crate::sim::Plant;",
            "control/mod.rs: sim::Plant is of sim, which is not below control",
        ),
        ("robot/io.rs", "fn f(c: &crate::sim::plant::Plant) {}", "robot/io.rs: sim::plant::Plant is of sim"),
        ("robot/io.rs", "use crate::{error::Error, sim::{Plant as P}};", "robot/io.rs: sim::Plant is of sim"),
        ("robot/io.rs", "use super::super::sim;", "robot/io.rs: sim is of sim"),
        ("robot/io.rs", "#[cfg(test)] mod tests { fn f() { crate::sim::f() } }", "robot/io.rs: sim::f is of sim"),
        ("lipm/mod.rs", "use crate::robot::Robot;", "lipm/mod.rs: robot::Robot is of robot"),
        ("campaign/ask/spec.rs", "use crate::campaign::store::row::Row;", "which is not below campaign/ask"),
        (
            "campaign/ask/spec.rs",
            "use crate::campaign::TrialRow;",
            "is of campaign/store, which is not below campaign/ask",
        ),
        ("campaign/ask/spec.rs", "use super::super::store::row;", "which is not below campaign/ask"),
        ("sim/plant.rs", "pub struct Plant; use rapier3d::prelude::*;", "rapier3d::prelude is for sim/rapier only"),
        ("robot/io.rs", "#[derive(Debug, clap::Args)] struct A;", "clap::Args is for commands only"),
        ("robot/io.rs", "use clap;", "clap is for commands only"),
        ("campaign/store/part.rs", "fn f() { x(rand::random::<f64>()) }", "rand::random is for campaign/ask only"),
    ] {
        let found = seen(&[row, (name, text)]);
        assert!(found.len() == 1 && found[0].contains(expected), "{text}: {found:?}");
    }
}

#[test]
fn circles_are_seen() {
    for (a, b) in [
        ("use crate::robot::b::B; pub struct A;", "use crate::robot::a::A; pub struct B;"),
        ("use super::b; pub struct A;", "pub fn b(a: super::a::A) {}"),
        ("use super::{b::B, c}; pub struct A;", "impl T for crate::robot::a::A {} pub struct B;"),
    ] {
        let found = seen(&[("robot/a.rs", a), ("robot/b.rs", b), ("robot/c.rs", "")]);
        let circle = "a circle: robot/a.rs -> robot/b.rs; robot/b.rs -> robot/a.rs";
        assert_eq!(found, [circle], "{a} {b}");
    }
    // Circles through a re-export, and of three files.
    let house = [
        ("lipm/mod.rs", "mod a; mod b; mod c; pub use b::B; pub use self::c::*;"),
        ("lipm/a.rs", "use crate::lipm::B; pub struct A;"),
        ("lipm/b.rs", "use super::C; pub struct B;"),
        ("lipm/c.rs", "use crate::lipm::a::A; pub struct C;"),
    ];
    let circle = "a circle: lipm/a.rs -> lipm/b.rs; lipm/b.rs -> lipm/c.rs; lipm/c.rs -> lipm/a.rs";
    assert_eq!(seen(&house), [circle]);
    // A name that is re-exported and also used there.
    let house =
        [("lipm/mod.rs", "mod a; pub use a::A; pub const N: A = A;"), ("lipm/a.rs", "use super::N; pub struct A;")];
    assert_eq!(seen(&house), ["a circle: lipm/mod.rs -> lipm/a.rs; lipm/a.rs -> lipm/mod.rs"]);
}

#[test]
fn what_is_allowed_is_no_breach() {
    for (name, text) in [
        (
            "sim/rapier/joint.rs",
            "// crate::control is not ours\nuse crate::robot::Robot; use rapier3d::prelude::*; use crate::Error;",
        ),
        ("robot/io.rs", "fn f() { println!(\"use crate::sim::Plant; {\") } use super::Robot; const C: char = '{';"),
        ("robot/io.rs", "#[cfg(test)] mod tests { use super::*; use rand::random; use crate::robot::Robot; }"),
        ("columns.rs", "use parquet::basic; use crate::files::write; use crate::error::Error;"),
        ("campaign/ask/trial.rs", "use rand::random;"),
        ("campaign/verdict/mod.rs", "use crate::campaign::{TrialRow, store::row};"),
        ("main.rs", "use standfast::sim; fn main() { sim::run() }"),
    ] {
        assert_eq!(
            seen(&[(name, text), ("campaign/store/row.rs", "pub struct Row;"), ("files.rs", "")]),
            [""; 0],
            "{text}"
        );
    }
    // A module that re-exports what its rooms define is no circle, nor is a test beside the code that it tests.
    let house = [
        ("lipm/mod.rs", "mod a; mod b; pub use a::A; pub use b::{self, B};"),
        ("lipm/a.rs", "use super::B; pub struct A; #[cfg(test)] mod tests;"),
        ("lipm/a/tests.rs", "use super::*; use crate::lipm::b;"),
        ("lipm/b.rs", "pub struct B; #[cfg(test)] mod tests { use super::super::A; }"),
    ];
    assert_eq!(seen(&house), [""; 0]);
}
