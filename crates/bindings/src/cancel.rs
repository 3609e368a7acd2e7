//! Cancellation of long work.

use pyo3::prelude::*;
use raycam_render::Control;

/// Cancellation flag that ends the calls it is passed to, from any thread.
#[pyclass(frozen, module = "raycam._core")]
#[derive(Default)]
pub(crate) struct Cancel {
    pub(crate) control: Control,
}

#[pymethods]
impl Cancel {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Ends all calls that use it, now and later.
    fn cancel(&self) {
        self.control.cancel();
    }

    /// True after `cancel`.
    #[getter]
    fn is_cancelled(&self) -> bool {
        self.control.is_cancelled()
    }
}
