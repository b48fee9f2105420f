//! What a command says: what it computes goes to the standard output, all else to the standard error.

use crate::error::{Error, Result};
use crate::render::text::layout::wrapped;
use indicatif::ProgressBar;
use std::io::{ErrorKind, Write};
use std::sync::{Mutex, PoisonError};

/// The progress that is on the terminal, which makes way for what is said.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints to the standard output; a reader that has gone (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write { path: "standard output".into(), source: e }),
        _ => Ok(()),
    }
}

/// A line on the standard error; nobody there to read it is no reason to stop.
pub fn note(line: &str) {
    let write = || {
        let _ = writeln!(std::io::stderr().lock(), "{line}");
    };
    match &*BAR.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Sentences on the standard error, in lines that fit, after a mark in front of the first.
pub fn tell(mark: &str, sentences: &str) {
    note(wrapped(mark, sentences).trim_end());
}

/// From now on notes stand above this progress, until there is none.
pub fn make_way_for(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = bar;
}
