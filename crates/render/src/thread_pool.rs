//! Thread pools, created on first use and kept until the process ends. They survive a fork.
//!
//! WebAssembly has no threads: the caller does all work, and rayon runs the parts one after the other.

use std::cell::Cell;
use std::collections::HashMap;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use raycam_scene::render_options::MAX_THREADS;

use crate::error::RenderError;

/// Thread pools of one process, by number of threads. A forked child inherits none of its parent's threads, so pools
/// are stored with their process id.
struct PoolCache {
    process: u32,
    by_threads: HashMap<usize, Arc<SharedPool>>,
}

/// A thread pool, and the number of calls that use the pool.
pub(crate) struct SharedPool {
    threads: rayon::ThreadPool,
    calls: AtomicUsize,
}

impl SharedPool {
    /// Counts a call until the returned guard is dropped.
    fn enter(&self) -> CountedCall<'_> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        CALLS.fetch_add(1, Ordering::Relaxed);
        CountedCall(&self.calls)
    }
}

struct CountedCall<'a>(&'a AtomicUsize);

impl Drop for CountedCall<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
        CALLS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Number of calls that are running on all pools.
static CALLS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Number of suspended calls on this thread's stack.
    static WAITING: Cell<u32> = const { Cell::new(0) };
}

static POOLS: Mutex<Option<PoolCache>> = Mutex::new(None);

/// Runs `f` on a pool of `threads` threads (`None`: as many as this process may use). The pool is kept for the next
/// call.
///
/// A forked child creates its own pools.
///
/// # Errors
/// [`RenderError::Settings`] for an invalid number of threads, and [`RenderError::Threads`] if the threads
/// cannot be started.
pub fn with_pool<T: Send>(threads: Option<usize>, f: impl FnOnce() -> T + Send) -> Result<T, RenderError> {
    let threads = checked_threads(threads)?;
    if !HAS_THREADS {
        return Ok(f());
    }
    let pool = pool(threads)?;
    let _call = pool.enter();
    Ok(pool.threads.install(f))
}

/// Runs `f` in the current pool, or in one of this crate's pools: rayon's global pool does not survive a fork.
///
/// # Errors
/// Errors of [`with_pool`].
pub(crate) fn in_pool<T: Send>(f: impl FnOnce() -> T + Send) -> Result<T, RenderError> {
    if rayon::current_thread_index().is_some() { Ok(f()) } else { with_pool(None, f) }
}

const HAS_THREADS: bool = !cfg!(target_family = "wasm");

/// Threads on which a call runs. Results do not depend on the threads.
pub(crate) enum Workers {
    /// Only the calling thread. Work that runs here must not use rayon (whose own pool would not survive a fork),
    /// unless there are no threads.
    Here,
    /// A pool, of which this many threads are used.
    Pool(Arc<SharedPool>, usize),
}

/// Work, in nanoseconds, up to which only the calling thread is used, because waking other threads would take as long.
pub(crate) const MAX_WORK_HERE: f64 = 0.4e6;
/// Minimum work per thread, in nanoseconds.
const WORK_PER_THREAD: f64 = 0.2e6;
/// Time after which a call yields to other calls waiting for the same threads, such as a small image while a large
/// image is rendered.
const TURN: Duration = Duration::from_millis(10);
/// Maximum number of calls suspended on one thread, whose stack contains them: a nested call takes up to 400 KiB.
const MOST_WAITING: u32 = 8;
/// Stack size of a thread; untouched pages take no memory.
const STACK_BYTES: usize = 8 << 20;

impl Workers {
    /// Chooses threads for an estimated time of work in nanoseconds: at most `threads` (`None`: all that this
    /// process may use), and no more than are worth waking. Brief work runs on the calling thread if
    /// `may_run_here` is true.
    ///
    /// # Errors
    /// Errors of [`with_pool`].
    pub fn for_work(threads: Option<usize>, work: f64, may_run_here: bool) -> Result<Self, RenderError> {
        let threads = checked_threads(threads)?;
        if !HAS_THREADS || (may_run_here && work <= MAX_WORK_HERE) {
            return Ok(Self::Here);
        }
        let worth = (work / WORK_PER_THREAD).ceil().max(1.0);
        Ok(Self::Pool(pool(threads)?, threads.min(worth as usize)))
    }

    /// Number of threads on which a call runs.
    pub fn count(&self) -> usize {
        match self {
            Self::Here => 1,
            Self::Pool(_, threads) => *threads,
        }
    }

    /// Runs `f` on the calling thread or in the pool.
    pub fn run<T: Send>(&self, f: impl FnOnce() -> T + Send) -> T {
        match self {
            Self::Here => f(),
            Self::Pool(pool, _) => {
                let _call = pool.enter();
                pool.threads.install(f)
            }
        }
    }

    /// Runs each part on the next free thread, with scratch memory for each thread; rayon's iterators would assign
    /// consecutive parts to one thread. An error stops the other parts. Calls that need the same threads take turns.
    ///
    /// # Errors
    /// The first error of `work`.
    pub fn for_each_dynamic<S: Default, P: Sync>(
        &self,
        parts: &[P],
        work: impl Fn(&mut S, &P) -> Result<(), RenderError> + Sync,
    ) -> Result<(), RenderError> {
        let next = AtomicUsize::new(0);
        let run_thread = |gives_way: &(dyn Fn() -> bool + Sync)| {
            let mut scratch = S::default();
            while !gives_way()
                && let Some(part) = parts.get(next.fetch_add(1, Ordering::Relaxed))
            {
                work(&mut scratch, part).inspect_err(|_| next.store(parts.len(), Ordering::Relaxed))?;
            }
            Ok(())
        };
        let Self::Pool(pool, threads) = self else {
            return run_thread(&|| false);
        };
        let _call = pool.enter();
        while next.load(Ordering::Relaxed) < parts.len() {
            let start = Instant::now();
            let gives_way = || pool.calls.load(Ordering::Relaxed) > 1 && start.elapsed() > TURN;
            if *threads == pool.threads.current_num_threads() {
                pool.threads.broadcast(|_| run_thread(&gives_way)).into_iter().collect::<Result<(), _>>()?;
                continue;
            }
            let failure = Mutex::new(Ok(()));
            let run_one = || {
                if let Err(error) = run_thread(&gives_way) {
                    *failure.lock().unwrap_or_else(PoisonError::into_inner) = Err(error);
                }
            };
            pool.threads.scope(|scope| {
                for _ in 1..*threads {
                    scope.spawn(|_| run_one());
                }
                run_one();
            });
            failure.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        }
        Ok(())
    }
}

/// Runs another call that waits for this thread, in the middle of a part that may take seconds. The caller must not
/// hold a lock that the other call could need.
pub(crate) fn give_turn() {
    let waiting = WAITING.get();
    if HAS_THREADS && CALLS.load(Ordering::Relaxed) > 1 && waiting < MOST_WAITING {
        WAITING.set(waiting + 1);
        rayon::yield_now();
        WAITING.set(waiting);
    }
}

/// A value that is computed by the first thread that needs it, on a separate pool, while other threads wait. If a
/// thread waited inside its own pool, it would take up other work, which may need the value too. A forked child does
/// not wait for its parent.
#[derive(Debug, Default)]
pub(crate) struct MadeOnce<T> {
    value: OnceLock<T>,
    /// Id of the process that computes the value; 0 if no process does.
    maker: AtomicU32,
}

impl<T: Send + Sync> MadeOnce<T> {
    /// Returns the value if it has been computed.
    pub fn get(&self) -> Option<&T> {
        self.value.get()
    }

    /// Returns the value; computes it if necessary.
    pub fn get_or_make(&self, make: impl FnOnce() -> T + Send) -> &T {
        let process = if HAS_THREADS { std::process::id() } else { 1 };
        while self.value.get().is_none() && self.maker.swap(process, Ordering::Relaxed) == process {
            std::thread::sleep(Duration::from_millis(1));
        }
        if let Some(value) = self.value.get() {
            return value;
        }
        let made = on_own_pool(make).unwrap_or_else(|panic| {
            self.maker.store(0, Ordering::Relaxed);
            resume_unwind(panic)
        });
        self.value.get_or_init(|| made)
    }
}

/// Runs `f` on a new pool with as many threads as the caller's.
fn on_own_pool<T: Send>(f: impl FnOnce() -> T + Send) -> std::thread::Result<T> {
    if !HAS_THREADS {
        return Ok(f());
    }
    let threads = rayon::current_num_threads();
    let run = || pool_builder(threads).build().map(|pool| pool.install(f));
    std::thread::scope(|scope| scope.spawn(run).join())?.map_err(|error| Box::new(error.to_string()) as _)
}

fn pool_builder(threads: usize) -> rayon::ThreadPoolBuilder {
    rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES)
}

/// Number of threads that this process may use, read once: determining it opens files, which takes longer than a short
/// query.
fn available_threads() -> usize {
    static AVAILABLE: OnceLock<usize> = OnceLock::new();
    *AVAILABLE.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from))
}

fn checked_threads(threads: Option<usize>) -> Result<usize, RenderError> {
    let threads = threads.unwrap_or_else(|| available_threads().min(MAX_THREADS));
    if !(1..=MAX_THREADS).contains(&threads) {
        return Err(RenderError::settings(format!(
            "threads: {threads}; expected a whole number from 1 to {MAX_THREADS}"
        )));
    }
    Ok(threads)
}

fn pool(threads: usize) -> Result<Arc<SharedPool>, RenderError> {
    let process = std::process::id();
    {
        let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
        if pools.as_ref().is_some_and(|p| p.process != process) {
            // Pools of the parent process are leaked: their threads do not exist here, and dropping a pool would join
            // them.
            std::mem::forget(pools.take());
        }
        let known = pools.as_ref().and_then(|p| p.by_threads.get(&threads));
        if let Some(pool) = known {
            return Ok(pool.clone());
        }
    }
    // The pool is created outside the lock, so that the lock is held only briefly and a fork finds it free.
    let built = pool_builder(threads)
        .thread_name(|i| format!("raycam {i}"))
        .build()
        .map_err(|e| RenderError::Threads { threads, message: e.to_string() })?;
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_with(|| PoolCache { process, by_threads: HashMap::new() });
    Ok(pools
        .by_threads
        .entry(threads)
        .or_insert_with(|| Arc::new(SharedPool { threads: built, calls: AtomicUsize::new(0) }))
        .clone())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    #[test]
    fn stacks_are_large_enough_for_suspended_calls() {
        fn wait(calls: u32) -> u8 {
            let frame = std::hint::black_box([1_u8; 400 << 10]);
            if calls == 0 { frame[0] } else { wait(calls - 1) + frame[1] }
        }
        assert_eq!(with_pool(Some(1), || wait(MOST_WAITING)).unwrap(), 9);
        assert_eq!(with_pool(Some(1), || on_own_pool(|| wait(MOST_WAITING)).unwrap()).unwrap(), 9);
    }

    #[test]
    fn short_calls_do_not_wait_for_long_calls() {
        for threads in [1, 2] {
            let [started, is_over] = [AtomicBool::new(false), AtomicBool::new(false)];
            let order = Mutex::new(vec![]);
            std::thread::scope(|scope| {
                let run = |name, parts: usize| {
                    let workers = Workers::for_work(Some(threads), f64::INFINITY, false).unwrap();
                    let parts: Vec<usize> = (0..parts).collect();
                    let work = |_: &mut (), _: &usize| {
                        started.store(true, Ordering::Relaxed);
                        // If the short call waited for the long call, it would take at least 10 s.
                        if !is_over.load(Ordering::Relaxed) {
                            std::thread::sleep(Duration::from_millis(2));
                        }
                        Ok(())
                    };
                    workers.for_each_dynamic(&parts, work).unwrap();
                    order.lock().unwrap().push(name);
                };
                scope.spawn(move || run("much", 10_000));
                while !started.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
                run("little", 4);
                is_over.store(true, Ordering::Relaxed);
            });
            assert_eq!(*order.lock().unwrap(), ["little", "much"]);
        }
    }
}
