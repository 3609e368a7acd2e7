//! Conversion of arrays. Python passes C-contiguous arrays whose type and shape it has checked.

use glam::{DMat3, DVec3};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error::settings_error;

/// A read-only float64 array.
pub(crate) type Floats<'py> = PyReadonlyArrayDyn<'py, f64>;

/// New NumPy array of any number of dimensions.
pub(crate) type NewArray<'py, T> = Bound<'py, PyArrayDyn<T>>;
/// Result of a Python function: a new array, dict or bytes object, or an exception.
pub(crate) type ArrayResult<'py, T> = PyResult<NewArray<'py, T>>;
pub(crate) type DictResult<'py> = PyResult<Bound<'py, PyDict>>;
pub(crate) type BytesResult<'py> = PyResult<Bound<'py, PyBytes>>;

/// Copies `data` to Python bytes; raises `MemoryError` if there is not enough memory.
pub(crate) fn bytes<'py>(py: Python<'py>, data: &[u8]) -> BytesResult<'py> {
    PyBytes::new_with(py, data.len(), |target| {
        target.copy_from_slice(data);
        Ok(())
    })
}

/// Converts a vector to an array of this shape, without copying.
pub(crate) fn array<'py, T: Element>(py: Python<'py>, data: Vec<T>, shape: &[usize]) -> ArrayResult<'py, T> {
    data.into_pyarray(py).reshape(shape)
}

/// Returns the values of an array in C order, without copying.
pub(crate) fn flat<'a, T: Element>(array: &'a PyReadonlyArrayDyn<'_, T>, name: &str) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| settings_error(format!("{name}: expected a C-contiguous array")))
}

/// Returns the rows of a C-contiguous array [..., N]; an error for an array of another shape or order.
pub(crate) fn rows<'a, T: Element, const N: usize>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; N]]> {
    let last = array.shape().last().copied().unwrap_or(0);
    let slice = array.as_slice().ok().filter(|_| last == N);
    let rows = slice.map(|slice| slice.as_chunks().0);
    rows.ok_or_else(|| {
        settings_error(format!("{name}: expected a C-contiguous array [..., {N}], got shape {:?}", array.shape()))
    })
}

/// Converts rows to a 3 x 3 matrix.
pub(crate) fn matrix3(m: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&m).transpose()
}

/// Converts a 3 x 3 matrix to its rows.
pub(crate) fn rows_of(m: DMat3) -> [[f64; 3]; 3] {
    m.transpose().to_cols_array_2d()
}

/// Converts three coordinates to a point or vector.
pub(crate) fn vector(v: [f64; 3]) -> DVec3 {
    DVec3::from_array(v)
}
