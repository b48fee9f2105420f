//! The error type. Every error that a user can cause names the file, the field, the value and the accepted values.

use std::io::ErrorKind;
use std::path::PathBuf;

/// An error outside of a simulation. (A trial that fails numerically has an outcome instead of an error.)
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input file cannot be read.
    #[error("{}: cannot read: {source}{}", path.display(), remedy(source))]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// An output cannot be written.
    #[error("{}: cannot write: {source}{}", path.display(), remedy(source))]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    /// An input is not valid XML or TOML, or has an unknown key or a value of the wrong type. `message` tells where.
    #[error("{file}: {message}")]
    Syntax { file: String, message: String },
    /// A value that is well-formed but not accepted.
    #[error("{file}: {field} = {value}: {problem}; accepted: {accepted}")]
    Value {
        file: String,
        field: String,
        value: String,
        problem: String,
        accepted: String,
    },
    /// An unknown name, for example of a gain set that is neither built in nor a file.
    #[error("{what} {name:?} not found; accepted: {accepted}")]
    Unknown {
        what: &'static str,
        name: String,
        accepted: String,
    },
    /// A command in a result that nobody has allowed to start.
    #[error(
        "{file}: command = {command}: was not started, because this machine has not made the files of this result, and a \
         command may do anything; accepted: --run-inputs, once you have read them"
    )]
    NotStarted { file: String, command: String },
    /// Parts of a campaign are missing, damaged, or belong to another campaign.
    #[error("{}: {problem}", path.display())]
    Parts { path: PathBuf, problem: String },
    /// A result folder that lacks trials. Whoever tells it adds the command that completes it.
    #[error("{}: incomplete: {problem}", path.display())]
    Incomplete {
        path: PathBuf,
        problem: String,
        /// Whether the command needs a baseline.
        asks_for_baseline: bool,
    },
    /// A result folder without its manifest. Whoever tells it adds the command that writes it again.
    #[error(
        "{}: holds parts, but their manifest (parts/campaign.json) is lost. The command that began it writes it again",
        .0.display()
    )]
    LostManifest(PathBuf),
    /// A result folder in which another command is at work.
    #[error("{}: another command is at work in this folder; wait for its end, or give another --out", .0.display())]
    Busy(PathBuf),
    /// The caller asked to stop (Ctrl-C). Finished work is kept.
    #[error("interrupted")]
    Interrupted,
    /// A window was requested, but none can be opened.
    #[error("{missing}; {remedy}")]
    NoWindow { missing: String, remedy: String },
    /// The window was lost without being closed by the user.
    #[error("the window is lost: {cause}")]
    LostWindow { cause: String },
    /// MuJoCo is requested, but was not built in. The program then continues in another program that has it.
    #[error(
        "engine = mujoco: this program was built without MuJoCo; accepted: rapier; or, in a clone, `eval \"$(.ci/mujoco)\"` and a \
         build with `--features mujoco`"
    )]
    NoMujoco,
    /// Several problems of one input, at least two, in the order in which they occur there.
    #[error("{}", listed(.0))]
    Several(Vec<Error>),
    /// A controller with which the robot falls without a push.
    #[error(
        "controller {name}: it {how}. Nothing was run. `standfast check` with this robot and engine shows more of it; --untried \
         runs it all the same"
    )]
    Falls { name: String, how: String },
    /// The machine lacks something, such as open files. Finished work is kept.
    #[error(
        "{0}. What this machine lacks says nothing about a controller, so it ends here; the same command can be tried again"
    )]
    Machine(String),
    /// The program that a controller depends on has ended or cannot go on. Finished work is kept.
    #[error("{0}")]
    Ended(String),
    /// A numerical search did not converge.
    #[error("{what}: {problem}")]
    Numeric { what: String, problem: String },
}

impl Error {
    /// Exit code of the program: 2 for errors of the caller, 3 for damaged parts, 75 for a temporary error after which
    /// the same command is to be tried again, 130 when interrupted, else 1.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Parts { .. } | Error::Incomplete { .. } | Error::LostManifest(_) => 3,
            Error::Busy(_) | Error::Machine(_) => TRY_AGAIN,
            Error::Write { source, .. } if is_full(source) || shortage(source).is_some() => {
                TRY_AGAIN
            }
            Error::Read { source, .. } if shortage(source).is_some() => TRY_AGAIN,
            Error::Read { .. }
            | Error::Syntax { .. }
            | Error::Value { .. }
            | Error::Unknown { .. } => 2,
            Error::NoWindow { .. }
            | Error::NoMujoco
            | Error::Falls { .. }
            | Error::NotStarted { .. } => 2,
            Error::Several(all) => all.iter().map(Error::exit_code).max().unwrap_or(2),
            Error::Interrupted => 130,
            Error::Write { .. }
            | Error::Ended(_)
            | Error::Numeric { .. }
            | Error::LostWindow { .. } => 1,
        }
    }

    /// Returns the error if it answers whether something is possible. Fails with the error if it does not, because the
    /// machine or a user ended the work.
    pub fn refusal(self) -> Result<Error> {
        let is_answer = self.exit_code() != TRY_AGAIN && !matches!(self, Error::Interrupted);
        if is_answer { Ok(self) } else { Err(self) }
    }

    /// An [`Error::Value`], with all its parts turned into text.
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

    /// An [`Error::Value`] of an option of the command line.
    pub fn option(
        option: &str,
        value: impl ToString,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) -> Self {
        Self::value("command line", option, value, problem, accepted)
    }

    /// Joins all problems of an input into one error. It is Ok if there are none.
    pub fn all(mut problems: Vec<Error>) -> Result<()> {
        match problems.len() {
            0 => Ok(()),
            1 => Err(problems.remove(0)),
            _ => Err(Error::Several(problems)),
        }
    }

    /// Checks the numbers of a table in `file` (or, if it has no name, of the file itself), each given as name, value,
    /// smallest and largest accepted value.
    pub fn check_ranges(file: &str, table: &str, numbers: &[(&str, f64, f64, f64)]) -> Result<()> {
        match numbers
            .iter()
            .find(|(_, value, least, most)| !(least..=most).contains(&value))
        {
            Some((name, value, least, most)) => {
                let field = if table.is_empty() {
                    name.to_string()
                } else {
                    format!("{table}.{name}")
                };
                let accepted = format!("{least} to {most}");
                Err(Error::value(file, field, value, "out of range", accepted))
            }
            None => Ok(()),
        }
    }
}

/// Exit code of a command that is to be run again as it is (EX_TEMPFAIL of `sysexits.h`).
pub const TRY_AGAIN: u8 = 75;

/// Whether the disk is full. There may be room later.
fn is_full(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
    // The error of a library may have its cause within.
    || std::error::Error::source(error)
        .and_then(|cause| cause.downcast_ref())
        .is_some_and(is_full)
}

/// The remedy if the machine lacks a resource, which is no fault of the file or the program. None for any other error.
pub fn shortage(error: &std::io::Error) -> Option<&'static str> {
    // ENFILE and EMFILE have no kinds.
    const ENFILE: i32 = 23;
    const EMFILE: i32 = 24;
    match (error.raw_os_error()?, error.kind()) {
        (EMFILE, _) => Some("raise the limit of open files (`ulimit -n`), or take fewer --threads"),
        (ENFILE, _) => Some(
            "the whole machine has too many open files: end something else, or take fewer --threads",
        ),
        (_, ErrorKind::OutOfMemory) => Some("free some memory, or take fewer --threads"),
        (_, ErrorKind::WouldBlock) => {
            Some("raise the limit of processes and threads (`ulimit -u`), or take fewer --threads")
        }
        (_, ErrorKind::ExecutableFileBusy) => Some("its file is being written; try again"),
        _ => None,
    }
}

/// The remedy of [`shortage`], to be written after the error.
fn remedy(error: &std::io::Error) -> String {
    shortage(error).map_or_else(String::new, |remedy| format!("; {remedy}"))
}

/// Largest number of problems of an input that are listed.
const MOST_LISTED: usize = 20;

/// Problems as a list with a line for each.
fn listed(problems: &[Error]) -> String {
    let lines: String = problems
        .iter()
        .take(MOST_LISTED)
        .map(|problem| format!("\n  {problem}"))
        .collect();
    let more = match problems.len().saturating_sub(MOST_LISTED) {
        0 => String::new(),
        more => format!("\n  and {more} more"),
    };
    format!("{} problems{lines}{more}", problems.len())
}

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
