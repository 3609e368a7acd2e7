//! The GGX (Trowbridge-Reitz) distribution of microfacets, sampled by visible normals.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; E. Heitz, "Understanding the
//! Masking-Shadowing Function", JCGT 3(2), 2014 (height-correlated, anisotropic); J. Dupuy and A. Benyoub, "Sampling
//! Visible GGX Normals with Spherical Caps", 2023. `wm` is a microfacet normal.

use std::f32::consts::PI;

use glam::Vec3;

use crate::lobes::shading_frame::sincos_turns;

/// GGX distribution, given by its widths along the tangent and the bitangent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    pub alpha_x: f32,
    pub alpha_y: f32,
}

/// Minimum width; narrower distributions count as mirrors, because float32 cannot resolve their peak.
const MIN_ALPHA: f32 = 1e-3;

impl Ggx {
    /// The isotropic distribution for a perceptual roughness in 0..=1.
    #[inline(always)]
    pub fn isotropic(roughness: f32) -> Self {
        Self::from_alpha(roughness * roughness)
    }

    /// The isotropic distribution with the width `alpha`.
    #[inline(always)]
    pub fn from_alpha(alpha: f32) -> Self {
        Self { alpha_x: alpha, alpha_y: alpha }
    }

    /// True if the distribution is so narrow that the surface counts as a mirror.
    #[inline(always)]
    pub fn effectively_smooth(&self) -> bool {
        self.alpha_x.max(self.alpha_y) < MIN_ALPHA
    }

    /// Perceptual roughness of an isotropic distribution of about the same width.
    #[inline(always)]
    pub fn roughness(&self) -> f32 {
        (self.alpha_x * self.alpha_y).sqrt().sqrt()
    }

    /// True if the distribution has the same width in all directions.
    pub fn is_isotropic(&self) -> bool {
        self.alpha_x == self.alpha_y
    }

    /// Distribution function D: area of the microfacets with this normal, per solid angle and per area of the
    /// surface.
    #[inline(always)]
    pub fn d(&self, wm: Vec3) -> f32 {
        let (x, y) = (wm.x / self.alpha_x, wm.y / self.alpha_y);
        let s = x * x + y * y + wm.z * wm.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * s * s)
    }

    /// Smith's function: masked area divided by visible area.
    #[inline(always)]
    fn lambda(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        ((1.0 + (x * x + y * y) / (w.z * w.z)).sqrt() - 1.0) / 2.0
    }

    /// The fraction of microfacets visible from one direction.
    #[inline(always)]
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// The fraction of microfacets visible from both directions.
    #[inline(always)]
    pub fn g(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// G / G1: the fraction of the microfacets visible from `wo` that are also visible from `wi`.
    pub fn g_given_g1(&self, wo: Vec3, wi: Vec3) -> f32 {
        let lambda = self.lambda(wo);
        (1.0 + lambda) / (1.0 + lambda + self.lambda(wi))
    }

    /// Samples a microfacet normal in proportion to its area visible from `wo`, which lies above the surface.
    #[inline(always)]
    pub fn sample_wm(&self, wo: Vec3, [a, b]: [f32; 2]) -> Vec3 {
        let standard = Vec3::new(self.alpha_x * wo.x, self.alpha_y * wo.y, wo.z).normalize();
        let z = (1.0 - b) * (1.0 + standard.z) - standard.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = sincos_turns(a);
        let cap = Vec3::new(radius * cos, radius * sin, z);
        let wm = cap + standard;
        Vec3::new(self.alpha_x * wm.x, self.alpha_y * wm.y, wm.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// The density of [`Ggx::sample_wm`] by solid angle.
    #[inline(always)]
    pub fn pdf(&self, wo: Vec3, wm: Vec3) -> f32 {
        self.g1(wo) * wo.dot(wm).max(0.0) * self.d(wm) / wo.z
    }
}

/// Evaluation of the microfacets that scatter light from `wi` to `wo`, without Fresnel terms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MicrofacetEval {
    /// Cosine between `wo` and the normal of these microfacets.
    pub cosine: f32,
    /// Factor on the reflectance or transmittance of these microfacets: D G divided by the cosines in the definition of
    /// the BSDF, times the cosine of `wi`.
    pub weight: f32,
    /// The density of sampling `wi` by [`Ggx::sample_wm`], by solid angle.
    pub pdf: f32,
}

impl MicrofacetEval {
    /// Evaluates the microfacets that reflect `wi` to `wo`.
    #[inline(always)]
    pub fn reflection(ggx: &Ggx, wo: Vec3, wi: Vec3) -> Self {
        let wm = (wo + wi).normalize_or(Vec3::Z);
        let shape = ggx.d(wm) / (4.0 * wo.z);
        Self { cosine: wo.dot(wm), weight: shape * ggx.g(wo, wi), pdf: shape * ggx.g1(wo) }
    }

    /// Evaluates the microfacets that refract `wi` to `wo`; the weight and density are zero if there are
    /// none. `eta` is the index of refraction on the side of `wi` relative to the side of `wo`.
    #[inline(always)]
    pub fn refraction(ggx: &Ggx, eta: f32, wo: Vec3, wi: Vec3) -> Self {
        let wm = (wo + wi * eta).normalize_or_zero();
        let wm = if wm.z < 0.0 { -wm } else { wm };
        let (cosine, cosine_wi) = (wo.dot(wm), wi.dot(wm));
        // The Jacobian d(wm) / d(wi), without the factor eta^2 by which radiance is reduced in this direction.
        let jacobian = -cosine_wi / (cosine + eta * cosine_wi).powi(2);
        let mirrored = Vec3::new(wi.x, wi.y, -wi.z);
        let shape = ggx.d(wm) * ggx.g(wo, mirrored) * cosine / wo.z;
        let is_none = (cosine <= 0.0) | (cosine_wi >= 0.0);
        Self {
            cosine: if is_none { 1.0 } else { cosine },
            weight: if is_none { 0.0 } else { shape * jacobian },
            pdf: if is_none { 0.0 } else { ggx.pdf(wo, wm) * eta * eta * jacobian },
        }
    }
}
