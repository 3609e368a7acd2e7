//! Long work: runs without the GIL on its own thread, while the calling thread listens for signals.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use raycam_render::{Control, RenderError};

use crate::error::{OrRaise, catch_panic, from_panic, raycam_error};

/// Interval at which signals (Ctrl-C) are checked and progress is reported.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs `work` on the calling thread if it `is_brief`, otherwise like [`run_interruptible`].
pub(crate) fn run_for_work<T: Send>(
    py: Python<'_>,
    is_brief: bool,
    cancel: Option<&Control>,
    work: impl FnOnce(&Control) -> Result<T, RenderError> + Send,
) -> PyResult<T> {
    if !is_brief {
        return run_cancellable(py, None, cancel, work);
    }
    let result = py.detach(|| catch_panic(|| work(&control_of(cancel))))?;
    py.check_signals()?;
    result.or_raise()
}

/// Returns a new control for a call; `cancel`, if given, also cancels the call.
fn control_of(cancel: Option<&Control>) -> Control {
    cancel.map_or_else(Control::new, Control::of_call)
}

/// Same as [`run_cancellable`] without a cancellation flag.
pub(crate) fn run_interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Control) -> Result<T, RenderError> + Send,
) -> PyResult<T> {
    run_cancellable(py, progress, None, work)
}

/// Runs `work` while checking for signals and reporting progress to `progress(done, total)`. An exception of a signal
/// (Ctrl-C: `KeyboardInterrupt`) or of `progress` stops the work and is raised; `cancel` also stops the work.
pub(crate) fn run_cancellable<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    cancel: Option<&Control>,
    work: impl FnOnce(&Control) -> Result<T, RenderError> + Send,
) -> PyResult<T> {
    let control = control_of(cancel);
    let poll = || {
        Python::attach(|py| {
            py.check_signals()?;
            match (progress, control.total()) {
                (Some(progress), total) if total > 0 => {
                    progress.call1(py, (control.done().min(total), total)).map(drop)
                }
                _ => Ok(()),
            }
        })
    };
    py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let control = &control;
            let worker = scope.spawn(move || {
                // Sending does not fail: the receiver outlives this thread.
                let _ = sender.send(work(control));
            });
            let mut stopped = None;
            let result = loop {
                match receiver.recv_timeout(POLL_INTERVAL) {
                    Ok(result) => break Some(result),
                    Err(RecvTimeoutError::Disconnected) => break None,
                    Err(RecvTimeoutError::Timeout) if stopped.is_none() => {
                        if let Err(error) = poll() {
                            control.cancel();
                            stopped = Some(error);
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            };
            if let Err(payload) = worker.join() {
                return Err(from_panic(&*payload));
            }
            if let Some(error) = stopped {
                return Err(error);
            }
            let result = result.ok_or_else(|| raycam_error("the work ended without a result".into()))?;
            let value = result.or_raise()?;
            poll()?;
            Ok(value)
        })
    })
}
