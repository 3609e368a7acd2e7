//! Cancellation of long work.

use pyo3::prelude::*;
use raycam_render::Control;

/// Cancellation flag. Any thread can set it, and all calls that received the flag then end.
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

    /// Ends all current and future calls that use this flag.
    fn cancel(&self) {
        self.control.cancel();
    }

    /// True after `cancel` has been called.
    #[getter]
    fn is_cancelled(&self) -> bool {
        self.control.is_cancelled()
    }
}
