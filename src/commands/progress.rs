//! How far a campaign or a search is: a bar on a terminal, a line now and then elsewhere; on the standard error.

use super::terminal::note;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Counts finished episodes (or whatever is worked off) from any thread.
pub struct Progress {
    bar: Option<ProgressBar>,
    what: &'static str,
    total: u64,
    /// "at most " if fewer may do, else nothing.
    at_most: &'static str,
    done: AtomicU64,
    start: Instant,
}

impl Progress {
    /// Starts the clock for `total` of what is counted, e.g. episodes; `at_most`: fewer may do.
    pub fn start(total: u64, what: &'static str, at_most: bool) -> Self {
        let at_most = if at_most { "at most " } else { "" };
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = format!("{{bar:20}} {{pos}}/{{len}} {{msg}}  {{per_sec}}  {{elapsed}}, {at_most}{{eta}} to go");
            let bar = ProgressBar::new(total);
            bar.set_style(ProgressStyle::with_template(&style).unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_message(what);
            bar
        });
        let progress = Self { bar, what, total, at_most, done: AtomicU64::new(0), start: Instant::now() };
        if progress.bar.is_none() {
            note(&format!("{at_most}{total} {what} to run"));
        }
        progress
    }

    /// One more is finished.
    pub fn tick(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(bar) = &self.bar {
            bar.inc(1);
        } else if done < self.total && done * 10 / self.total != (done - 1) * 10 / self.total {
            let elapsed_s = self.start.elapsed().as_secs_f64();
            let left_s = elapsed_s / done as f64 * (self.total - done) as f64;
            let Self { total, what, at_most, .. } = self;
            note(&format!("{done}/{total} {what}, {:.1}/s, {at_most}{left_s:.0} s to go", done as f64 / elapsed_s));
        }
    }

    /// A line in between.
    pub fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| note(line)),
            None => note(line),
        }
    }

    /// Takes the bar away and says how long it took.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let (done, elapsed_s) = (self.done.load(Ordering::Relaxed), self.start.elapsed().as_secs_f64());
        note(&format!("{done} {} in {elapsed_s:.1} s: {:.1}/s", self.what, done as f64 / elapsed_s.max(1e-9)));
    }
}
