//! Media by name, from measurements.

use crate::color::Rgb;
use crate::medium::Medium;

/// Wavelengths of [`JERLOV`] in nanometres.
const WAVELENGTHS: [f32; 13] = [400., 425., 450., 475., 500., 525., 550., 575., 600., 625., 650., 675., 700.];

/// Dominant wavelengths of the primaries of Rec. 709, in nanometres.
const PRIMARIES: [f32; 3] = [611.4, 549.1, 464.2];

/// Attenuation of daylight in water per metre, by Jerlov's water types.
///
/// N. G. Jerlov, "Marine Optics", 2nd edition, 1976, table XXVII (downward irradiance).
const JERLOV: [(&str, [f32; 13]); 10] = [
    ("jerlov_I", [0.027, 0.022, 0.019, 0.018, 0.027, 0.043, 0.063, 0.089, 0.235, 0.305, 0.36, 0.42, 0.56]),
    ("jerlov_IA", [0.038, 0.031, 0.026, 0.025, 0.032, 0.048, 0.067, 0.094, 0.24, 0.31, 0.37, 0.43, 0.57]),
    ("jerlov_IB", [0.051, 0.042, 0.036, 0.033, 0.042, 0.054, 0.072, 0.099, 0.245, 0.315, 0.375, 0.435, 0.58]),
    ("jerlov_II", [0.096, 0.081, 0.068, 0.062, 0.07, 0.076, 0.089, 0.115, 0.26, 0.335, 0.4, 0.465, 0.61]),
    ("jerlov_III", [0.185, 0.16, 0.135, 0.116, 0.115, 0.116, 0.12, 0.148, 0.295, 0.375, 0.445, 0.52, 0.66]),
    ("jerlov_1C", [0.51, 0.36, 0.25, 0.17, 0.14, 0.13, 0.12, 0.15, 0.3, 0.37, 0.45, 0.51, 0.65]),
    ("jerlov_3C", [0.78, 0.54, 0.39, 0.29, 0.22, 0.2, 0.19, 0.21, 0.33, 0.4, 0.46, 0.56, 0.71]),
    ("jerlov_5C", [1.1, 0.78, 0.56, 0.43, 0.36, 0.31, 0.3, 0.33, 0.4, 0.48, 0.54, 0.65, 0.8]),
    ("jerlov_7C", [1.6, 1.2, 0.89, 0.71, 0.58, 0.49, 0.46, 0.46, 0.48, 0.54, 0.63, 0.78, 0.92]),
    ("jerlov_9C", [2.4, 1.9, 1.6, 1.23, 0.99, 0.78, 0.63, 0.58, 0.6, 0.65, 0.76, 0.92, 1.1]),
];

/// Absorption and reduced scattering of milk per metre; reduced scattering is the equivalent scattering for g = 0.
///
/// H. W. Jensen et al., "A Practical Model for Subsurface Light Transport", SIGGRAPH 2001, figure 5.
const MILK: [(&str, Rgb, Rgb); 2] =
    [("milk", [1.1, 2.4, 14.0], [2550.0, 3210.0, 3770.0]), ("skim_milk", [1.4, 2.5, 14.2], [700.0, 1220.0, 1900.0])];

/// Absorption of soot in m²/g at the wavelength [`SOOT_WAVELENGTH`] (nanometres); absorption is inversely
/// proportional to the wavelength. [`SOOT_ALBEDO`] is the albedo of fresh soot: the middle of the published range,
/// 0.2 to 0.3.
///
/// T. C. Bond and R. W. Bergstrom, "Light Absorption by Carbonaceous Particles: An Investigative Review", Aerosol
/// Science and Technology 40, 2006.
const SOOT_ABSORPTION: f32 = 7.5;
const SOOT_WAVELENGTH: f32 = 550.0;
const SOOT_ALBEDO: f32 = 0.25;
/// Mean cosine of the scattering angles of soot, whose aggregates of many spheres scatter mostly forwards: the middle
/// of the range 0.4 to 0.6.
const SOOT_G: f32 = 0.5;
/// Soot concentration in a fire's smoke, in g/m³; visibility is then 3 m.
const SMOKE_DENSITY: f32 = 0.1;

/// The names of all presets.
pub fn names() -> impl Iterator<Item = &'static str> {
    JERLOV.iter().map(|row| row.0).chain(MILK.iter().map(|row| row.0)).chain(["smoke"])
}

/// The smoke of a fire: soot in air.
fn smoke() -> Medium {
    let absorption = PRIMARIES.map(|wavelength| SMOKE_DENSITY * SOOT_ABSORPTION * SOOT_WAVELENGTH / wavelength);
    let scattering = absorption.map(|absorption| absorption * SOOT_ALBEDO / (1.0 - SOOT_ALBEDO));
    Medium { absorption, scattering, g: SOOT_G }
}

impl Medium {
    /// The preset with this name; `None` for an unknown name.
    pub fn named(name: &str) -> Option<Self> {
        if name == "smoke" {
            return Some(smoke());
        }
        if let Some((_, spectrum)) = JERLOV.iter().find(|row| row.0 == name) {
            let absorption = PRIMARIES.map(|wavelength| interpolate(spectrum, wavelength));
            return Some(Self { absorption, ..Self::default() });
        }
        let &(_, absorption, scattering) = MILK.iter().find(|row| row.0 == name)?;
        Some(Self { absorption, scattering, g: 0.0 })
    }
}

/// The value of a spectrum at a wavelength, interpolated linearly between its entries.
fn interpolate(spectrum: &[f32; 13], wavelength: f32) -> f32 {
    let after = WAVELENGTHS.partition_point(|&known| known <= wavelength).clamp(1, WAVELENGTHS.len() - 1);
    let [low, high] = [WAVELENGTHS[after - 1], WAVELENGTHS[after]];
    let share = (wavelength - low) / (high - low);
    spectrum[after - 1] * (1.0 - share) + spectrum[after] * share
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Through 3 m of smoke, 5 % of the light passes at 550 nm (Koschmieder's visibility).
    #[test]
    fn smoke_has_the_albedo_of_soot_and_a_visibility_of_3_m() {
        let Medium { absorption, scattering, .. } = Medium::named("smoke").unwrap();
        for i in 0..3 {
            assert!((absorption[i] - 0.75 * 550.0 / PRIMARIES[i]).abs() < 1e-6);
            assert!((scattering[i] / (absorption[i] + scattering[i]) - 0.25).abs() < 1e-6);
        }
        let passed = (-3.0 * (absorption[1] + scattering[1])).exp();
        assert!((passed - 0.05).abs() < 1e-3, "{passed}");
    }

    #[test]
    fn every_preset_name_returns_a_valid_medium() {
        assert!(names().all(|name| Medium::named(name).is_some_and(|medium| medium.validate().is_ok())));
    }
}
