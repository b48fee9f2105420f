//! The kinds of controllers, and the one place where the file of a controller is read.

use super::posture::HeldPosture;
use super::process::Process;
use super::python::PythonObject;
use super::spec::ControllerSpec;
use serde::de::{DeserializeOwned, Error as _};
use standfast_core::error::{Error, Result};
use standfast_core::lipm::GainSet;
use standfast_core::lipm::catching::CatchingTable;
use standfast_core::lipm::stepping::SteppingTable;
use standfast_files::assets::{Source, parse_toml};
use std::sync::{PoisonError, RwLock};
use toml::Table;

/// The kinds of controllers. The first one is the kind of a file that does not state a kind.
static KINDS: [ControllerKind; 5] = [
    kind::<GainSet>("cpi"),
    kind::<HeldPosture>("posture"),
    ControllerKind {
        parse: Process::read,
        ..kind::<Process>("process")
    },
    ControllerKind {
        parse: PythonObject::read,
        ..kind::<PythonObject>("python")
    },
    // A program with ONNX adds the kind that can be read.
    ControllerKind {
        name: "onnx",
        parse: |source| {
            Err(Error::value(
                &source.file,
                "kind",
                "\"onnx\"",
                NO_ONNX[0],
                NO_ONNX[1],
            ))
        },
        of_tree: |_| {
            Err(toml::de::Error::custom(format!(
                "kind = \"onnx\": {}; accepted: {}",
                NO_ONNX[0], NO_ONNX[1]
            )))
        },
    },
];

/// What is wrong with a policy in a program without ONNX, and what is accepted.
const NO_ONNX: [&str; 2] = [
    "this program was built without ONNX",
    "another kind, or a program that was built by `cargo build --release --features onnx`",
];

/// The kinds that crates above this one have added.
static ADDED: RwLock<Vec<ControllerKind>> = RwLock::new(Vec::new());

/// Adds a kind, which takes the place of one with its name.
pub fn add(kind: ControllerKind) {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    added.retain(|known| known.name != kind.name);
    added.push(kind);
}

/// A kind of controllers.
#[derive(Debug, Clone, Copy)]
pub struct ControllerKind {
    /// The word for the kind in a file.
    pub name: &'static str,
    /// Reads a file. It checks no values.
    pub parse: fn(&Source) -> Result<Box<dyn ControllerSpec>>,
    /// Reads the tree of a file. It checks no values.
    pub of_tree: fn(Table) -> Result<Box<dyn ControllerSpec>, toml::de::Error>,
}

/// A kind whose files are deserialized as `S`.
pub const fn kind<S: ControllerSpec + DeserializeOwned + 'static>(
    name: &'static str,
) -> ControllerKind {
    ControllerKind {
        name,
        parse: |source| Ok(Box::new(parse_toml::<S>(source)?)),
        of_tree: |tree| Ok(Box::new(tree.try_into::<S>()?)),
    }
}

/// Reads the file of a controller of any kind.
pub fn read(source: &Source) -> Result<Box<dyn ControllerSpec>> {
    let table: Table = parse_toml(source)?;
    let settings = (kind_of(&table, &source.file)?.parse)(source)
        .map_err(|error| of_all_missing(error, &table))?;
    settings.check(&source.file)?;
    Ok(settings)
}

/// Adds to the error about a missing key all other keys that are missing in the file, its gains and its rules for
/// footsteps.
fn of_all_missing(error: Error, table: &Table) -> Error {
    fn lacks(table: Option<&toml::Value>, name: &str, keys: &[&str]) -> Vec<String> {
        let Some(table) = table.and_then(toml::Value::as_table) else {
            return Vec::new();
        };
        keys.iter()
            .filter(|key| !table.contains_key(**key))
            .map(|key| format!("{name}.{key}"))
            .collect()
    }
    let mut missing: Vec<String> = if table.contains_key("name") {
        Vec::new()
    } else {
        vec!["name".into()]
    };
    let gains = table
        .get("gains")
        .and_then(toml::Value::as_array)
        .into_iter()
        .flatten()
        .enumerate();
    missing.extend(
        gains.flat_map(|(i, gain)| lacks(Some(gain), &format!("gains.{i}"), &["name", "x", "y"])),
    );
    missing.extend(lacks(
        table.get("catching"),
        "catching",
        &CatchingTable::KEYS,
    ));
    missing.extend(lacks(
        table.get("stepping"),
        "stepping",
        &SteppingTable::KEYS,
    ));
    match error {
        Error::Syntax { file, message }
            if missing.len() > 1 && message.contains("missing field") =>
        {
            Error::Syntax {
                file,
                message: format!("missing fields: {}", missing.join(", ")),
            }
        }
        other => other,
    }
}

/// The kind that a file states.
pub(super) fn kind_of(tree: &Table, file: &str) -> Result<ControllerKind> {
    let Some(stated) = tree.get("kind") else {
        return Ok(KINDS[0]);
    };
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    added
        .iter()
        .chain(&KINDS)
        .find(|kind| stated.as_str() == Some(kind.name))
        .copied()
        .ok_or_else(|| {
            let known: Vec<String> = KINDS
                .iter()
                .map(|kind| format!("{:?}", kind.name))
                .collect();
            let accepted = format!(
                "{}; without a kind, the file is a gain set",
                known.join(", ")
            );
            Error::value(file, "kind", stated, "is no kind of controller", accepted)
        })
}
