//! Images of many poses and cameras, rendered into Python's arrays.

use numpy::{Element, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use raycam_render::{Channel, OutputPlane, PictureSeries, PixelType, PlaneData, checked_region};

use crate::arrays::Floats;
use crate::camera::Camera;
use crate::error::{OrRaise, settings_error, world_error};
use crate::interruptible::run_interruptible;
use crate::notice::Notices;
use crate::render::frame::channel;
use crate::render::settings::RenderArguments;
use crate::world::edit::{Which, affine};
use crate::world::state::World;

/// Array [n, height, width] or [n, height, width, components] that is written.
enum SeriesArray<'py> {
    F32(PyReadwriteArrayDyn<'py, f32>),
    F64(PyReadwriteArrayDyn<'py, f64>),
    I32(PyReadwriteArrayDyn<'py, i32>),
}

impl<'py> SeriesArray<'py> {
    fn new(channel: Channel, array: &Bound<'py, PyAny>) -> PyResult<Self> {
        Ok(match channel.pixel_type() {
            PixelType::F32 => Self::F32(array.extract()?),
            PixelType::F64 => Self::F64(array.extract()?),
            PixelType::I32 => Self::I32(array.extract()?),
        })
    }

    /// Planes of `count` images; each plane has `values` values.
    fn planes(&mut self, count: usize, values: usize) -> PyResult<Vec<PlaneData<'_>>> {
        fn chunks<'a, T: Element>(
            array: &'a mut PyReadwriteArrayDyn<'_, T>,
            count: usize,
            values: usize,
        ) -> PyResult<std::slice::ChunksMut<'a, T>> {
            let whole = array.len() == count * values;
            let slice = array.as_slice_mut().ok().filter(|_| whole);
            let slice =
                slice.ok_or_else(|| settings_error("out: expected C-contiguous arrays with one entry per image"))?;
            Ok(slice.chunks_mut(values))
        }
        Ok(match self {
            Self::F32(array) => chunks(array, count, values)?.map(PlaneData::F32).collect(),
            Self::F64(array) => chunks(array, count, values)?.map(PlaneData::F64).collect(),
            Self::I32(array) => chunks(array, count, values)?.map(PlaneData::I32).collect(),
        })
    }
}

/// Renders `count` images into the arrays of their channels; returns the notices.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn render_many(
    py: Python<'_>,
    world: &World,
    cameras: Vec<PyRef<'_, Camera>>,
    poses: Vec<(Which, Floats<'_>)>,
    request: RenderArguments,
    count: usize,
    arrays: Vec<(String, Bound<'_, PyAny>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Notices> {
    let mut settings = request.settings()?;
    settings.channels = arrays.iter().map(|(name, _)| channel(name)).collect::<PyResult<_>>()?;
    let family = world.state().family.clone();
    let (inner, prepared) = world.prepared_world(py, settings.threads)?;
    let cameras: Vec<_> = cameras.iter().map(|camera| camera.inner.clone()).collect();
    let Some(first) = cameras.first() else {
        return Err(settings_error("no cameras; expected one camera, or one per image"));
    };
    let poses = poses.iter().map(|(which, matrices)| {
        let values = matrices.as_slice().map_err(|_| world_error("poses: expected C-contiguous arrays"))?;
        let places = values.as_chunks::<16>().0.iter().map(|rows| affine(rows));
        Ok((which.number_in(&inner)?, places.collect::<PyResult<Vec<_>>>()?))
    });
    let poses = poses.collect::<PyResult<Vec<_>>>()?;
    let (_, pixels) = checked_region(first, &settings).or_raise()?;
    let mut opened = Vec::with_capacity(arrays.len());
    for (&channel, (_, array)) in settings.channels.iter().zip(&arrays) {
        opened.push((channel, SeriesArray::new(channel, array)?));
    }
    let mut pictures: Vec<Vec<OutputPlane<'_>>> = (0..count).map(|_| Vec::with_capacity(opened.len())).collect();
    for (channel, array) in &mut opened {
        let planes = array.planes(count, pixels * channel.components())?;
        for (picture, values) in pictures.iter_mut().zip(planes) {
            picture.push(OutputPlane { channel: *channel, values, zero: false });
        }
    }
    let series =
        PictureSeries { world: &inner, prepared: &prepared, family: &family, cameras: &cameras, poses: &poses };
    run_interruptible(py, progress.as_ref(), |control| series.render(&settings, control, pictures)).map(Notices)
}
