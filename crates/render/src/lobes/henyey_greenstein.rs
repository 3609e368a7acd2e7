//! The phase function of Henyey and Greenstein: how a medium scatters light by angle.
//!
//! L. G. Henyey and J. L. Greenstein, "Diffuse Radiation in the Galaxy", Astrophysical Journal 93, 1941.

use std::f32::consts::PI;

use glam::Vec3;

use crate::lobes::shading_frame::{sincos_turns, to_world_around};

/// Mean cosine below which the distribution is linear in the cosine.
const MIN_G: f32 = 1e-3;

/// Density by solid angle with which light is scattered by an angle of this cosine; the integral over the sphere is 1.
#[inline]
pub(crate) fn henyey_greenstein(cosine: f32, g: f32) -> f32 {
    // 1 + g^2 - 2 g cos, without cancellation near the peak.
    let base = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine);
    let base = base.max(f32::MIN_POSITIVE);
    (1.0 - g) * (1.0 + g) / (4.0 * PI * base * base.sqrt())
}

/// A direction into which light along `direction` is scattered, with the density of [`henyey_greenstein`].
pub(crate) fn sample_henyey_greenstein(direction: Vec3, g: f32, [x, y]: [f32; 2]) -> Vec3 {
    let cosine = if g.abs() < MIN_G {
        // An expansion to first order in g is used, because the division below would lose all digits.
        let even = 1.0 - 2.0 * x;
        (even + 1.5 * g * (1.0 - even * even)).clamp(-1.0, 1.0)
    } else {
        let part = (1.0 - g) * (1.0 + g) / (1.0 + g - 2.0 * g * x);
        ((1.0 + g * g - part * part) / (2.0 * g)).clamp(-1.0, 1.0)
    };
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = sincos_turns(y);
    to_world_around(direction, Vec3::new(sine * cos, sine * sin, cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean cosine of the samples is g. The samples have the reported density: the mean of 1 / density is the area
    /// of the sphere.
    #[test]
    fn phase_function_samples_have_the_mean_cosine_and_density() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let count = 600;
        let unit = |i: usize| (i as f32 + 0.5) / count as f32;
        for g in [-0.9, -0.3, 0.0, 5e-4, 2e-3, 0.5, 0.95] {
            let (mut mean, mut area) = (0.0, 0.0);
            for i in 0..count {
                let wi = sample_henyey_greenstein(axis, g, [unit(i), 0.3]);
                let cosine = f64::from(axis.dot(wi));
                mean += cosine / count as f64;
                area += 1.0 / f64::from(henyey_greenstein(cosine as f32, g)) / count as f64;
            }
            assert!((mean - f64::from(g)).abs() < 3e-3, "{g}: {mean}");
            let sphere = 4.0 * std::f64::consts::PI;
            assert!((area / sphere - 1.0).abs() < 2e-2, "{g}: {area}");
        }
    }
}
