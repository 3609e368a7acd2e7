//! The division model of Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion"
//! (CVPR 2001): COLMAP's SIMPLE_DIVISION and DIVISION.

use glam::{DVec2, DVec3};

use super::model::{LensModel, wrong_count};
use crate::error::Result;

/// The division model with the coefficient `k`: the image point (x, y) at the radius r has the direction (x, y, 1 + k
/// r²). The model is one-to-one within `r < 1 / sqrt(|k|)` for k > 0, and everywhere for k < 0, where it covers all
/// directions except straight back.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Division {
    k: [f64; 1],
}

impl Division {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        let Ok(k) = <[f64; 1]>::try_from(given) else {
            return Err(wrong_count(given, LensModel::Division, "1 (k)"));
        };
        Ok(Self { k })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.k
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let ([k], z, s) = (self.k, direction.z, direction.truncate().length_squared());
        // The radius r solves k ρ r² - z r + ρ = 0; of the two roots, the one that approaches ρ / z for small k is
        // used.
        let square = z * z - 4.0 * k * s;
        if square.is_nan() || square <= 0.0 || (k >= 0.0 && z <= 0.0) {
            return None;
        }
        let root = square.sqrt();
        let image = if z > 0.0 {
            direction.truncate() * (2.0 / (z + root))
        } else if s > 0.0 {
            // This form of the same root avoids cancellation.
            direction.truncate() * ((z - root) / (2.0 * k * s))
        } else {
            return None;
        };
        image.is_finite().then_some(image)
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let ([k], s) = (self.k, image.length_squared());
        let regular = k * s < 1.0 && s.is_finite();
        regular.then(|| image.extend(1.0 + k * s))
    }
}
