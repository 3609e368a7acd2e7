//! The phase function of Henyey and Greenstein: how a medium scatters light by angle.
//!
//! L. G. Henyey and J. L. Greenstein, "Diffuse Radiation in the Galaxy", Astrophysical Journal 93, 1941.

use std::f32::consts::PI;

/// Density by solid angle of light that turns by an angle of this cosine; its integral over the sphere is 1.
#[inline]
pub(crate) fn henyey_greenstein(cosine: f32, g: f32) -> f32 {
    // 1 + g^2 - 2 g cos, without cancellation near the peak.
    let base = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine);
    let base = base.max(f32::MIN_POSITIVE);
    (1.0 - g) * (1.0 + g) / (4.0 * PI * base * base.sqrt())
}
