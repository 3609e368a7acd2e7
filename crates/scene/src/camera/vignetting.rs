//! Vignetting: light falloff away from the image centre.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Result, SceneError};

/// Factor of a pixel's light: `cos⁴ θ` if requested, times `1 + a r² + b r⁴ + ...`. It affects only the colour.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Vignetting {
    /// True if light falls off with the fourth power of the cosine of its angle to the principal axis, as on a flat
    /// sensor; 0 at 90 degrees and beyond.
    pub cos4: bool,
    /// Coefficients of r², r⁴, ...; r is the distance from the principal point in focal lengths, K⁻¹ (u, v, 1). Pixels
    /// are black where the polynomial is negative.
    pub polynomial: Vec<f64>,
}

impl Vignetting {
    /// Checks the coefficients.
    ///
    /// # Errors
    /// [`SceneError::Camera`] for coefficients that are not finite.
    pub fn validate(&self) -> Result<()> {
        if self.polynomial.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        Err(SceneError::camera(format!(
            "vignetting: polynomial is {:?}; expected finite coefficients",
            self.polynomial
        )))
    }

    /// Factor at a point of the image plane whose light has this unit direction in camera axes.
    pub(super) fn factor(&self, image: DVec2, direction: DVec3) -> f64 {
        let s = image.length_squared();
        let sum = self.polynomial.iter().rev().fold(0.0, |sum, a| (sum + a) * s);
        let cosine = if self.cos4 { direction.z.max(0.0) } else { 1.0 };
        (1.0 + sum).max(0.0) * cosine.powi(4)
    }
}
