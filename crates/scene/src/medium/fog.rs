//! Fog that fills a world.

use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::medium::{check_coefficients, check_mean_cosine};

/// Fog everywhere outside of objects, or below a height.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fog {
    /// The fraction of light that is absorbed or scattered, per metre.
    pub extinction: Rgb,
    /// The fraction of that light which is scattered, 0..=1.
    pub albedo: Rgb,
    /// The mean cosine of scattering angles, between -1 and 1 (L. G. Henyey and J. L. Greenstein, 1941).
    pub g: f32,
    /// The coordinate along the world's up axis below which the fog is; everywhere if absent.
    pub height: Option<f64>,
}

impl Fog {
    /// Checks the fog's values.
    ///
    /// # Errors
    /// [`SceneError::Schema`]: a value that is not finite or outside of its range.
    pub fn validate(&self) -> Result<()> {
        check_coefficients("extinction", self.extinction)?;
        if !self.albedo.iter().all(|v| (0.0..=1.0).contains(v)) {
            let message = format!("{:?}; expected numbers from 0 to 1", self.albedo);
            return Err(SceneError::schema(ErrorCode::OutOfRange, "albedo", message));
        }
        check_mean_cosine(self.g)?;
        match self.height {
            Some(height) if !height.is_finite() => {
                let message = format!("{height}; expected a finite coordinate (omit height for fog everywhere)");
                Err(SceneError::schema(ErrorCode::OutOfRange, "height", message))
            }
            _ => Ok(()),
        }
    }

    /// The scattering coefficient per metre.
    pub fn scattering(&self) -> Rgb {
        std::array::from_fn(|i| self.extinction[i] * self.albedo[i])
    }
}
