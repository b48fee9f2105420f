//! Ctrl-C (SIGINT) and termination (SIGTERM, or SIGHUP when the terminal closes). The first signal lets the running
//! episodes end, so that finished work is kept, except episodes that wait for the answer of a process; the second
//! signal ends the program at once.
//!
//! A cluster terminates a task that has reached its time limit, or whose node is needed for something else. Such a task
//! has done nothing wrong, and is to be run again, which its exit code says.

use super::terminal::alert;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use standfast_core::error::{Error, Result, TRY_AGAIN};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first signal.
pub use standfast_controllers::STOP;

/// Whether a signal was a termination (SIGTERM or SIGHUP).
static TERMINATED: AtomicBool = AtomicBool::new(false);

/// From now on the first signal sets [`STOP`], and the second ends the program at once.
pub fn stop_on_ctrl_c() {
    let hangup = (!is_hangup_ignored()).then_some(SIGHUP);
    let started = Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup))
        .and_then(|signals| std::thread::Builder::new().spawn(move || handle(signals)));
    if let Err(e) = started {
        log::warn!(
            "Ctrl-C cannot be caught ({e}): it ends the program at once, and the running episodes are lost"
        );
    }
}

/// Waits for signals, for as long as the program runs.
fn handle(mut signals: Signals) {
    for signal in signals.forever() {
        TERMINATED.fetch_or(signal != SIGINT, Ordering::Relaxed);
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(exit_code(&Error::Interrupted).into());
        }
        let again = if signal == SIGINT {
            "; press Ctrl-C again to end at once"
        } else {
            ""
        };
        alert(&format!("stopping as soon as what is running ends{again}"));
    }
}

/// Says of a search that was interrupted what is kept of it.
pub fn say_what_is_kept<T>(result: Result<T>, what: &str) -> Result<T> {
    if let Err(Error::Interrupted) = result {
        alert(&format!(
            "interrupted: finished {what} are kept, and the same command goes on from there"
        ));
    }
    result
}

/// Whether the program was started to outlast its terminal, as by `nohup`. Where there is no `/proc`, it was not.
fn is_hangup_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status
        .lines()
        .find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    ignored.is_some_and(|signals| signals >> (SIGHUP - 1) & 1 == 1)
}

/// From now on a file that exceeds the limit of its size (`ulimit -f`) is an error like a full disk, and no longer ends
/// the program (SIGXFSZ).
pub fn survive_large_files() {
    if let Err(e) = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))) {
        log::warn!("the limit of file sizes cannot be caught: {e}");
    }
}

/// The exit code of the program after an error.
pub fn exit_code(error: &Error) -> u8 {
    let is_terminated = matches!(error, Error::Interrupted) && TERMINATED.load(Ordering::Relaxed);
    if is_terminated {
        TRY_AGAIN
    } else {
        error.exit_code()
    }
}
