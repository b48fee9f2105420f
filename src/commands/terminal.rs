//! Where a command prints: its result goes to the standard output, and everything else to the standard error.

use crate::error::{Error, Result};
use crate::render::text::layout::wrapped;
use indicatif::ProgressBar;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

/// The progress bar that is on the terminal. It is taken away while a note is printed.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints to the standard output, and gives the exit code of a command that ends with that. It is no error if the reader
/// has gone, as in `| head`.
pub fn print(text: &str) -> Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write { path: "standard output".into(), source: e }),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints a line to the standard error. If that fails, nobody can be told, and the work goes on.
pub fn note(line: &str) {
    let write = || {
        let _ = writeln!(std::io::stderr().lock(), "{line}");
    };
    match &*BAR.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Prints sentences to the standard error, in lines that fit the terminal. `mark` stands before the first line.
pub fn tell(mark: &str, sentences: &str) {
    note(wrapped(mark, sentences).trim_end());
}

/// Prints the notes that follow above this progress bar; None if there is no bar any more.
pub fn make_way_for(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = bar;
}
