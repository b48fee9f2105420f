//! Where a command prints: its result goes to the standard output, and everything else to the standard error.

use indicatif::ProgressBar;
use log::{Level, Log, Metadata, Record};
use standfast_controllers::permission::{Kept, Made};
use standfast_core::error::{Error, Result};
use standfast_report::foreign::harmless;
use standfast_report::text::layout::wrapped;
use std::collections::HashSet;
use std::io::{BufRead, ErrorKind, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The progress bar that is on the terminal. It is taken away while a note is printed.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints to the standard output, where no foreign text commands the terminal, and gives the exit code of a command
/// that ends with that. It is no error if the reader has gone, as in `| head`.
pub fn print(text: &str) -> Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    match out
        .write_all(harmless(text).as_bytes())
        .and_then(|()| out.flush())
    {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write {
            path: "standard output".into(),
            source: e,
        }),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Whether only results, warnings and errors are told (`--quiet`).
static QUIET: AtomicBool = AtomicBool::new(false);

/// From now on, nothing is told but results, warnings and errors.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a line to the standard error, as harmless as [`print()`] does, unless only warnings and errors are told.
pub fn note(line: &str) {
    if !is_quiet() {
        alert(line);
    }
}

/// Prints a line of a warning or an error to the standard error. If that fails, nobody can be told, and the work goes
/// on.
pub fn alert(line: &str) {
    above_the_bar(|| {
        let _ = writeln!(std::io::stderr().lock(), "{}", harmless(line));
    });
}

fn above_the_bar(write: impl FnOnce()) {
    match &*BAR.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Logs by another logger, with texts as harmless as [`print()`] prints, but each warning only once: a warning of a
/// robot would come again with every replay.
pub struct Once<L> {
    logger: L,
    told: Mutex<HashSet<String>>,
}

impl<L: Log> Once<L> {
    pub fn new(logger: L) -> Self {
        Self {
            logger,
            told: Mutex::default(),
        }
    }
}

impl<L: Log> Log for Once<L> {
    fn enabled(&self, metadata: &Metadata) -> bool {
        self.logger.enabled(metadata)
    }

    fn log(&self, record: &Record) {
        let text = record.args().to_string();
        if !self.enabled(record.metadata()) {
            return;
        }
        // A user who asks for more than warnings wants every message.
        if record.level() <= Level::Warn {
            let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
            if !told.insert(text.clone()) {
                return;
            }
        }
        let shown = harmless(&text);
        let (metadata, module) = (record.metadata().clone(), record.module_path());
        above_the_bar(|| {
            let args = format_args!("{shown}");
            self.logger.log(
                &Record::builder()
                    .metadata(metadata)
                    .module_path(module)
                    .args(args)
                    .build(),
            );
        });
    }

    fn flush(&self) {
        self.logger.flush();
    }
}

/// Prints sentences as [`note`] does, in lines that fit the terminal. `mark` stands before the first line.
pub fn tell(mark: &str, sentences: &str) {
    note(wrapped(mark, sentences).trim_end());
}

/// Whether a command that a result keeps may be started, and says which one. If this machine has not made the result,
/// it asks, unless `is_allowed`; where there is no terminal, it may not.
pub fn may_start(kept: &Kept, is_allowed: bool) -> bool {
    let Kept {
        file,
        command,
        made,
    } = kept;
    if *made == Made::Now {
        return true;
    }
    alert(&format!("{file}: its controller is the program: {command}"));
    if *made == Made::Earlier || is_allowed {
        return true;
    }
    let mut stdin = std::io::stdin().lock();
    if !(stdin.is_terminal() && std::io::stderr().is_terminal()) {
        return false;
    }
    alert(
        "This machine has not made the files of this result, and a program may do anything. Start it? [y/N]",
    );
    let mut answer = String::new();
    stdin.read_line(&mut answer).is_ok()
        && ["y", "yes"].contains(&answer.trim().to_lowercase().as_str())
}

/// Prints sentences of a warning or an error as [`alert`] does, in lines that fit the terminal.
pub fn warn(mark: &str, sentences: &str) {
    alert(wrapped(mark, sentences).trim_end());
}

/// Prints the notes that follow above this progress bar; None if there is no bar any more.
pub fn make_way_for(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = bar;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    struct Count(AtomicUsize);

    impl Log for Count {
        fn enabled(&self, metadata: &Metadata) -> bool {
            metadata.level() <= Level::Info
        }

        fn log(&self, _: &Record) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }

        fn flush(&self) {}
    }

    #[test]
    fn a_warning_is_told_once() {
        let once = Once::new(Count(AtomicUsize::new(0)));
        let [mesh, joint, waits] = [("warn", "no mesh"), ("warn", "no joint"), ("info", "waits")];
        for (level, text) in [mesh, mesh, waits, joint, mesh, waits] {
            once.log(
                &Record::builder()
                    .level(level.parse().unwrap())
                    .args(format_args!("{text}"))
                    .build(),
            );
        }
        assert_eq!(once.logger.0.into_inner(), 4);
    }
}
