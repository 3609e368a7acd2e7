//! Thread pools, built on first use and kept for the process. They survive a fork.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::RenderError;

/// Thread pools of one process, by number of threads. A forked child inherits none of its parent's threads, hence the
/// process id.
struct PoolCache {
    process: u32,
    by_threads: HashMap<usize, Arc<rayon::ThreadPool>>,
}

static POOLS: Mutex<Option<PoolCache>> = Mutex::new(None);

/// Largest number of threads that can be requested.
pub const MAX_THREADS: usize = 1024;

/// Runs `f` on a pool of `threads` threads (`None`: as many as this process may use). The pool is kept for the next
/// call.
///
/// A forked child builds pools of its own.
pub fn with_pool<T: Send>(threads: Option<usize>, f: impl FnOnce() -> T + Send) -> Result<T, RenderError> {
    let available = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or_else(|| available().min(MAX_THREADS));
    if !(1..=MAX_THREADS).contains(&threads) {
        return Err(RenderError::Settings(format!("threads is {threads}; expected 1 to {MAX_THREADS}")));
    }
    Ok(pool(threads)?.install(f))
}

fn pool(threads: usize) -> Result<Arc<rayon::ThreadPool>, RenderError> {
    let process = std::process::id();
    {
        let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
        if pools.as_ref().is_some_and(|p| p.process != process) {
            // Pools of the parent process: their threads do not exist here, and dropping a pool would join them.
            std::mem::forget(pools.take());
        }
        let known = pools.as_ref().and_then(|p| p.by_threads.get(&threads));
        if let Some(pool) = known {
            return Ok(pool.clone());
        }
    }
    // Built outside the lock, which is therefore held briefly: a fork finds it free.
    let built = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("raycam {i}"))
        .build()
        .map_err(|e| RenderError::Threads { threads, message: e.to_string() })?;
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_with(|| PoolCache { process, by_threads: HashMap::new() });
    Ok(pools.by_threads.entry(threads).or_insert_with(|| Arc::new(built)).clone())
}
