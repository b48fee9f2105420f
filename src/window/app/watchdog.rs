//! Ends the program if its window is lost and the loop waits forever.
//!
//! A graphics driver may wait forever for a picture to be shown in a window that was destroyed. (This was seen with
//! Mesa under X, in `poll` on a dead connection.) The loop then waits within this call, so another thread checks
//! whether the loop advances.

use super::window;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{sleep, spawn};
use std::time::Duration;

/// Time between two checks.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// Time of standstill of the loop after which the watchdog checks whether the display still answers.
const SUSPICIOUS: Duration = Duration::from_secs(5);
/// Time of standstill of the loop after which the window is given up. Even in software on a busy machine, no frame
/// takes this long.
const HOPELESS: Duration = Duration::from_secs(60);
/// Value of the frame counter after the loop has ended.
const OVER: u64 = u64::MAX;

/// Watches the loop until it is dropped.
pub struct Watchdog(Arc<AtomicU64>);

impl Watchdog {
    pub fn start() -> Self {
        let frames = Arc::new(AtomicU64::new(0));
        let watched = frames.clone();
        spawn(move || watch(&watched));
        Self(frames)
    }

    /// Reports that the loop has drawn a frame.
    pub fn beat(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.0.store(OVER, Ordering::Relaxed);
    }
}

/// Checks the frame counter until the loop ends, or ends the program.
fn watch(frames: &AtomicU64) {
    // Checks are counted instead of time, which also passes while the program is stopped.
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
        // The thread of the loop cannot be ended in any other way.
        std::process::exit(error.exit_code().into());
    }
}
