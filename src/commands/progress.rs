//! Shows how far a campaign or a search is. On a terminal there is a bar, and above it what was found so far; in a log
//! there is a line now and then. Both go to the standard error.

use super::terminal::{is_quiet, make_way_for, note};
use console::Term;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use standfast_report::foreign::harmless;
use standfast_report::text::layout::{wrapped, wrapped_to};
use standfast_report::text::so_far;
use standfast_study::verdict::so_far::SoFar;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Time before which no rate and no time to go is told (s), because the first episode alone says little.
const FIRST_S: f64 = 1.0;
/// Width of the narrowest bar with the space after it (columns).
const BAR_COLUMNS: usize = 5;
/// Shortest time between two texts of what was found on a terminal (s).
const SHOWN_EVERY_S: f64 = 0.25;
/// Number of equal parts of the work after each of which a line is written where there is no terminal.
const LINES: u64 = 10;

/// Counts what is finished, from any thread: episodes, or other things such as searches, each of which takes many
/// episodes.
pub struct Progress {
    bar: Option<ProgressBar>,
    what: &'static str,
    /// Whether episodes are what is counted.
    of_episodes: bool,
    total: AtomicU64,
    /// How much of the total was finished before the start.
    there: u64,
    /// Whether the work may end before the total is reached.
    at_most: bool,
    done: AtomicU64,
    episodes: AtomicU64,
    start: Instant,
    /// On a terminal, the last time at which it showed what was found.
    shown: Mutex<Option<Instant>>,
    /// In a log, the last text about what was found.
    last_text: Mutex<String>,
}

impl Progress {
    /// Starts the clock for `total` episodes, of which some are `there` already; with `at_most`, fewer may be enough.
    pub fn of_episodes(total: u64, there: u64, at_most: bool) -> Self {
        Self::new("episodes", true, total, there, at_most)
    }

    /// Starts the clock for other things, such as searches, each of which takes many episodes; some are `there` already.
    pub fn of(total: u64, there: u64, what: &'static str) -> Self {
        Self::new(what, false, total, there, false)
    }

    /// Starts the clock for other things, each of which takes one episode.
    pub fn of_each(total: u64, what: &'static str) -> Self {
        Self::new(what, true, total, 0, false)
    }

    fn new(what: &'static str, of_episodes: bool, total: u64, there: u64, at_most: bool) -> Self {
        let bar = (std::io::stderr().is_terminal() && !is_quiet())
            .then(|| ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden()));
        let progress = Self {
            bar,
            what,
            of_episodes,
            total: total.into(),
            there,
            at_most,
            done: 0.into(),
            episodes: 0.into(),
            start: Instant::now(),
            shown: Mutex::default(),
            last_text: Mutex::default(),
        };
        match &progress.bar {
            Some(bar) => {
                bar.set_style(style("{wide_bar} {msg}"));
                progress.renew();
                bar.set_draw_target(ProgressDrawTarget::stderr());
                make_way_for(Some(bar.clone()));
                progress.renew();
            }
            None => note(&progress.line()),
        }
        progress
    }

    /// Counts one more finished episode.
    pub fn episode(&self) {
        self.episode_and(|| ());
    }

    /// Counts one more finished episode, and calls `on_line` if a line was written to a log: what was found may follow
    /// it.
    pub fn episode_and(&self, on_line: impl FnOnce()) {
        self.episodes.fetch_add(1, Ordering::Relaxed);
        if !self.of_episodes {
            self.renew();
        } else if self.count() {
            on_line();
        }
    }

    /// Counts one more finished thing of the kind that is counted.
    pub fn tick(&self) {
        self.count();
    }

    /// Counts one more, and returns whether a line was written to a log.
    fn count(&self) -> bool {
        let (done, total) = (
            self.there + self.done.fetch_add(1, Ordering::Relaxed) + 1,
            self.total(),
        );
        self.renew();
        let has_line = self.bar.is_none()
            && done < total
            && done * LINES / total != (done - 1) * LINES / total;
        if has_line {
            note(&self.line());
        }
        has_line
    }

    /// Changes the total, which may become smaller while a campaign that ends when decided runs.
    pub fn set_total(&self, total: u64) {
        self.total
            .store(total.max(self.there + self.done()), Ordering::Relaxed);
        if let Some(bar) = &self.bar {
            bar.set_length(self.total());
        }
        self.renew();
    }

    /// Whether it is time for a terminal to show again what was found, which takes some time to compute.
    pub fn is_due(&self) -> bool {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let is_due = self.bar.is_some()
            && shown.is_none_or(|shown| shown.elapsed().as_secs_f64() > SHOWN_EVERY_S);
        if is_due {
            *shown = Some(Instant::now());
        }
        is_due
    }

    /// Shows what a campaign has found so far: above the bar of a terminal; in a log as a line, if that is new.
    pub fn show(&self, so_far: &SoFar) {
        let text = so_far::sentence(so_far);
        if let (Some(bar), false) = (&self.bar, text.is_empty()) {
            bar.set_style(style("{prefix}\n{wide_bar} {msg}"));
            bar.set_prefix(
                wrapped_to(columns().min(80), "", &harmless(&text))
                    .trim_end()
                    .to_string(),
            );
            // The call draws at once; the changes of single episodes are not all drawn.
            return bar.suspend(|| {});
        }
        let mut before = self
            .last_text
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if self.bar.is_none() && *before != text {
            note(wrapped("  ", &text).trim_end());
            *before = text;
        }
    }

    /// Whether the progress is shown on a terminal, where it is renewed at any time.
    pub fn is_on_terminal(&self) -> bool {
        self.bar.is_some()
    }

    fn total(&self) -> u64 {
        self.total.load(Ordering::Relaxed)
    }

    /// How much was finished since the start.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }

    /// Time that the whole work takes at the pace so far (s), without what was there before the start.
    pub fn whole_s(&self) -> f64 {
        self.time_of_s(self.total() - self.there)
    }

    /// Time that `count` episodes or other counted things take at the pace so far (s).
    pub fn time_of_s(&self, count: u64) -> f64 {
        self.start.elapsed().as_secs_f64() * count as f64 / self.done().max(1) as f64
    }

    /// Takes the bar away and says how long the work took.
    pub fn finish(&self) {
        make_way_for(None);
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let (done, elapsed_s) = (self.done(), self.start.elapsed().as_secs_f64());
        let rate = self.rate().unwrap_or_default();
        note(&format!(
            "{done} {}{} in {}{rate}",
            self.what,
            self.of_many(),
            duration(elapsed_s)
        ));
    }

    /// The number of episodes so far, in words, where something else is counted.
    fn of_many(&self) -> String {
        match self.episodes.load(Ordering::Relaxed) {
            episodes if !self.of_episodes && episodes > 0 => format!(", {episodes} episodes"),
            _ => String::new(),
        }
    }

    fn renew(&self) {
        if let Some(bar) = &self.bar {
            bar.set_position(self.there + self.done());
            bar.set_message(
                self.line()
                    .chars()
                    .take(columns().saturating_sub(BAR_COLUMNS))
                    .collect::<String>(),
            );
        }
    }

    /// A line that says how far the work is and, as soon as it is known, how fast it goes and how long it still takes.
    fn line(&self) -> String {
        let (Self { there, what, .. }, total) = (self, self.total());
        let (done, at_most) = (self.done(), if self.at_most { "at most " } else { "" });
        let mut line = format!(
            "{} of {at_most}{total} {what}{}",
            there + done,
            self.of_many()
        );
        let Some(rate) = self.rate() else { return line };
        line += &rate;
        if done > 0 && there + done < total {
            let left_s = self.whole_s() - self.start.elapsed().as_secs_f64();
            line += &format!(", {} to go", duration(left_s));
        }
        line
    }

    /// The number of episodes in a second, in words; None as long as it is not known.
    fn rate(&self) -> Option<String> {
        let (episodes, elapsed_s) = (
            self.episodes.load(Ordering::Relaxed),
            self.start.elapsed().as_secs_f64(),
        );
        (episodes > 1 && elapsed_s > FIRST_S)
            .then(|| format!(", {}/s", two_digits(episodes as f64 / elapsed_s)))
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Columns of the terminal. The last one stays free, because some terminals begin a new line after it.
fn columns() -> usize {
    usize::from(Term::stderr().size().1).saturating_sub(1)
}

/// Writes a number with two significant digits.
fn two_digits(x: f64) -> String {
    let unit = 10_f64.powi(x.abs().max(1e-3).log10().floor() as i32 - 1);
    let rounded = (x / unit).round() * unit;
    let digits = if rounded < 0.0995 {
        3
    } else if rounded < 0.995 {
        2
    } else {
        usize::from(rounded < 9.95)
    };
    format!("{rounded:.digits$}")
}

/// Writes a time in the units in which people say it: 9.5 s, 45 s, 13 min, 2 h 5 min.
pub fn duration(time_s: f64) -> String {
    let minutes = (time_s / 60.0).round() as u64;
    match time_s {
        ..9.95 => format!("{time_s:.1} s"),
        ..99.5 => format!("{time_s:.0} s"),
        ..5970.0 => format!("{minutes} min"),
        _ => format!("{} h {} min", minutes / 60, minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_two_digits_and_times_are_said_in_their_unit() {
        let told = [0.0123, 0.344, 0.999, 3.41, 9.96, 34.4, 1234.0].map(two_digits);
        assert_eq!(told, ["0.012", "0.34", "1.0", "3.4", "10", "34", "1200"]);
        let told = [0.0, 9.94, 45.4, 100.0, 780.0, 7500.0].map(duration);
        assert_eq!(
            told,
            ["0.0 s", "9.9 s", "45 s", "2 min", "13 min", "2 h 5 min"]
        );
    }

    #[test]
    fn what_is_there_counts_and_nothing_is_said_of_a_rate_before_there_is_one() {
        let progress = |there, done, episodes: u64, ago_s| Progress {
            bar: None,
            what: "episodes",
            of_episodes: true,
            total: 4000.into(),
            there,
            at_most: there == 0,
            done: AtomicU64::new(done),
            episodes: episodes.into(),
            start: Instant::now() - std::time::Duration::from_secs(ago_s),
            shown: Mutex::default(),
            last_text: Mutex::default(),
        };
        assert_eq!(progress(0, 0, 0, 100).line(), "0 of at most 4000 episodes");
        assert_eq!(progress(0, 2, 2, 0).line(), "2 of at most 4000 episodes");
        assert_eq!(progress(1100, 0, 0, 100).line(), "1100 of 4000 episodes");
        assert_eq!(
            progress(1000, 100, 100, 25).line(),
            "1100 of 4000 episodes, 4.0/s, 12 min to go"
        );
        assert_eq!(
            progress(1000, 3000, 3000, 750).line(),
            "4000 of 4000 episodes, 4.0/s"
        );
        // A search takes many episodes, and has no time to go before the first search has ended.
        let searches = |done, episodes| {
            let progress = Progress {
                what: "searches",
                of_episodes: false,
                total: 8.into(),
                ..progress(0, done, episodes, 25)
            };
            Progress {
                at_most: false,
                ..progress
            }
            .line()
        };
        assert_eq!(searches(0, 100), "0 of 8 searches, 100 episodes, 4.0/s");
        assert_eq!(
            searches(2, 100),
            "2 of 8 searches, 100 episodes, 4.0/s, 75 s to go"
        );
    }
}
