//! Progress and cancellation of long work, shared by the worker threads and an observer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::error::RenderError;

/// Progress counter and cancellation flag of one piece of work. Every method may be called from any thread at any
/// time.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: Arc<AtomicBool>,
    /// Flag of a parent control; cancelling the parent also cancels this work.
    outside: Option<Arc<AtomicBool>>,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Control {
    /// Returns the control of work that has not started.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the control of work that is cancelled together with `self`; cancelling that work does not cancel `self`.
    pub fn of_call(&self) -> Self {
        Self { outside: Some(self.cancelled.clone()), ..Self::default() }
    }

    /// Returns the control of a part of the work, which is cancelled together with the work and has its own progress.
    pub(crate) fn part(&self) -> Self {
        Self { cancelled: self.cancelled.clone(), outside: self.outside.clone(), ..Self::default() }
    }

    /// Requests cancellation. The work ends within milliseconds with [`RenderError::Cancelled`].
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// True after [`Control::cancel`].
    pub fn is_cancelled(&self) -> bool {
        let is_set = |flag: &Arc<AtomicBool>| flag.load(Ordering::Relaxed);
        is_set(&self.cancelled) || self.outside.as_ref().is_some_and(is_set)
    }

    /// Number of finished units of work, such as samples of a tile, tasks of a query, or meshes.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Total number of units of work; 0 before the work has started.
    pub fn total(&self) -> usize {
        self.total.load(Ordering::Relaxed)
    }

    pub(crate) fn start(&self, total: usize) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    pub(crate) fn advance(&self) {
        self.advance_by(1);
    }

    pub(crate) fn advance_by(&self, units: usize) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }

    pub(crate) fn check(&self) -> Result<(), RenderError> {
        if self.is_cancelled() { Err(RenderError::Cancelled) } else { Ok(()) }
    }
}
