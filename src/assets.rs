//! The files compiled into the binary, and one way to open an input that is either one of them or a file.

use crate::error::{Error, Result};
use std::path::Path;

/// A text input and what to call it in an error message.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path as the caller gave it, or `builtin:NAME`.
    pub file: String,
    pub text: String,
}

impl Source {
    /// Whether the text is compiled in.
    pub fn is_builtin(&self) -> bool {
        self.file.starts_with("builtin:")
    }
}

/// The robot that is meant where none is named.
pub const DEFAULT_ROBOT: &str = "ut-mu2";

/// Files of a folder under `assets`, by their names without the extension.
macro_rules! texts {
    ($folder:literal, $extension:literal: $($name:literal)*) => {
        &[$(($name, include_str!(concat!("../assets/", $folder, "/", $name, ".", $extension)))),*]
    };
}

/// Kinds of input that are compiled in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Robot,
    RobotSettings,
    Gains,
    Campaign,
    Scenario,
}

impl Kind {
    fn what(self) -> &'static str {
        match self {
            Kind::Robot => "robot",
            Kind::RobotSettings => "robot settings",
            Kind::Gains => "gain set",
            Kind::Campaign => "campaign",
            Kind::Scenario => "scenario",
        }
    }

    /// Names and texts, in the order in which they are offered.
    fn builtin(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Kind::Robot => texts!("robots", "urdf": "ut-mu2"),
            Kind::RobotSettings => texts!("robots", "toml": "ut-mu2"),
            Kind::Gains => texts!("gains", "toml": "hold" "fixed" "switching" "paper" "catch" "slow" "fast"),
            Kind::Campaign => texts!("campaigns", "toml": "smoke" "nominal" "standard" "harsh"),
            Kind::Scenario => texts!("scenarios", "toml":
                "error-backward" "error-diagonal" "push-behind" "push-diagonal"
                "moving-backward" "moving-diagonal" "push-error-backward" "push-error-diagonal"
            ),
        }
    }

    /// Names that are compiled in, in the order in which they are offered.
    pub fn names(self) -> Vec<&'static str> {
        self.builtin().iter().map(|(name, _)| *name).collect()
    }
}

/// Opens `name`: a name that is compiled in, or else a path (a file of the same name in the working folder wins only
/// when it is written as a path, e.g. `./switching` or `switching.toml`).
pub fn open(kind: Kind, name: &str) -> Result<Source> {
    if let Some((_, text)) = kind.builtin().iter().find(|(n, _)| *n == name) {
        return Ok(Source { file: format!("builtin:{name}"), text: (*text).into() });
    }
    let path = Path::new(name);
    if !is_path(name) && !path.exists() {
        return Err(Error::Unknown {
            what: kind.what(),
            name: name.into(),
            accepted: format!("{} or a path", kind.names().join(", ")),
        });
    }
    let text = std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })?;
    Ok(Source { file: name.into(), text })
}

/// Whether `name` is written as a path: with a folder or an extension.
pub fn is_path(name: &str) -> bool {
    let path = Path::new(name);
    path.extension().is_some() || path.components().count() > 1
}

/// A value in TOML, as `key=value` has it on a command line; what is no TOML is a string (a bare word).
pub fn toml_value(text: &str) -> toml::Value {
    toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.into()))
}

/// What a dotted key names that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// The key up to the name that is not there.
    pub name: String,
    /// What is there.
    pub accepted: String,
}

/// The place of a dotted key, where a number counts the elements of an array from 0; the root for an empty key.
pub fn place<'a>(root: &'a mut toml::Value, key: &str) -> Result<&'a mut toml::Value, Missing> {
    let (mut at, mut walked) = (root, String::new());
    for name in key.split('.').filter(|_| !key.is_empty()) {
        let inside = walked.trim_end_matches('.').to_string();
        let accepted = match &*at {
            toml::Value::Table(t) => t.keys().map(|k| format!("{walked}{k}")).collect::<Vec<_>>().join(", "),
            toml::Value::Array(a) if a.is_empty() => format!("nothing: `{inside}` is empty"),
            toml::Value::Array(a) => format!("{walked}0 to {walked}{}", a.len() - 1),
            _ => inside,
        };
        let next = match at {
            toml::Value::Array(values) => name.parse().ok().and_then(|i: usize| values.get_mut(i)),
            other => other.get_mut(name),
        };
        walked += name;
        at = next.ok_or_else(|| Missing { name: walked.clone(), accepted })?;
        walked.push('.');
    }
    Ok(at)
}

/// Parses TOML; the error names the file, the line and the key.
pub fn parse_toml<T: serde::de::DeserializeOwned>(source: &Source) -> Result<T> {
    toml::from_str(&source.text).map_err(|e| Error::Syntax {
        file: source.file.clone(),
        message: e.to_string().trim_end().replace('\n', "\n  "),
    })
}
