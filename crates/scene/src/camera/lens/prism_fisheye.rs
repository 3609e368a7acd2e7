//! Fisheyes with tangential and prism distortion: COLMAP's THIN_PRISM_FISHEYE and RAD_TAN_THIN_PRISM_FISHEYE (Project
//! Aria's "FisheyeRadTanThinPrism"). Formulas: COLMAP's `sensor/models.h`, Aria's documentation of camera intrinsics.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::brown::{BrownConrady, BrownTerms};
use super::model::{LensModel, wrong_count};
use crate::error::Result;

/// Distortion of the equidistant plane, in which a direction at the angle θ to the axis has the radius θ. The model is
/// used on a disc, at most 180 degrees from the axis, on which it is one-to-one.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PrismFisheye {
    given: Vec<f64>,
    plane: BrownConrady,
}

impl PrismFisheye {
    /// Creates the model with the coefficients `k1 k2 p1 p2 k3 k4 sx1 sy1`; all terms use the equidistant point.
    pub(super) fn thin_prism(given: &[f64]) -> Result<Self> {
        let Ok([k1, k2, p1, p2, k3, k4, sx1, sy1]) = <[f64; 8]>::try_from(given) else {
            return Err(wrong_count(given, LensModel::ThinPrismFisheye, "8 (k1 k2 p1 p2 k3 k4 sx1 sy1)"));
        };
        let terms = BrownTerms {
            numerator: [k1, k2, k3, k4, 0.0, 0.0],
            tangential: [p1, p2],
            prism: [sx1, 0.0, sy1, 0.0],
            ..BrownTerms::default()
        };
        Ok(Self::new(given, terms))
    }

    /// Creates the model with the coefficients `k0 ... k5 p0 p1 s0 s1 s2 s3`; the tangential and prism terms use the
    /// radially distorted point.
    pub(super) fn rad_tan_thin_prism(given: &[f64]) -> Result<Self> {
        let Ok([k0, k1, k2, k3, k4, k5, p0, p1, s0, s1, s2, s3]) = <[f64; 12]>::try_from(given) else {
            return Err(wrong_count(
                given,
                LensModel::RadTanThinPrismFisheye,
                "12 (k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3)",
            ));
        };
        let terms = BrownTerms {
            numerator: [k0, k1, k2, k3, k4, k5],
            // The tangential coefficients of this model belong to x and y; the coefficients of Brown's formula belong
            // to y and x.
            tangential: [p1, p0],
            prism: [s0, s1, s2, s3],
            tangential_after_radial: true,
            ..BrownTerms::default()
        };
        Ok(Self::new(given, terms))
    }

    fn new(given: &[f64], terms: BrownTerms) -> Self {
        Self { given: given.to_vec(), plane: BrownConrady::new(terms, |part| PI * part) }
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        self.plane.distort(equidistant(direction)?)
    }

    /// Point of the equidistant plane that has this image.
    pub(super) fn undistort_plane(&self, image: DVec2, near: Option<DVec2>) -> Option<DVec2> {
        self.plane.undistort(image, near)
    }
}

/// Direction in the equidistant plane; `None` for a zero direction.
pub fn equidistant(direction: DVec3) -> Option<DVec2> {
    let across = direction.truncate().length();
    if across == 0.0 {
        let behind = DVec2::new(PI, 0.0);
        return match direction.z {
            z if z > 0.0 => Some(DVec2::ZERO),
            z if z < 0.0 => Some(behind),
            _ => None,
        };
    }
    Some(direction.truncate() * (across.atan2(direction.z) / across))
}

/// Unit direction of a point of the equidistant plane.
pub fn from_equidistant(at: DVec2) -> DVec3 {
    let angle = at.length();
    let (sin, cos) = angle.sin_cos();
    let factor = if angle == 0.0 { 1.0 } else { sin / angle };
    (at * factor).extend(cos)
}
