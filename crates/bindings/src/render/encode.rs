//! Images as bytes: colours, PNG, EXR and HDR.

use std::path::PathBuf;

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use raycam_formats::encode::{exr, hdr, jpeg, lzf, mask, png};
use raycam_formats::{Budget, ColorUse, read_image};
use raycam_render::film::display;
use raycam_scene::{Texels, ViewTransform, color};

use crate::arrays::{self, ArrayResult, BytesResult, NewArray, array};
use crate::camera::Camera;
use crate::error::{OrRaise, catch_panic, check_memory, detached, settings_error};
use crate::notice::Notices;

/// Array of any supported number type.
#[derive(FromPyObject)]
pub(crate) enum ArrayView<'py> {
    U8(PyReadonlyArrayDyn<'py, u8>),
    U16(PyReadonlyArrayDyn<'py, u16>),
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
    I32(PyReadonlyArrayDyn<'py, i32>),
}

/// Converts 8-bit sRGB to linear float32 of the same shape.
#[pyfunction]
pub(crate) fn linear_from_srgb8<'py>(py: Python<'py>, bytes: PyReadonlyArrayDyn<'py, u8>) -> ArrayResult<'py, f32> {
    let table: Vec<f32> = (0..=255).map(|v| color::linear_from_srgb8([v; 3])[0]).collect();
    let linear = contiguous(&bytes)?.iter().map(|&v| table[usize::from(v)]).collect();
    array(py, linear, bytes.shape())
}

/// Decodes an image file to linear colours, float32 [height, width, 4], with the notices of its reader.
#[pyfunction]
pub(crate) fn read_picture(py: Python<'_>, path: PathBuf) -> PyResult<(NewArray<'_, f32>, Notices)> {
    let (image, notices) = detached(py, || read_image(&path, ColorUse::Color, &Budget::default()))?;
    let pixels = (0..image.texels.len()).flat_map(|i| image.texels.linear(i)).collect();
    Ok((array(py, pixels, &[image.size[1] as usize, image.size[0] as usize, 4])?, notices.into()))
}

/// Decodes an image file of integers to its values without any conversion: uint8 or uint16 [height, width, 4].
#[pyfunction]
pub(crate) fn read_texels(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let (image, _) = detached(py, || read_image(&path, ColorUse::Data, &Budget::default()))?;
    let shape = [image.size[1] as usize, image.size[0] as usize, 4];
    match image.texels {
        Texels::Linear8(texels) => Ok(array(py, texels.into_flattened(), &shape)?.into_any()),
        Texels::Linear16(texels) => Ok(array(py, texels.into_flattened(), &shape)?.into_any()),
        _ => Err(settings_error("the image contains floats; expected 8-bit or 16-bit integers")),
    }
}

/// Decodes a photo [height, width, 4] in the stored orientation. Photos of 8 bits are uint8: colours in sRGB, and linear
/// opacity. Other photos are linear float32. Also returns the EXIF orientation (1 to 8) and notices.
#[pyfunction]
pub(crate) fn read_photo(py: Python<'_>, path: PathBuf) -> PyResult<(Bound<'_, PyAny>, u8, Notices)> {
    let (image, orientation, notices) = detached(py, || raycam_formats::read_photo(&path, &Budget::default()))?;
    let shape = [image.size[1] as usize, image.size[0] as usize, 4];
    let pixels = match image.texels {
        Texels::Srgb8(texels) => array(py, texels.into_flattened(), &shape)?.into_any(),
        texels => {
            let linear: Vec<[f32; 4]> = (0..texels.len()).map(|i| texels.linear(i)).collect();
            array(py, linear.into_flattened(), &shape)?.into_any()
        }
    };
    Ok((pixels, orientation, notices.into()))
}

/// Returns (name, is_integer, values) of each channel of a single-part EXR file. The values are uint32 [height, width]:
/// integers, or the bits of float32.
#[pyfunction]
pub(crate) fn read_exr(py: Python<'_>, path: PathBuf) -> PyResult<Vec<(String, bool, NewArray<'_, u32>)>> {
    let ([columns, rows], channels) = detached(py, || raycam_formats::read_exr(&path, &Budget::default()))?;
    let shape = [rows as usize, columns as usize];
    channels.into_iter().map(|(name, is_whole, bits)| Ok((name, is_whole, array(py, bits, &shape)?))).collect()
}

/// Rejects contents that are only a placeholder for the file at a path: a Git LFS pointer, an HTML page, or nothing.
#[pyfunction]
pub(crate) fn check_stand_in(path: PathBuf, data: &[u8]) -> PyResult<()> {
    raycam_formats::check_stand_in(&path, data).or_raise()
}

/// Applies a view transform to linear float32 [..., 3] times `scale`; returns linear float32 of the same shape.
#[pyfunction]
pub(crate) fn shown_from_linear<'py>(
    py: Python<'py>,
    linear: PyReadonlyArrayDyn<'py, f32>,
    scale: f32,
    view: &str,
) -> ArrayResult<'py, f32> {
    let (view, pixels) = (view_named(view)?, colors(&linear)?);
    let shown = py.detach(|| pixels.iter().flat_map(|rgb| view.apply(rgb.map(|v| v * scale))).collect());
    array(py, shown, linear.shape())
}

/// Applies a view transform to linear float32 [..., 3] times `scale`; returns sRGB integers of 8 or 16 `bits`, of the
/// same shape. NaN becomes 0.
#[pyfunction]
pub(crate) fn srgb_from_linear<'py>(
    py: Python<'py>,
    linear: PyReadonlyArrayDyn<'py, f32>,
    scale: f32,
    bits: u8,
    view: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let (view, pixels) = (view_named(view)?, colors(&linear)?);
    if bits == 16 {
        let data = detached(py, || display::srgb16(pixels, scale, view))?;
        return Ok(array(py, data, linear.shape())?.into_any());
    }
    let data = detached(py, || display::srgb8(pixels, scale, view))?;
    Ok(array(py, data, linear.shape())?.into_any())
}

/// Encodes linear float32 [height, width, 3] as a Radiance HDR file.
#[pyfunction]
pub(crate) fn encode_hdr<'py>(py: Python<'py>, rgb: PyReadonlyArrayDyn<'py, f32>) -> BytesResult<'py> {
    let (size, _) = size_of(rgb.shape())?;
    check_memory("an HDR file", 2 * rgb.shape().iter().product::<usize>())?;
    let rgb = contiguous(&rgb)?;
    arrays::bytes(py, &detached(py, || hdr::encode(size, rgb))?)
}

/// Compresses bytes with LZF.
#[pyfunction]
pub(crate) fn compress_lzf<'py>(py: Python<'py>, data: &[u8]) -> BytesResult<'py> {
    check_memory("a compressed file", data.len().saturating_mul(2))?;
    arrays::bytes(py, &py.detach(|| lzf::compress(data)))
}

/// Encodes an array [height, width] or [height, width, channels] of uint8 or uint16 as a PNG file. With `fast`, the file
/// is larger and takes less time.
#[pyfunction]
#[pyo3(signature = (pixels, fast=false))]
pub(crate) fn encode_png<'py>(py: Python<'py>, pixels: ArrayView<'py>, fast: bool) -> BytesResult<'py> {
    let (shape, samples) = match &pixels {
        ArrayView::U8(a) => (a.shape(), png::Samples::U8(contiguous(a)?)),
        ArrayView::U16(a) => (a.shape(), png::Samples::U16(contiguous(a)?)),
        _ => return Err(settings_error("invalid array type for PNG; expected uint8 or uint16")),
    };
    let (size, channels) = size_of(shape)?;
    check_memory("a PNG file", 2 * shape.iter().product::<usize>() * 2)?;
    let encode = if fast { png::encode_fast } else { png::encode };
    arrays::bytes(py, &detached(py, || encode(size, channels, samples))?)
}

/// Encodes an array [height, width, 3] of uint8 in sRGB as a JPEG file.
#[pyfunction]
pub(crate) fn encode_jpeg<'py>(py: Python<'py>, rgb: PyReadonlyArrayDyn<'py, u8>, quality: u8) -> BytesResult<'py> {
    let ([columns, rows], pixels) = (size_of(rgb.shape())?.0, contiguous(&rgb)?);
    check_memory("a JPEG file", 2 * pixels.len())?;
    arrays::bytes(py, &detached(py, || jpeg::encode([columns, rows], pixels, quality))?)
}

/// Encodes (name, array [height, width] or [height, width, components]) as an EXR file. Arrays are float32, float64
/// (stored as float32) or int32; with `half`, floats become float16.
#[pyfunction]
pub(crate) fn encode_exr<'py>(
    py: Python<'py>,
    layers: Vec<(String, ArrayView<'py>)>,
    half: bool,
    camera: Option<&Camera>,
    notes: Vec<(String, String)>,
) -> BytesResult<'py> {
    let mut size = [0; 2];
    let values = |layer: &ArrayView<'_>| match layer {
        ArrayView::U8(a) => a.len(),
        ArrayView::U16(a) => a.len(),
        ArrayView::F32(a) => a.len(),
        ArrayView::F64(a) => 2 * a.len(),
        ArrayView::I32(a) => a.len(),
    };
    let all: usize = layers.iter().map(|(_, layer)| values(layer)).sum();
    check_memory("an EXR file", 12 * all)?;
    let mut narrowed = Vec::new();
    for (_, numbers) in &layers {
        narrowed.push(match numbers {
            ArrayView::F64(a) => contiguous(a)?.iter().map(|&v| v as f32).collect(),
            _ => Vec::new(),
        });
    }
    let mut list = Vec::new();
    for ((name, numbers), narrowed) in layers.iter().zip(&narrowed) {
        let floats = |values| {
            if half { exr::LayerSamples::F16(values) } else { exr::LayerSamples::F32(values) }
        };
        let (shape, samples) = match numbers {
            ArrayView::F32(a) => (a.shape(), floats(contiguous(a)?)),
            ArrayView::F64(a) => (a.shape(), floats(&narrowed[..])),
            ArrayView::I32(a) => (a.shape(), exr::LayerSamples::Id(contiguous(a)?)),
            _ => return Err(settings_error(format!("EXR: {name} has an unsupported type; expected floats or int32"))),
        };
        let components;
        (size, components) = size_of(shape)?;
        list.push(exr::Layer { name, components, samples });
    }
    let notes: Vec<_> = notes.iter().map(|(key, value)| (&key[..], &value[..])).collect();
    let camera = camera.map(|camera| &camera.inner);
    arrays::bytes(py, &detached(py, || exr::encode(size, &list, camera, &notes))?)
}

/// Returns COCO's compressed run lengths of a mask [height, width].
#[pyfunction]
pub(crate) fn mask_runs(py: Python<'_>, pixels: PyReadonlyArrayDyn<'_, bool>) -> PyResult<String> {
    let ([width, height], _) = size_of(pixels.shape())?;
    let values = contiguous(&pixels)?;
    py.detach(|| catch_panic(|| mask::coco_rle(values, width as usize, height as usize)))
}

/// Returns polygons [n, 2] along pixel edges that fill a mask [height, width].
#[pyfunction]
pub(crate) fn mask_polygons(py: Python<'_>, pixels: PyReadonlyArrayDyn<'_, bool>) -> PyResult<Vec<Vec<[u32; 2]>>> {
    let ([width, height], _) = size_of(pixels.shape())?;
    let values = contiguous(&pixels)?;
    py.detach(|| catch_panic(|| mask::polygons(values, width as usize, height as usize)))
}

/// Values of an array in C order.
fn contiguous<'a, T: numpy::Element>(array: &'a PyReadonlyArrayDyn<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| settings_error("expected a C-contiguous array"))
}

/// Colours of an array [..., 3].
fn colors<'a>(array: &'a PyReadonlyArrayDyn<'_, f32>) -> PyResult<&'a [[f32; 3]]> {
    match contiguous(array)?.as_chunks::<3>() {
        (colors, []) => Ok(colors),
        _ => Err(settings_error("expected an array [..., 3] of colours")),
    }
}

fn view_named(name: &str) -> PyResult<ViewTransform> {
    ViewTransform::from_name(name).ok_or_else(|| settings_error(format!("unknown view {name:?}")))
}

/// Number of columns, rows and components of [height, width] or [height, width, components].
fn size_of(shape: &[usize]) -> PyResult<([u32; 2], usize)> {
    let side = |side: usize| {
        u32::try_from(side).map_err(|_| {
            settings_error(format!(
                "image too large: {side} pixels \
        per side; the limit is 4294967295"
            ))
        })
    };
    match *shape {
        [height, width] => Ok(([side(width)?, side(height)?], 1)),
        [height, width, components] => Ok(([side(width)?, side(height)?], components)),
        _ => Err(settings_error(format!("expected an array [height, width, ...], got shape {shape:?}"))),
    }
}
