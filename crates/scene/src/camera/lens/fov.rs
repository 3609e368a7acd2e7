//! The field-of-view model of Devernay and Faugeras, "Straight lines have to be straight" (2001): COLMAP's FOV,
//! Kalibr's `pinhole-fov`.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::model::{LensModel, wrong_count};
use crate::error::{Result, SceneError};

/// The field-of-view model with the coefficient `ω`: the image is at the radius `atan(2 r tan(ω / 2)) / ω`, where r is
/// the radius at depth 1. All directions less than 90 degrees from the axis are covered.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fov {
    omega: [f64; 1],
    /// The factor `2 tan(ω / 2)`.
    steep: f64,
}

impl Fov {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        let Ok([omega]) = <[f64; 1]>::try_from(given) else {
            return Err(wrong_count(given, LensModel::Fov, "1 (omega)"));
        };
        let omega = omega.abs();
        if !(omega > 0.0 && omega < PI) {
            return Err(SceneError::lens(format!(
                "distortion {given:?}: the fov model requires omega greater than 0 and less than π radians; for no \
                 distortion use a pinhole"
            )));
        }
        Ok(Self { omega: [omega], steep: 2.0 * (0.5 * omega).tan() })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.omega
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let across = direction.truncate().length();
        if direction.z.is_nan() || direction.z <= 0.0 {
            return None;
        }
        if across == 0.0 {
            return Some(DVec2::ZERO);
        }
        let angle = (self.steep * across).atan2(direction.z);
        Some(direction.truncate() * (angle / self.omega[0] / across))
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let radius = image.length();
        let angle = radius * self.omega[0];
        if angle.is_nan() || angle >= FRAC_PI_2 {
            return None;
        }
        if radius == 0.0 {
            return Some(DVec3::Z);
        }
        let (sin, cos) = angle.sin_cos();
        Some((image * (sin / radius)).extend(cos * self.steep))
    }
}
