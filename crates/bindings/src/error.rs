//! Errors of the Rust crates as Python exceptions.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use pyo3::exceptions::{PyMemoryError, PyOSError};
use pyo3::prelude::*;
use raycam_formats::{FormatError, broken_link};
use raycam_render::RenderError;
use raycam_scene::{ErrorCode, Message, SceneError};

mod python {
    pyo3::import_exception!(raycam.errors, Cancelled);
    pyo3::import_exception!(raycam.errors, Error);
    pyo3::import_exception!(raycam.errors, WorldError);
    pyo3::import_exception!(raycam.errors, CameraError);
    pyo3::import_exception!(raycam.errors, FormatError);
    pyo3::import_exception!(raycam.errors, SettingsError);
}

/// Sets an exception's code.
fn with_code(error: PyErr, code: ErrorCode) -> PyErr {
    Python::attach(|py| match error.value(py).setattr("code", code.name()) {
        Ok(()) => error,
        Err(failure) => failure,
    })
}

/// Creates a `raycam.Error`.
pub(crate) fn raycam_error(message: String) -> PyErr {
    with_code(python::Error::new_err(message), ErrorCode::Internal)
}

/// Creates a `raycam.SettingsError`.
pub(crate) fn settings_error(message: impl Into<Message>) -> PyErr {
    let message = message.into();
    with_code(python::SettingsError::new_err(message.to_string()), message.code_or(ErrorCode::InvalidSettings))
}

/// Converts a `raycam.WorldError` to a `raycam.SettingsError`, because the invalid value is a call's argument and not a
/// part of a world.
pub(crate) fn as_settings_error(py: Python<'_>, error: PyErr) -> PyErr {
    match error.is_instance_of::<python::WorldError>(py) {
        true => settings_error(error.value(py).to_string()),
        false => error,
    }
}

/// Creates a `raycam.CameraError`.
pub(crate) fn camera_error(message: impl Into<Message>) -> PyErr {
    let message = message.into();
    with_code(python::CameraError::new_err(message.to_string()), message.code_or(ErrorCode::InvalidCamera))
}

/// Creates a `raycam.WorldError`.
pub(crate) fn world_error(message: impl Into<Message>) -> PyErr {
    let message = message.into();
    with_code(python::WorldError::new_err(message.to_string()), message.code_or(ErrorCode::InvalidWorld))
}

/// Creates a `raycam.FormatError`.
fn format_error(error: &FormatError) -> PyErr {
    with_code(python::FormatError::new_err(error.to_string()), error.code())
}

/// Exception for a scene error; `place` (a file name and a colon, or an empty string) precedes the message.
fn scene_error(error: &SceneError, place: &str) -> PyErr {
    let message = error.code().message(format!("{place}{error}"));
    match error {
        SceneError::Camera(_) => camera_error(message),
        SceneError::World(_) | SceneError::Schema { .. } => world_error(message),
        SceneError::Storage { path, number, message } => {
            with_code(storage_error(path, *number, message), ErrorCode::Storage)
        }
    }
}

/// Conversion of a Rust error to the equivalent Python exception.
pub(crate) trait IntoPyErr {
    /// Returns the exception.
    fn into_py_err(self) -> PyErr;
}

/// Conversion of a result to its value or to a Python exception.
pub(crate) trait OrRaise<T> {
    /// Returns the value, or raises the error as a Python exception.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: IntoPyErr> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(IntoPyErr::into_py_err)
    }
}

impl IntoPyErr for SceneError {
    fn into_py_err(self) -> PyErr {
        scene_error(&self, "")
    }
}

impl IntoPyErr for FormatError {
    fn into_py_err(self) -> PyErr {
        match self {
            FormatError::Io { ref path, ref source } => with_code(io_error(path, source, ""), self.code()),
            FormatError::Scene { path, source } => {
                let place = path.map(|path| format!("{}: ", path.display())).unwrap_or_default();
                scene_error(&source, &place)
            }
            FormatError::Schema { .. } => world_error(self.code().message(self.to_string())),
            FormatError::Named { .. } => with_code(named_error(&self), self.code()),
            _ => format_error(&self),
        }
    }
}

/// Exception for a file that a world file refers to. The exception has the same class as if the file were loaded alone.
fn named_error(error: &FormatError) -> PyErr {
    let message = error.to_string();
    let FormatError::Named { place, key, source } = error else {
        return format_error(error);
    };
    match &**source {
        FormatError::Io { path, source } => {
            let line = place.as_ref().map(|(path, line)| format!("{}:{line}: ", path.display())).unwrap_or_default();
            io_error(path, source, &format!(" ({line}{key})"))
        }
        FormatError::Scene { source, .. } if matches!(source, SceneError::Storage { .. }) => scene_error(source, ""),
        FormatError::Scene { .. } => world_error(message),
        _ => format_error(error),
    }
}

/// Exception for a temporary file to which the operating system denies access.
fn storage_error(path: &Path, number: Option<i32>, message: &str) -> PyErr {
    match number {
        Some(number) => PyOSError::new_err((number, message.to_owned(), path.display().to_string())),
        None => PyOSError::new_err(format!("{}: {message}", path.display())),
    }
}

/// Exception for a file to which the operating system denies access. In the message, `where_named` follows the reason.
fn io_error(path: &Path, error: &io::Error, where_named: &str) -> PyErr {
    // OSError selects its subclass (FileNotFoundError, ...) by the error number.
    match error.raw_os_error() {
        Some(number) => {
            // The system's message without Rust's "(os error 2)", because the exception already contains the number.
            let text = error.to_string();
            let text = text.split(" (os error").next().unwrap_or(&text);
            let text = format!("{text}{}{where_named}", broken_link(path));
            PyOSError::new_err((number, text, path.display().to_string()))
        }
        None => PyOSError::new_err(format!("{}: {error}{where_named}", path.display())),
    }
}

impl IntoPyErr for RenderError {
    fn into_py_err(self) -> PyErr {
        let code = self.code();
        let message = code.message(self.to_string());
        match self {
            RenderError::Settings(_) | RenderError::TooLarge { .. } => settings_error(message),
            RenderError::World(_) | RenderError::Build { .. } => world_error(message),
            RenderError::Threads { .. } => with_code(PyOSError::new_err(message.to_string()), code),
            RenderError::Textures(error) => error.into_py_err(),
            RenderError::OutOfMemory { .. } => with_code(PyMemoryError::new_err(message.to_string()), code),
            RenderError::Cancelled => with_code(python::Cancelled::new_err(message.to_string()), code),
        }
    }
}

/// Checks that this many bytes are available, because a failed allocation would end the process.
pub(crate) fn check_memory(what: &str, bytes: usize) -> PyResult<()> {
    raycam_render::check_memory(|| what.into(), bytes as u64).or_raise()
}

/// Runs `f`; a panic, which is a bug, becomes an exception.
pub(crate) fn catch_panic<T>(f: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(f)).map_err(|payload| from_panic(&*payload))
}

/// Runs `f` without the GIL; an error or a panic becomes an exception.
pub(crate) fn detached<T: Send, E: IntoPyErr + Send>(
    py: Python<'_>,
    f: impl FnOnce() -> Result<T, E> + Send,
) -> PyResult<T> {
    py.detach(|| catch_panic(f))?.or_raise()
}

/// Creates the exception for a panic.
pub(crate) fn from_panic(payload: &(dyn Any + Send)) -> PyErr {
    let text = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_default();
    raycam_error(format!("internal error, a bug in raycam; please report it with this text: {text}"))
}
