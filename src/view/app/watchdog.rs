//! Ends the program when its window is gone and nobody will ever tell it.
//!
//! A graphics driver may wait without end for a picture to be shown in a window that was destroyed (seen with Mesa
//! under X: `poll` on a connection on which nothing comes any more). The loop is inside that call then, so another
//! thread looks whether the loop goes on.

use super::window;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{sleep, spawn};
use std::time::Duration;

const LOOK_EVERY: Duration = Duration::from_millis(500);
/// A loop that stands still for so long is asked whether its display is there,
const SUSPICIOUS: Duration = Duration::from_secs(5);
/// and one that stands still for so long is given up: no frame takes as long, in software on a busy machine either.
const HOPELESS: Duration = Duration::from_secs(60);
/// What the count of frames is when the loop has ended.
const OVER: u64 = u64::MAX;

/// Watches a loop until it is dropped.
pub struct Watchdog(Arc<AtomicU64>);

impl Watchdog {
    pub fn start() -> Self {
        let frames = Arc::new(AtomicU64::new(0));
        let watched = frames.clone();
        spawn(move || watch(&watched));
        Self(frames)
    }

    /// The loop goes on.
    pub fn beat(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.0.store(OVER, Ordering::Relaxed);
    }
}

fn watch(frames: &AtomicU64) {
    // Looks are counted, not the time: that goes on while the program is stopped.
    let (mut seen, mut looks) = (0, 0);
    loop {
        sleep(LOOK_EVERY);
        looks += 1;
        let now = frames.load(Ordering::Relaxed);
        if now == OVER {
            return;
        }
        if now != seen {
            (seen, looks) = (now, 0);
            continue;
        }
        let stood = LOOK_EVERY * looks;
        let cause = match window::display() {
            Err(missing) if stood > SUSPICIOUS => missing,
            _ if stood > HOPELESS => format!("no frame for {:.0} s", stood.as_secs_f64()),
            _ => continue,
        };
        let error = window::lost(cause);
        eprintln!("error: {error}");
        // The thread of the loop will not come back.
        std::process::exit(error.exit_code().into());
    }
}
