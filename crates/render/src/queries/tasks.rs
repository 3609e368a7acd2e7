//! Parallel tasks of a query.

use std::ops::Range;

use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::thread_pool::{MAX_WORK_HERE, Workers};

/// Number of rays or points per task.
pub(super) const PER_TASK: usize = 4096;
/// Number of rays or points whose results are kept before they are appended; limits the additional memory.
const PER_BLOCK: usize = 1 << 18;

/// Estimated time on one thread, in nanoseconds, of a ray that stops at its first hit.
pub(super) const NS_PER_RAY: f64 = 300.0;
/// Estimated time on one thread, in nanoseconds, of a ray whose hits are all returned.
pub(super) const NS_PER_ALL_HITS_RAY: f64 = 1000.0;

/// True if the calling thread alone can process this many rays or points, which take `each` nanoseconds, in a fraction
/// of a millisecond.
pub(super) fn is_brief(n: usize, each: f64) -> bool {
    each * n as f64 <= MAX_WORK_HERE
}

/// Runs `work` for ranges of 0..`n`, in a pool or, if the work is brief, on the calling thread. A ray or point takes
/// `each` nanoseconds. `append` receives the answers in order. Brief `work` must not use rayon.
pub(super) fn in_tasks<T: Send>(
    (n, each): (usize, f64),
    threads: Option<usize>,
    control: &Control,
    work: impl Fn(Range<usize>) -> T + Sync,
    mut append: impl FnMut(T) + Send,
) -> Result<(), RenderError> {
    let workers = &Workers::for_work(threads, each * n as f64, each.is_finite())?;
    control.start(n.div_ceil(PER_TASK));
    workers.run(|| {
        for block in (0..n).step_by(PER_BLOCK) {
            let end = n.min(block + PER_BLOCK);
            let tasks: Vec<Range<usize>> =
                (block..end).step_by(PER_TASK).map(|first| first..end.min(first + PER_TASK)).collect();
            let answer = |range| {
                control.check()?;
                let answer = work(range);
                control.advance();
                Ok(answer)
            };
            let answers: Result<Vec<T>, RenderError> = match workers {
                Workers::Here => tasks.into_iter().map(answer).collect(),
                Workers::Pool(..) => tasks.into_par_iter().map(answer).collect(),
            };
            answers?.into_iter().for_each(&mut append);
        }
        Ok(())
    })
}

/// Same as [`in_tasks`], except that each range has [`PER_TASK`] rays or points and `work` receives the range's part of
/// the answers, which it writes.
pub(super) fn fill_in_tasks<P: Send>(
    (n, each): (usize, f64),
    threads: Option<usize>,
    control: &Control,
    parts: Vec<P>,
    work: impl Fn(Range<usize>, P) + Sync,
) -> Result<(), RenderError> {
    let workers = &Workers::for_work(threads, each * n as f64, each.is_finite())?;
    control.start(parts.len());
    let task = |(i, part): (usize, P)| {
        control.check()?;
        let first = i * PER_TASK;
        work(first..n.min(first + PER_TASK), part);
        control.advance();
        Ok(())
    };
    workers.run(|| match workers {
        Workers::Here => parts.into_iter().enumerate().try_for_each(task),
        Workers::Pool(..) => parts.into_par_iter().enumerate().try_for_each(task),
    })
}
