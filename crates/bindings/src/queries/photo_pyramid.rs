//! Colours of photographs.

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use raycam_render::queries::photo_pyramid::PhotoPyramid as Inner;

use crate::arrays::{ArrayResult, Floats, array, rows};
use crate::error::{OrRaise, settings_error};
use crate::interruptible::run_for_work;

/// A linear photograph \[h, w, 4] with copies at half, quarter, ... size.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct PhotoPyramid {
    inner: Inner,
}

#[pymethods]
impl PhotoPyramid {
    #[new]
    fn new(py: Python<'_>, photo: PyReadonlyArrayDyn<'_, f32>) -> PyResult<Self> {
        let &[height, width, 4] = photo.shape() else {
            return Err(settings_error(format!("photo: expected an array [h, w, 4], got shape {:?}", photo.shape())));
        };
        let pixels: &[[f32; 4]] = rows(&photo, "photo")?;
        Ok(Self { inner: py.detach(|| Inner::new([width, height], pixels.to_vec())).or_raise()? })
    }

    /// Returns the mean colours \[n, 4] of parallelograms around `places` \[n, 2], which are in pixels from the top left
    /// corner. The columns of `areas` \[n, 2, 2] are the parallelograms' sides in pixels.
    fn mean_colors<'py>(
        &self,
        py: Python<'py>,
        places: Floats<'py>,
        areas: Floats<'py>,
        threads: Option<usize>,
    ) -> ArrayResult<'py, f32> {
        let (places, areas) = (rows(&places, "places")?, rows::<f64, 2>(&areas, "areas")?.as_flattened());
        let areas = areas.as_chunks().0;
        let found = run_for_work(py, Inner::is_brief(places.len()), None, |control| {
            self.inner.mean_colors(places, areas, threads, control)
        })?;
        let n = found.len();
        array(py, found.into_flattened(), &[n, 4])
    }
}
