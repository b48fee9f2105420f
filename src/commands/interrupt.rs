//! Ctrl-C: the first lets running episodes end, so that what is finished is kept.

use super::terminal::note;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C (or SIGTERM).
pub static STOP: AtomicBool = AtomicBool::new(false);

/// From here on the first Ctrl-C (or SIGTERM) sets [`STOP`]; the second ends at once.
pub fn stop_on_ctrl_c() {
    let handler = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        note("stopping as soon as the running episodes end; press Ctrl-C again to end at once");
    };
    if let Err(e) = ctrlc::set_handler(handler) {
        log::warn!("Ctrl-C cannot be caught, and loses what is in work: {e}");
    }
}
