//! Elementary functions with the same bits on every processor.

use pyo3::prelude::*;

use crate::arrays::{ArrayResult, Floats, array, flat};
use crate::error::settings_error;

/// Returns a function ("acos", "cos", "exp", "log", "sin" or "tan"; angles in radians) of each number.
///
/// The functions of C libraries and of NumPy differ in the last bit between processors; those of `libm` do not.
#[pyfunction]
pub(crate) fn elementary<'py>(py: Python<'py>, function: &str, x: Floats<'py>) -> ArrayResult<'py, f64> {
    let function = match function {
        "acos" => libm::acos,
        "cos" => libm::cos,
        "exp" => libm::exp,
        "log" => libm::log,
        "sin" => libm::sin,
        "tan" => libm::tan,
        _ => return Err(settings_error(format!("function is {function:?}; expected acos, cos, exp, log, sin or tan"))),
    };
    let values = flat(&x, "x")?.iter().map(|&value| function(value)).collect();
    array(py, values, x.as_array().shape())
}
