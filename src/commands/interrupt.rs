//! Ctrl-C: the first lets the running episodes end, so that finished work is kept; the second ends the program at once.

use super::terminal::note;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C (or SIGTERM).
pub static STOP: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C (or SIGTERM) sets [`STOP`], and the second ends the program at once.
pub fn stop_on_ctrl_c() {
    let handler = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        note("stopping as soon as the running episodes end; press Ctrl-C again to end at once");
    };
    if let Err(e) = ctrlc::set_handler(handler) {
        log::warn!("Ctrl-C cannot be caught ({e}): it ends the program at once, and the running episodes are lost");
    }
}
