//! The views of texels with the largest weights.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use raycam_render::queries::texel_views::{MAX_VIEWS, PhotoTexels, TexelViews as Inner};

use crate::arrays::{ArrayResult, NewArray, array, flat, rows};
use crate::error::OrRaise;

/// For a set of texels, the views with the largest weights, collected photograph by photograph.
#[pyclass(module = "raycam._core")]
pub(crate) struct TexelViews {
    inner: Inner,
}

#[pymethods]
impl TexelViews {
    /// Bytes for each texel.
    #[classattr]
    const TEXEL_BYTES: usize = Inner::TEXEL_BYTES;

    #[new]
    fn new(count: usize) -> Self {
        Self { inner: Inner::new(count) }
    }

    /// Adds the views of the texels `index` \[k] in a photograph, with weights \[k] and linear colours \[k, 3].
    fn add(
        &mut self,
        py: Python<'_>,
        camera: i32,
        index: PyReadonlyArrayDyn<'_, i64>,
        weights: PyReadonlyArrayDyn<'_, f32>,
        colors: PyReadonlyArrayDyn<'_, f32>,
    ) -> PyResult<()> {
        let (index, weights) = (flat(&index, "index")?, flat(&weights, "weights")?);
        let photo = PhotoTexels { camera, index, weights, colors: rows(&colors, "colors")? };
        py.detach(|| self.inner.add(&photo)).or_raise()
    }

    /// Returns the number of photographs that show each texel, int32 \[n].
    fn counts<'py>(&self, py: Python<'py>) -> ArrayResult<'py, i32> {
        array(py, self.inner.counts.clone(), &[self.inner.counts.len()])
    }

    /// Returns the weights \[k, 8], colours \[k, 8, 3] and photographs \[k, 8] of the texels from `first` to before
    /// `last`.
    fn kept<'py>(
        &self,
        py: Python<'py>,
        first: usize,
        last: usize,
    ) -> PyResult<(NewArray<'py, f32>, NewArray<'py, f32>, NewArray<'py, i32>)> {
        let (views, n) = (&self.inner, last.saturating_sub(first));
        let (Some(weights), Some(colors), Some(cameras)) =
            (views.weights.get(first..last), views.colors.get(first..last), views.cameras.get(first..last))
        else {
            return Err(PyIndexError::new_err(format!("texels {first} to {last} of {}", views.counts.len())));
        };
        let colors = colors.as_flattened().as_flattened();
        Ok((
            array(py, weights.as_flattened().to_vec(), &[n, MAX_VIEWS])?,
            array(py, colors.to_vec(), &[n, MAX_VIEWS, 3])?,
            array(py, cameras.as_flattened().to_vec(), &[n, MAX_VIEWS])?,
        ))
    }
}
