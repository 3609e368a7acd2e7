//! Colours of photographs.

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use raycam_render::queries::photo_pyramid::PhotoPyramid as Inner;
use raycam_scene::Texels;

use crate::arrays::{ArrayResult, Floats, array, rows};
use crate::error::{OrRaise, settings_error};
use crate::interruptible::run_for_work;

/// A photograph \[h, w, 4]: uint8 in sRGB with linear opacity, or linear float32.
#[derive(FromPyObject)]
pub(crate) enum Photo<'py> {
    Srgb8(PyReadonlyArrayDyn<'py, u8>),
    Linear(PyReadonlyArrayDyn<'py, f32>),
}

/// A photograph with linear copies at half, quarter, ... size.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct PhotoPyramid {
    inner: Inner,
}

#[pymethods]
impl PhotoPyramid {
    #[new]
    fn new(py: Python<'_>, photo: Photo<'_>) -> PyResult<Self> {
        let (shape, pixels) = match &photo {
            Photo::Srgb8(array) => (array.shape(), Texels::Srgb8(rows(array, "photo")?.to_vec())),
            Photo::Linear(array) => (array.shape(), Texels::Float(rows(array, "photo")?.to_vec())),
        };
        let &[height, width, 4] = shape else {
            return Err(settings_error(format!("photo: expected an array [h, w, 4], got shape {shape:?}")));
        };
        Ok(Self { inner: py.detach(|| Inner::new([width, height], pixels)).or_raise()? })
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
