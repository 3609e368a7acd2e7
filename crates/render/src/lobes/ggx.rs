//! The GGX distribution of microfacets, with visible normals.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; E. Heitz, "Understanding the
//! Masking-Shadowing Function", JCGT 3(2), 2014 (height-correlated, anisotropic); J. Dupuy and A. Benyoub, "Sampling
//! Visible GGX Normals with Spherical Caps", 2023. Directions are in coordinates along tangent, bitangent and normal.

use std::f32::consts::PI;

use glam::Vec3;

use crate::lobes::fresnel::Fresnel;
use crate::lobes::shading_frame::sincos_turns;

/// Roughness along the tangent and the bitangent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    pub alpha_x: f32,
    pub alpha_y: f32,
}

/// Below this, float32 cannot tell a lobe from a mirror.
const MIN_ALPHA: f32 = 1e-3;

impl Ggx {
    /// Of perceptual roughness 0..=1, the same in all directions.
    #[inline(always)]
    pub fn isotropic(roughness: f32) -> Self {
        let alpha = roughness * roughness;
        Self {
            alpha_x: alpha,
            alpha_y: alpha,
        }
    }

    /// Whether it is a mirror.
    #[inline(always)]
    pub fn effectively_smooth(&self) -> bool {
        self.alpha_x.max(self.alpha_y) < MIN_ALPHA
    }

    /// The perceptual roughness of an isotropic lobe that is about as wide.
    #[inline(always)]
    pub fn roughness(&self) -> f32 {
        (self.alpha_x * self.alpha_y).sqrt().sqrt()
    }

    /// Whether it is the same in all directions.
    pub fn is_isotropic(&self) -> bool {
        self.alpha_x == self.alpha_y
    }

    /// The density of normals over projected area.
    #[inline(always)]
    pub fn d(&self, h: Vec3) -> f32 {
        let (x, y) = (h.x / self.alpha_x, h.y / self.alpha_y);
        let s = x * x + y * y + h.z * h.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * s * s)
    }

    /// Smith's function: hidden area per visible area.
    #[inline(always)]
    fn lambda(&self, v: Vec3) -> f32 {
        let (x, y) = (self.alpha_x * v.x, self.alpha_y * v.y);
        ((1.0 + (x * x + y * y) / (v.z * v.z)).sqrt() - 1.0) / 2.0
    }

    /// The share of microfacets that a direction sees.
    #[inline(always)]
    pub fn g1(&self, v: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(v))
    }

    /// The share that two directions see.
    #[inline(always)]
    pub fn g(&self, v: Vec3, l: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(v) + self.lambda(l))
    }

    /// The share of what one direction sees that the other sees too.
    pub fn g_given_g1(&self, v: Vec3, l: Vec3) -> f32 {
        let seen = self.lambda(v);
        (1.0 + seen) / (1.0 + seen + self.lambda(l))
    }

    /// A normal as often as `v`, above the surface, sees it.
    #[inline(always)]
    pub fn sample_wm(&self, v: Vec3, [a, b]: [f32; 2]) -> Vec3 {
        let standard = Vec3::new(self.alpha_x * v.x, self.alpha_y * v.y, v.z).normalize();
        let z = (1.0 - b) * (1.0 + standard.z) - standard.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = sincos_turns(a);
        let cap = Vec3::new(radius * cos, radius * sin, z);
        let h = cap + standard;
        Vec3::new(self.alpha_x * h.x, self.alpha_y * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// The density of [`Ggx::sample_wm`] by solid angle.
    #[inline(always)]
    pub fn pdf(&self, v: Vec3, h: Vec3) -> f32 {
        self.g1(v) * v.dot(h).max(0.0) * self.d(h) / v.z
    }
}

/// How rough mirrors send light from `l` to `v`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MicrofacetEval {
    /// Between either direction and the normal of the microfacets that do.
    pub cosine: f32,
    /// What their reflectance is multiplied by, cosine of the light included.
    pub weight: f32,
    /// The density of sampling `l` by [`Ggx::sample_wm`].
    pub pdf: f32,
}

impl MicrofacetEval {
    #[inline(always)]
    pub fn new(ggx: &Ggx, v: Vec3, l: Vec3) -> Self {
        let h = (v + l).normalize_or(Vec3::Z);
        let shape = ggx.d(h) / (4.0 * v.z);
        Self {
            cosine: v.dot(h),
            weight: shape * ggx.g(v, l),
            pdf: shape * ggx.g1(v),
        }
    }
}

/// The reflection of rough mirrors, times the cosine, and the density of sampling it.
pub(crate) fn eval_reflection(ggx: &Ggx, fresnel: &Fresnel, v: Vec3, l: Vec3) -> (Vec3, f32) {
    let MicrofacetEval {
        cosine,
        weight: seen,
        pdf,
    } = MicrofacetEval::new(ggx, v, l);
    (fresnel.reflectance(cosine) * seen, pdf)
}
