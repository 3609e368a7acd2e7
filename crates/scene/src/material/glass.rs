//! The material of glass, water and other clear media.

use crate::color::Rgb;
use crate::error::{Result, SceneError};

/// A dielectric: the interior of a closed mesh, or a pane. The base colour tints light that passes the surface.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Glass {
    /// Index of refraction, >= 1.
    pub ior: f32,
    /// Perceptual roughness, 0..=1; alpha is its square.
    pub roughness: f32,
    /// True if each surface is a separate pane, through which light passes straight.
    pub thin: bool,
    /// Dispersion: 20 divided by the Abbe number; 0 without dispersion.
    pub dispersion: f32,
    /// Transmittance after `attenuation_distance`.
    pub attenuation_color: Rgb,
    /// Distance in metres after which white light has the `attenuation_color`; infinite without absorption.
    pub attenuation_distance: f32,
}

impl Default for Glass {
    /// Smooth window glass.
    fn default() -> Self {
        Self {
            ior: 1.5,
            roughness: 0.0,
            thin: false,
            dispersion: 0.0,
            attenuation_color: [1.0; 3],
            attenuation_distance: f32::INFINITY,
        }
    }
}

impl Glass {
    /// Checks the glass's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for a value that is not finite or outside its range.
    pub fn validate(&self) -> Result<()> {
        let fail = |message: String| Err(SceneError::material(message));
        if !(self.ior.is_finite() && self.ior >= 1.0) {
            return fail(format!("ior is {}; expected a finite number >= 1", self.ior));
        }
        if !(self.dispersion.is_finite() && self.dispersion >= 0.0) {
            return fail(format!("dispersion is {}; expected a finite number >= 0", self.dispersion));
        }
        if !self.attenuation_color.iter().all(|v| (0.0..=1.0).contains(v)) {
            return fail(format!("attenuation_color is {:?}; expected numbers from 0 to 1", self.attenuation_color));
        }
        if self.attenuation_distance.is_nan() || self.attenuation_distance <= 0.0 {
            return fail(format!(
                "attenuation_distance is {}; expected a number > 0, or infinity",
                self.attenuation_distance
            ));
        }
        check_roughness(self.roughness)
    }
}

pub(crate) fn check_roughness(roughness: f32) -> Result<()> {
    if (0.0..=1.0).contains(&roughness) {
        return Ok(());
    }
    Err(SceneError::material(format!("roughness is {roughness}; expected 0 to 1")))
}
