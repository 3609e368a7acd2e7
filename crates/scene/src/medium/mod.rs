//! Participating media: homogeneous matter that absorbs and scatters light.

pub mod fog;
pub mod preset;

use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Visibility times extinction: the contrast of a black object against the horizon falls to 5 % after the visibility.
///
/// H. Koschmieder, "Theorie der horizontalen Sichtweite", 1924, with the threshold of the meteorological optical range
/// (World Meteorological Organization, Guide to Instruments and Methods of Observation, WMO-No. 8, 9.1.1).
pub fn visibility_constant() -> f64 {
    20f64.ln()
}

/// Matter inside a closed mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Medium {
    /// The fraction of light that is absorbed, per metre.
    pub absorption: Rgb,
    /// The fraction of light that is scattered, per metre.
    pub scattering: Rgb,
    /// The mean cosine of scattering angles, between -1 and 1 (L. G. Henyey and J. L. Greenstein, 1941).
    pub g: f32,
}

impl Medium {
    /// Checks the medium's values.
    ///
    /// # Errors
    /// [`SceneError::Schema`]: a value that is not finite or outside of its range.
    pub fn validate(&self) -> Result<()> {
        check_coefficients("absorption", self.absorption)?;
        check_coefficients("scattering", self.scattering)?;
        check_mean_cosine(self.g)
    }
}

/// Checks that coefficients are finite and at least 0.
pub(crate) fn check_coefficients(key: &str, rgb: Rgb) -> Result<()> {
    if rgb.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Ok(());
    }
    let message = format!("{rgb:?}; expected finite numbers per metre >= 0");
    Err(SceneError::schema(ErrorCode::OutOfRange, key, message))
}

/// Checks that the mean cosine of scattering angles is between -1 and 1.
pub(crate) fn check_mean_cosine(g: f32) -> Result<()> {
    if g > -1.0 && g < 1.0 {
        return Ok(());
    }
    let message = format!("{g}; expected a number between -1 and 1, the mean cosine of the scattering angle");
    Err(SceneError::schema(ErrorCode::OutOfRange, "g", message))
}
