//! Frames: planes of pixels as arrays.

use numpy::{PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::{Channel, Frame, ImagePlane, PixelType};

use crate::arrays::array;
use crate::error::{detached, settings_error};
use crate::notice::Notices;

/// Returns (name, dtype, components) of every channel.
#[pyfunction]
pub(crate) fn channels() -> Vec<(&'static str, &'static str, usize)> {
    let dtype = |kind| match kind {
        PixelType::F32 => "float32",
        PixelType::F64 => "float64",
        PixelType::I32 => "int32",
    };
    Channel::all().map(|c| (c.name(), dtype(c.pixel_type()), c.components())).collect()
}

/// Channel with this name.
pub(crate) fn channel(name: &str) -> PyResult<Channel> {
    Channel::from_name(name).ok_or_else(|| settings_error(format!("unknown channel {name:?}")))
}

/// Planes of a frame by name ([height, width] or [height, width, components]), its region, and its notices.
pub(crate) type FrameParts<'py> = (Bound<'py, PyDict>, (u32, u32, u32, u32), Notices);

/// Converts a frame for Python.
pub(crate) fn to_python(py: Python<'_>, frame: Frame) -> PyResult<FrameParts<'_>> {
    let planes = PyDict::new(py);
    let [_, _, width, height] = frame.region.map(|side| side as usize);
    for (channel, plane) in frame.planes {
        let shape = [height, width, channel.components()];
        let shape = if channel.components() == 1 { &shape[..2] } else { &shape[..] };
        let pixels = match plane {
            ImagePlane::F32 { data, .. } => array(py, data, shape)?.into_any(),
            ImagePlane::F64 { data, .. } => array(py, data, shape)?.into_any(),
            ImagePlane::I32 { data, .. } => array(py, data, shape)?.into_any(),
        };
        planes.set_item(channel.name(), pixels)?;
    }
    Ok((planes, frame.region.into(), frame.notices.into()))
}

/// Merges disjoint parts (size, region, planes) of one image.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "the tuples are the parts of frames")]
pub(crate) fn merge<'py>(
    py: Python<'py>,
    frames: Vec<([u32; 2], [u32; 4], Bound<'py, PyDict>)>,
) -> PyResult<FrameParts<'py>> {
    let frames = frames
        .into_iter()
        .map(|(size, region, planes)| {
            let planes = planes
                .iter()
                .map(|(name, pixels)| {
                    let channel = channel(&name.extract::<String>()?)?;
                    Ok((channel, plane(channel, &pixels)?))
                })
                .collect::<PyResult<_>>()?;
            Ok(Frame { size, region, planes, notices: Vec::new() })
        })
        .collect::<PyResult<_>>()?;
    to_python(py, detached(py, || Frame::merge(frames))?)
}

fn plane(channel: Channel, pixels: &Bound<'_, PyAny>) -> PyResult<ImagePlane> {
    fn data<T: numpy::Element>(pixels: &Bound<'_, PyAny>) -> PyResult<Vec<T>> {
        let pixels: PyReadonlyArrayDyn<'_, T> = pixels.extract()?;
        pixels.to_vec().map_err(|_| settings_error("expected a C-contiguous array"))
    }
    let components = channel.components();
    Ok(match channel.pixel_type() {
        PixelType::F32 => ImagePlane::F32 { components, data: data(pixels)? },
        PixelType::F64 => ImagePlane::F64 { components, data: data(pixels)? },
        PixelType::I32 => ImagePlane::I32 { components, data: data(pixels)? },
    })
}
