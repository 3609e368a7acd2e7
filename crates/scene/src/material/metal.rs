//! Metals by their measured index of refraction.

use crate::color::Rgb;
use crate::error::{Result, SceneError};

/// A rough or smooth metal.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Metal {
    /// The real part of the index of refraction, per channel.
    pub ior: Rgb,
    /// The imaginary part of the index of refraction, per channel.
    pub extinction: Rgb,
    /// Perceptual roughness, 0..=1; alpha is its square.
    pub roughness: f32,
}

/// Row of the table of metals.
struct MetalEntry {
    name: &'static str,
    ior: Rgb,
    extinction: Rgb,
}

const fn metal(name: &'static str, ior: Rgb, extinction: Rgb) -> MetalEntry {
    MetalEntry { name, ior, extinction }
}

/// Indices of refraction fitted by `benchmarks/fold_metals.py`: their reflectance from 0 to 89 degrees is as close as
/// possible to that of the measured spectra under D65, converted to linear Rec. 709. P. B. Johnson and R. W. Christy,
/// Phys. Rev. B 6, 4370 (1972) and 9, 5056 (1974); aluminium from F. Cheng et al., ACS Nano 10, 9852 (2016). The
/// comment on each row is the reflectance at normal incidence.
const METALS: [MetalEntry; 8] = [
    metal("aluminium", [0.854, 0.574, 0.375], [6.092, 5.203, 4.212]), // reflectance 0.916, 0.922, 0.924
    metal("chromium", [3.244, 3.116, 2.284], [3.286, 3.336, 3.116]),  // reflectance 0.550, 0.556, 0.554
    metal("copper", [0.227, 1.039, 1.295], [3.285, 2.627, 2.360]),    // reflectance 0.927, 0.624, 0.522
    metal("gold", [0.091, 0.496, 1.468], [15.068, 2.262, 1.774]),     // reflectance 1.000, 0.730, 0.365
    metal("iron", [2.922, 2.920, 2.545], [3.074, 2.939, 2.749]),      // reflectance 0.529, 0.513, 0.494
    metal("nickel", [2.027, 1.904, 1.728], [4.181, 3.576, 2.894]),    // reflectance 0.696, 0.641, 0.563
    metal("silver", [0.056, 0.055, 0.043], [4.450, 3.551, 2.588]),    // reflectance 0.989, 0.984, 0.978
    metal("titanium", [2.739, 2.510, 2.239], [3.833, 3.401, 3.014]),  // reflectance 0.618, 0.580, 0.543
];

impl Metal {
    /// Names of the known metals.
    pub fn names() -> impl Iterator<Item = &'static str> {
        METALS.iter().map(|row| row.name)
    }

    /// Returns the smooth metal with this name.
    pub fn named(name: &str) -> Option<Self> {
        METALS.iter().find(|row| row.name == name).map(|row| Self {
            ior: row.ior,
            extinction: row.extinction,
            roughness: 0.0,
        })
    }

    /// Checks the metal's values.
    ///
    /// # Errors
    /// [`SceneError::World`] for indices that are not finite and greater than 0, and for a roughness outside 0..=1.
    pub fn validate(&self) -> Result<()> {
        for (name, values) in [("ior", self.ior), ("extinction", self.extinction)] {
            if !values.iter().all(|v| v.is_finite() && *v > 0.0) {
                return Err(SceneError::material(format!(
                    "{name} is {values:?}; expected finite red, green and blue > 0"
                )));
            }
        }
        crate::material::glass::check_roughness(self.roughness)
    }
}
