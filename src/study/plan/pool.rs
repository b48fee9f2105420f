//! The threads on which episodes run.

use rayon::ThreadPool;
use standfast_controllers::turns::{self, Turns};
use standfast_core::error::{Error, Result};
use std::sync::Arc;

/// Threads for jobs.
pub(crate) struct Pool {
    pool: ThreadPool,
    /// Number of threads that compute at once.
    pub threads: usize,
}

/// A pool in which `threads` threads compute at once; 0 means one for each core. It has a thread for each of `open`
/// episodes, if these are more; and if `open` is not 0, no more threads than such controllers serve.
pub(crate) fn pool(threads: usize, open: usize) -> Result<Pool> {
    let pool = started(rayon::ThreadPoolBuilder::new().num_threads(threads))?;
    let all = pool.current_num_threads();
    let threads = match open {
        0 => all,
        _ => all.min(turns::most_threads(open)),
    };
    if threads == all && open <= threads {
        return Ok(Pool { pool, threads });
    }
    let turns = Arc::new(Turns::new(threads));
    let take_part = move |_| turns::take_part(Arc::clone(&turns));
    let builder = rayon::ThreadPoolBuilder::new()
        .num_threads(open.max(threads))
        .start_handler(take_part);
    let pool = started(builder)?;
    Ok(Pool { pool, threads })
}

fn started(builder: rayon::ThreadPoolBuilder) -> Result<ThreadPool> {
    let remedy = "raise the limit of processes and threads (`ulimit -u`), or take fewer --threads or a smaller `batch` \
                  of Python objects";
    builder
        .build()
        .map_err(|e| Error::Machine(format!("the threads cannot be started: {e}; {remedy}")))
}

impl Pool {
    /// Calls `f` on a thread of the pool.
    pub fn install<T: Send>(&self, f: impl FnOnce() -> T + Send) -> T {
        self.pool.install(f)
    }
}
