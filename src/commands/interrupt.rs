//! Ctrl-C (SIGINT) and termination (SIGTERM): the first lets the running episodes end, so that finished work is kept; the
//! second ends the program at once.
//!
//! A cluster terminates a task that has reached its time limit, or whose node is needed for something else. Such a task
//! has done nothing wrong, and is to be run again, which its exit code says.

use super::terminal::note;
use crate::error::{Error, TRY_AGAIN};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first signal.
pub static STOP: AtomicBool = AtomicBool::new(false);
/// Whether that was a termination.
static TERMINATED: AtomicBool = AtomicBool::new(false);

/// From now on the first signal sets [`STOP`], and the second ends the program at once.
pub fn stop_on_ctrl_c() {
    let mut signals = match Signals::new([SIGINT, SIGTERM]) {
        Ok(signals) => signals,
        Err(e) => {
            log::warn!("Ctrl-C cannot be caught ({e}): it ends the program at once, and the running episodes are lost");
            return;
        }
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            TERMINATED.fetch_or(signal == SIGTERM, Ordering::Relaxed);
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(exit_code(&Error::Interrupted).into());
            }
            let again = if signal == SIGINT { "; press Ctrl-C again to end at once" } else { "" };
            note(&format!("stopping as soon as what is running ends{again}"));
        }
    });
}

/// The exit code of the program after an error.
pub fn exit_code(error: &Error) -> u8 {
    let is_terminated = matches!(error, Error::Interrupted) && TERMINATED.load(Ordering::Relaxed);
    if is_terminated { TRY_AGAIN } else { error.exit_code() }
}
