//! Parallel tasks of a query.

use std::ops::Range;

use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::thread_pool::Workers;

/// Rays or points of one task.
const PER_TASK: usize = 4096;
/// Rays or points whose answers wait to be appended: bounds the memory beside the answers.
const PER_BLOCK: usize = 1 << 18;

/// Runs `work` for ranges of 0..`n` in a pool, and `append` with the answers in order.
pub(super) fn in_tasks<T: Send>(
    n: usize,
    threads: Option<usize>,
    control: &Control,
    work: impl Fn(Range<usize>) -> T + Sync,
    append: impl FnMut(T) + Send,
) -> Result<(), RenderError> {
    in_tasks_by(&Workers::for_work(threads, f64::INFINITY, false)?, n, control, work, append)
}

/// [`in_tasks`] by these threads; on the calling one, `work` must not use rayon.
pub(super) fn in_tasks_by<T: Send>(
    workers: &Workers,
    n: usize,
    control: &Control,
    work: impl Fn(Range<usize>) -> T + Sync,
    mut append: impl FnMut(T) + Send,
) -> Result<(), RenderError> {
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
