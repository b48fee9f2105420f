//! The threads on which episodes run.

use rayon::ThreadPool;
use standfast_core::error::{Error, Result};

/// A pool of `threads` threads; 0 means one for each core.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let remedy = "raise the limit of processes and threads (`ulimit -u`), or take fewer --threads";
    pool.map_err(|e| Error::Machine(format!("the threads cannot be started: {e}; {remedy}")))
}
