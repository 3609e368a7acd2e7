//! COLMAP's camera models: their names and parameters (`sensor/models.h`), and the corresponding K and lens.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::Lens;
use super::model::LensModel;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;

/// Row of the model table: the model's name, whether it has one focal length or two, the parameters between the
/// principal point and the lens coefficients, the number of lens coefficients, and the number of zeros that complete
/// them.
struct ColmapModel {
    name: &'static str,
    focals: usize,
    lens: Option<LensModel>,
    given: usize,
    zeros: usize,
}

const fn colmap_model(
    name: &'static str,
    focals: usize,
    lens: Option<LensModel>,
    given: usize,
    zeros: usize,
) -> ColmapModel {
    ColmapModel { name, focals, lens, given, zeros }
}

/// All models except EQUIRECTANGULAR, which has a size and no focal length.
const MODELS: [ColmapModel; 18] = [
    colmap_model("SIMPLE_PINHOLE", 1, None, 0, 0),
    colmap_model("PINHOLE", 2, None, 0, 0),
    colmap_model("SIMPLE_RADIAL", 1, Some(LensModel::OpenCv), 1, 3),
    colmap_model("RADIAL", 1, Some(LensModel::OpenCv), 2, 2),
    colmap_model("OPENCV", 2, Some(LensModel::OpenCv), 4, 0),
    colmap_model("FULL_OPENCV", 2, Some(LensModel::OpenCv), 8, 0),
    colmap_model("SIMPLE_FISHEYE", 1, Some(LensModel::Fisheye), 0, 4),
    colmap_model("FISHEYE", 2, Some(LensModel::Fisheye), 0, 4),
    colmap_model("SIMPLE_RADIAL_FISHEYE", 1, Some(LensModel::Fisheye), 1, 3),
    colmap_model("RADIAL_FISHEYE", 1, Some(LensModel::Fisheye), 2, 2),
    colmap_model("OPENCV_FISHEYE", 2, Some(LensModel::Fisheye), 4, 0),
    colmap_model("THIN_PRISM_FISHEYE", 2, Some(LensModel::ThinPrismFisheye), 8, 0),
    colmap_model("RAD_TAN_THIN_PRISM_FISHEYE", 2, Some(LensModel::RadTanThinPrismFisheye), 12, 0),
    colmap_model("FOV", 2, Some(LensModel::Fov), 1, 0),
    colmap_model("SIMPLE_DIVISION", 1, Some(LensModel::Division), 1, 0),
    colmap_model("DIVISION", 2, Some(LensModel::Division), 1, 0),
    colmap_model("EUCM", 2, Some(LensModel::Eucm), 2, 0),
    EQUIRECTANGULAR,
];

const EQUIRECTANGULAR: ColmapModel = colmap_model("EQUIRECTANGULAR", 0, Some(LensModel::Equirectangular), 0, 0);

/// Returns K and the lens for one of COLMAP's models, given its name (SIMPLE_PINHOLE to EQUIRECTANGULAR) and its
/// parameters, in pixels with the centre of the first pixel at (0.5, 0.5).
///
/// # Errors
/// [`SceneError::Camera`] for a name that COLMAP does not have, for a wrong number of parameters, and the errors of
/// [`Lens::new`].
pub fn lens_from_colmap(model: &str, params: &[f64]) -> Result<(DMat3, Lens)> {
    let Some(row) = MODELS.iter().find(|row| row.name == model) else {
        let hint = suggestion(model, MODELS.map(|row| row.name));
        let message = format!("COLMAP has no camera model {model:?}{hint}");
        return Err(SceneError::Camera(ErrorCode::UnknownName.message(message)));
    };
    let expected = row.focals + 2 + row.given;
    if params.len() != expected {
        return Err(SceneError::lens(format!(
            "{} parameters {params:?}; COLMAP's model {model} requires {expected}",
            params.len()
        )));
    }
    let (focals, rest) = params.split_at(row.focals);
    let (center, given) = rest.split_at(2);
    let (fx, fy, cx, cy) = match (focals, center) {
        ([], &[width, height]) => (width / TAU, 2.0 * height / TAU, 0.5 * width, 0.5 * height),
        (&[f], &[cx, cy]) => (f, f, cx, cy),
        (&[fx, fy, ..], &[cx, cy]) => (fx, fy, cx, cy),
        _ => (f64::NAN, f64::NAN, f64::NAN, f64::NAN),
    };
    let k = DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(0.0, fy, 0.0), DVec3::new(cx, cy, 1.0));
    let lens = match row.lens {
        None => Lens::Pinhole,
        Some(model) => {
            let mut coefficients = given.to_vec();
            coefficients.resize(given.len() + row.zeros, 0.0);
            Lens::new(model, &coefficients)?
        }
    };
    Ok((k, lens))
}

/// Returns the name and the parameters of the COLMAP model for a K and a lens, in pixels with the centre of the first
/// pixel at (0.5, 0.5).
///
/// # Errors
/// [`SceneError::Camera`] if COLMAP has no such model: skew, OpenCV's thin prism and tilt, `omni`, `ds`, cylindrical
/// and partial panoramas.
pub fn colmap_from_lens(k: DMat3, lens: &Lens) -> Result<(&'static str, Vec<f64>)> {
    let fail = |what: &str| Err(SceneError::lens(format!("COLMAP has no camera model that supports {what}")));
    if k.y_axis.x != 0.0 {
        return fail(&format!("skew (K[0, 1] = {})", k.y_axis.x));
    }
    let (fx, fy, cx, cy) = (k.x_axis.x, k.y_axis.y, k.z_axis.x, k.z_axis.y);
    let (name, coefficients) = match lens.coefficients() {
        None => ("PINHOLE", vec![]),
        Some((LensModel::OpenCv, given)) => {
            if given.iter().skip(8).any(|v| *v != 0.0) {
                return fail("the thin prism and tilt terms of OpenCV");
            }
            let mut eight = given.to_vec();
            eight.resize(8, 0.0);
            if eight[4..] == [0.0; 4] {
                eight.truncate(4);
                ("OPENCV", eight)
            } else {
                ("FULL_OPENCV", eight)
            }
        }
        Some((LensModel::Equirectangular, _)) => {
            let (width, height) = (2.0 * cx, 2.0 * cy);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
            if !(near(fx * TAU, width) && near(fy * TAU, 2.0 * height)) {
                return fail("a part of an equirectangular panorama");
            }
            return Ok((EQUIRECTANGULAR.name, vec![width, height]));
        }
        Some((model, given)) => {
            let exact = |row: &&ColmapModel| row.lens == Some(model) && row.focals == 2 && row.zeros == 0;
            match MODELS.iter().find(exact) {
                Some(row) => (row.name, given.to_vec()),
                None => return fail(&format!("the lens model {}", model.name())),
            }
        }
    };
    Ok((name, [vec![fx, fy, cx, cy], coefficients].concat()))
}
