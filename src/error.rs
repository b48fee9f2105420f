//! Typed errors. Every error that a person can cause names the file, the field, the value and what would be accepted.

use std::path::PathBuf;

/// What can go wrong outside a simulation. (A trial that fails numerically is an outcome, not an error.)
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input file cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// An output cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    /// An input is not XML or TOML, or has an unknown key or a value of a wrong type: `message` says where.
    #[error("{file}: {message}")]
    Syntax { file: String, message: String },
    /// A value that is well formed but not acceptable.
    #[error("{file}: {field} = {value}: {problem}; accepted: {accepted}")]
    Value { file: String, field: String, value: String, problem: String, accepted: String },
    /// A name that stands for nothing, e.g. a gain set that is neither compiled in nor a file.
    #[error("{what} {name:?} not found; accepted: {accepted}")]
    Unknown { what: &'static str, name: String, accepted: String },
    /// Parts of a campaign that are missing, damaged, or of another campaign.
    #[error("{}: {problem}", path.display())]
    Parts { path: PathBuf, problem: String },
    /// The caller asked to stop (Ctrl-C); what is done is kept.
    #[error("interrupted")]
    Interrupted,
    /// A window was asked for where none can be.
    #[error("{missing}; {remedy}")]
    NoWindow { missing: String, remedy: String },
    /// The window that was there is gone, and not because it was closed.
    #[error("the window is lost: {cause}")]
    LostWindow { cause: String },
    /// A numerical search did not converge.
    #[error("{what}: {problem}")]
    Numeric { what: String, problem: String },
}

impl Error {
    /// Exit code of the binary: 2 for what the caller got wrong, 3 for damaged parts, 130 when interrupted, else 1.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Read { .. } | Error::Syntax { .. } | Error::Value { .. } | Error::Unknown { .. } => 2,
            Error::NoWindow { .. } => 2,
            Error::Parts { .. } => 3,
            Error::Interrupted => 130,
            Error::Write { .. } | Error::Numeric { .. } | Error::LostWindow { .. } => 1,
        }
    }

    /// Short for a [`Error::Value`] with everything turned into text.
    pub fn value(
        file: &str,
        field: impl Into<String>,
        value: impl ToString,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) -> Self {
        Error::Value {
            file: file.into(),
            field: field.into(),
            value: value.to_string(),
            problem: problem.into(),
            accepted: accepted.into(),
        }
    }

    /// Checks numbers of a table of `file`: name, value, smallest and largest accepted value of each.
    pub fn check_ranges(file: &str, table: &str, numbers: &[(&str, f64, f64, f64)]) -> Result<()> {
        match numbers.iter().find(|(_, value, least, most)| !(least..=most).contains(&value)) {
            Some((name, value, least, most)) => {
                let (field, accepted) = (format!("{table}.{name}"), format!("{least} to {most}"));
                Err(Error::value(file, field, value, "out of range", accepted))
            }
            None => Ok(()),
        }
    }
}

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
