//! Progress and cancellation of long work, shared between the thread that works and the one that watches.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::error::RenderError;

/// Watches and stops one piece of work. All methods may be called from any thread at any time.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: AtomicBool,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Control {
    /// Work that nobody has stopped yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the work to stop. It ends within milliseconds with [`RenderError::Cancelled`].
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// How many units of work (batches of rays, or meshes) are done.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// How many units of work there are; 0 before the work has started.
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
        if self.is_cancelled() {
            Err(RenderError::Cancelled)
        } else {
            Ok(())
        }
    }
}
