//! Lenses: where the light of a direction meets the image plane at focal length 1, before K.

mod fisheye;
mod opencv;

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::fisheye::Fisheye;
pub use self::opencv::OpenCv;
use crate::error::SceneError;

/// The families of lenses with distortion coefficients, by the names people write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LensModel {
    /// OpenCV's main model: 4, 5, 8, 12 or 14 coefficients.
    #[default]
    OpenCv,
    /// OpenCV's fisheye model (Kannala and Brandt): 4 coefficients.
    Fisheye,
}

impl LensModel {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            LensModel::OpenCv => "opencv",
            LensModel::Fisheye => "fisheye",
        }
    }
}

/// What a lens does to directions. Each model is one-to-one on the region where it does not fold over, and has no image
/// outside of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Lens {
    /// None: straight lines stay straight.
    #[default]
    Pinhole,
    /// See [`OpenCv`].
    OpenCv(Box<OpenCv>),
    /// See [`Fisheye`].
    Fisheye(Fisheye),
}

impl Lens {
    /// The lens of a model and its coefficients. The coefficients 0 of [`LensModel::OpenCv`] are a pinhole, those of
    /// [`LensModel::Fisheye`] the equidistant fisheye.
    ///
    /// # Errors
    /// [`SceneError::Camera`] for a number of coefficients that the model does not have, values that are not finite,
    /// and tilts of 90 degrees or more.
    pub fn new(model: LensModel, coefficients: &[f64]) -> Result<Self, SceneError> {
        if !coefficients.iter().all(|v| v.is_finite()) {
            return Err(SceneError::Camera(format!(
                "distortion {coefficients:?}: every coefficient must be finite"
            )));
        }
        match model {
            LensModel::OpenCv => {
                let lens = OpenCv::new(coefficients)?;
                Ok(if coefficients.iter().all(|v| *v == 0.0) {
                    Lens::Pinhole
                } else {
                    Lens::OpenCv(Box::new(lens))
                })
            }
            LensModel::Fisheye => Fisheye::new(coefficients).map(Lens::Fisheye),
        }
    }

    /// The model and its coefficients as they were given; nothing for a pinhole.
    pub fn coefficients(&self) -> Option<(LensModel, &[f64])> {
        match self {
            Lens::Pinhole => None,
            Lens::OpenCv(lens) => Some((LensModel::OpenCv, lens.coefficients())),
            Lens::Fisheye(lens) => Some((LensModel::Fisheye, lens.coefficients())),
        }
    }

    /// Where a direction in camera axes, of any length, meets the image plane at focal length 1. Nothing where the lens
    /// has no image of it.
    pub fn distort(&self, direction: DVec3) -> Option<DVec2> {
        match self {
            Lens::Pinhole => (direction.z > 0.0).then(|| direction.truncate() / direction.z),
            Lens::OpenCv(lens) => lens.distort(direction),
            Lens::Fisheye(lens) => lens.distort(direction),
        }
    }

    /// The direction in camera axes, of any length, that meets the image plane at a point: the inverse of
    /// [`Lens::distort`]. Nothing where no direction does.
    pub fn undistort(&self, image: DVec2) -> Option<DVec3> {
        match self {
            Lens::Pinhole => Some(image.extend(1.0)),
            Lens::OpenCv(lens) => lens.undistort(image),
            Lens::Fisheye(lens) => lens.undistort(image),
        }
    }
}
