//! K and lenses from the parameters in files, and rejection of lens terms that no model of raycam contains.

use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, PixelCenter};

use crate::CameraRecord;
use raycam_formats::{FormatError, Result};

/// Returns K from the focal lengths and the principal point, without skew.
pub(crate) fn pinhole_matrix([fx, fy, cx, cy]: [f64; 4]) -> DMat3 {
    DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(0.0, fy, 0.0), DVec3::new(cx, cy, 1.0))
}

/// Returns OpenCV's lens with radial and tangential terms; a pinhole if all are 0.
pub(crate) fn brown_lens(k1: f64, k2: f64, p1: f64, p2: f64, k3: f64) -> Result<Lens, String> {
    let terms = [k1, k2, p1, p2, k3];
    if terms == [0.0; 5] {
        return Ok(Lens::Pinhole);
    }
    Lens::new(LensModel::OpenCv, if k3 == 0.0 { &terms[..4] } else { &terms }).map_err(|error| error.to_string())
}

/// Returns the lens of a model; a pinhole for OpenCV's model if all coefficients are 0.
pub(crate) fn lens_of(model: LensModel, coefficients: &[f64]) -> Result<Lens, String> {
    if model == LensModel::OpenCv && coefficients.iter().all(|value| *value == 0.0) {
        return Ok(Lens::Pinhole);
    }
    Lens::new(model, coefficients).map_err(|error| error.to_string())
}

/// Rejects the first nonzero term among the terms that raycam's lens models do not contain.
pub(crate) fn refuse_terms<'a>(terms: impl IntoIterator<Item = (&'a str, f64)>) -> Result<(), String> {
    match terms.into_iter().find(|(_, value)| *value != 0.0) {
        None => Ok(()),
        Some((name, value)) => Err(format!(
            "{name} is {value}, a lens term that raycam does not support; calibrate without it, or undistort the \
             images with the program that wrote the file"
        )),
    }
}

/// Makes a record a complete equirectangular panorama of its size, by setting K and the lens.
pub(crate) fn set_panorama(record: &mut CameraRecord) -> Result<(), String> {
    let Some(size) = record.size else {
        return Err("a panorama requires its size; set it with --size WIDTHxHEIGHT or size=(width, height)".into());
    };
    if size[0] != 2 * size[1] {
        return Err(format!("a panorama of {} x {}; expected a width that is twice the height", size[0], size[1]));
    }
    let lens = Lens::new(LensModel::Equirectangular, &[]).map_err(|error| error.to_string())?;
    record.k = lens.full_panorama(size, record.pixel_center);
    record.lens = lens;
    Ok(())
}

/// Pixel coordinates of the image centre.
pub(crate) fn middle_of(size: [u32; 2], center: PixelCenter) -> [f64; 2] {
    size.map(|side| 0.5 * f64::from(side) - 0.5 + center.offset())
}

/// Returns the size that only the caller can specify; an error if it is missing.
pub(crate) fn require_known_size(size: Option<[u32; 2]>, path: &Path, format: &str) -> Result<[u32; 2]> {
    size.ok_or_else(|| {
        FormatError::whole(
            path,
            ErrorCode::MissingArgument.message(format!(
                "{format} does not contain the image size, which K requires, and the images were not found; set the \
                 size with --size WIDTHxHEIGHT or size=(width, height)"
            )),
        )
    })
}
