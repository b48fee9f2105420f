//! Where a command prints: its result goes to the standard output, and everything else to the standard error.

use crate::error::{Error, Result};
use crate::foreign::harmless;
use crate::render::text::layout::wrapped;
use indicatif::ProgressBar;
use log::{Level, Log, Metadata, Record};
use std::collections::HashSet;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

/// The progress bar that is on the terminal. It is taken away while a note is printed.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints to the standard output, where no foreign text commands the terminal, and gives the exit code of a command that ends
/// with that. It is no error if the reader has gone, as in `| head`.
pub fn print(text: &str) -> Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    match out.write_all(harmless(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write { path: "standard output".into(), source: e }),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints a line to the standard error, as harmless as [`print`] does. If that fails, nobody can be told, and the work goes
/// on.
pub fn note(line: &str) {
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

/// Logs by another logger, as harmless as [`print`] prints, but each warning only once: that of a robot would else come again with every replay of it.
pub struct Once<L> {
    logger: L,
    told: Mutex<HashSet<String>>,
}

impl<L: Log> Once<L> {
    pub fn new(logger: L) -> Self {
        Self { logger, told: Mutex::default() }
    }
}

impl<L: Log> Log for Once<L> {
    fn enabled(&self, metadata: &Metadata) -> bool {
        self.logger.enabled(metadata)
    }

    fn log(&self, record: &Record) {
        let text = record.args().to_string();
        let is_new = || self.told.lock().unwrap_or_else(PoisonError::into_inner).insert(text.clone());
        // Whoever asks for more than warnings wants all of it.
        if self.enabled(record.metadata()) && (record.level() > Level::Warn || is_new()) {
            let shown = harmless(&text);
            let (metadata, module) = (record.metadata().clone(), record.module_path());
            above_the_bar(|| {
                let args = format_args!("{shown}");
                self.logger.log(&Record::builder().metadata(metadata).module_path(module).args(args).build());
            });
        }
    }

    fn flush(&self) {
        self.logger.flush();
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

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
            once.log(&Record::builder().level(level.parse().unwrap()).args(format_args!("{text}")).build());
        }
        assert_eq!(once.logger.0.into_inner(), 4);
    }
}
