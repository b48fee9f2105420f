//! Limits of what a file of a network may take: sizes, and work in a thread of its own that is given up if it takes too much time
//! or memory.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{Builder, current};
use std::time::{Duration, Instant};

/// Largest number of operations of a network. Large policies have some hundreds.
pub(crate) const MOST_NODES: usize = 5_000;
/// Largest number of values of a tensor: 64 MB of float32.
pub(crate) const MOST_NUMBERS: u64 = 1 << 24;
/// Longest time of the work, a hundred times as long as large policies take.
const MOST: Duration = Duration::from_secs(60);
/// Largest growth of the program's memory during the work (bytes). The memory is known on Linux only.
const MOST_BYTES: u64 = 2_000_000_000;
/// Time between two checks of time and memory.
const LOOKS_EVERY: Duration = Duration::from_millis(10);
/// Stack size of the thread (bytes). It is large because the library that reads networks recurses deeply.
const STACK_BYTES: usize = 64 << 20;
/// Name of the thread. A panic in this thread is reported by the caller, not where it happens.
const NAME: &str = "network";

/// The result of `work`. Fails, in words, if the work panics or takes too much. Work that is given up goes on until the
/// program ends, since a thread cannot be stopped.
pub fn limited<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, String> {
    within(MOST, MOST_BYTES, work)
}

fn within<T: Send + 'static>(
    most: Duration,
    most_bytes: u64,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, String> {
    leave_panics_to_the_caller();
    let (done, result) = channel();
    let (since, before) = (Instant::now(), memory_bytes());
    let thread = Builder::new().name(NAME.into()).stack_size(STACK_BYTES);
    let thread = thread.spawn(move || {
        let answer = catch_unwind(AssertUnwindSafe(work));
        // If the work was given up, nobody receives the answer.
        let _ = done.send(answer.unwrap_or_else(|panic| Err(in_words(&*panic))));
    });
    thread.map_err(|e| format!("cannot be read: no thread can be started for it: {e}"))?;
    loop {
        match result.recv_timeout(LOOKS_EVERY) {
            Ok(answer) => return answer,
            Err(RecvTimeoutError::Disconnected) => {
                return Err("cannot be read: its thread ended".into());
            }
            Err(RecvTimeoutError::Timeout) if since.elapsed() > most => {
                return Err(format!(
                    "takes more than {} s to prepare",
                    most.as_secs_f64()
                ));
            }
            Err(RecvTimeoutError::Timeout)
                if memory_bytes().saturating_sub(before) > most_bytes =>
            {
                return Err(format!(
                    "takes more than {} MB of memory to prepare",
                    most_bytes / 1_000_000
                ));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// The first line of a panic's message.
fn in_words(panic: &(dyn Any + Send)) -> String {
    let text = panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let line = text
        .and_then(|text| text.lines().next())
        .unwrap_or("without a message");
    format!("cannot be prepared: the library that reads networks panics: {line:.200}")
}

fn leave_panics_to_the_caller() {
    static DONE: Once = Once::new();
    DONE.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            if current().name() != Some(NAME) {
                usual(panic);
            }
        }));
    });
}

/// Memory in use by the program (bytes). It is 0 on systems where it is not known.
fn memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = status.lines().find_map(|line| {
        line.strip_prefix("VmRSS:")?
            .trim()
            .strip_suffix(" kB")?
            .parse()
            .ok()
    });
    kilobytes.map_or(0, |kilobytes: u64| 1024 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;
    use std::thread::sleep;

    #[test]
    fn a_panic_too_much_time_and_too_much_memory_are_told() {
        assert_eq!(limited(|| Ok(7)), Ok(7));
        assert_eq!(limited::<()>(|| Err("so".into())), Err("so".into()));
        let problem = limited::<()>(|| panic!("no entry\nfound")).unwrap_err();
        assert_eq!(
            problem,
            "cannot be prepared: the library that reads networks panics: no entry"
        );
        let slow = within(Duration::from_millis(50), MOST_BYTES, || {
            sleep(Duration::from_secs(2));
            Ok(())
        });
        assert_eq!(slow.unwrap_err(), "takes more than 0.05 s to prepare");
        if memory_bytes() > 0 {
            let large = within(MOST, 100_000_000, || {
                let bytes = black_box(vec![1_u8; 300_000_000]);
                sleep(Duration::from_secs(10));
                Ok(bytes[7])
            });
            assert_eq!(
                large.unwrap_err(),
                "takes more than 100 MB of memory to prepare"
            );
        }
    }
}
