//! The GGX distribution of microfacets, with visible normals.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; E. Heitz, "Understanding the
//! Masking-Shadowing Function", JCGT 3(2), 2014 (height-correlated, anisotropic); J. Dupuy and A. Benyoub, "Sampling
//! Visible GGX Normals with Spherical Caps", 2023. Directions are in coordinates along tangent, bitangent and normal.

use std::f32::consts::PI;

use glam::Vec3;

use crate::lobes::fresnel::Fresnel;
use crate::lobes::shading_frame::turn;

/// Roughness along the tangent and the bitangent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    pub x: f32,
    pub y: f32,
}

/// Below this, float32 cannot tell a lobe from a mirror.
const SMOOTH: f32 = 1e-3;

impl Ggx {
    /// Of perceptual roughness 0..=1, the same in all directions.
    #[inline(always)]
    pub fn isotropic(roughness: f32) -> Self {
        let alpha = roughness * roughness;
        Self { x: alpha, y: alpha }
    }

    /// Whether it is a mirror.
    #[inline(always)]
    pub fn is_smooth(&self) -> bool {
        self.x.max(self.y) < SMOOTH
    }

    /// The perceptual roughness of an isotropic lobe that is about as wide.
    #[inline(always)]
    pub fn roughness(&self) -> f32 {
        (self.x * self.y).sqrt().sqrt()
    }

    /// Whether it is the same in all directions.
    pub fn is_isotropic(&self) -> bool {
        self.x == self.y
    }

    /// The density of normals over projected area.
    #[inline(always)]
    pub fn density(&self, h: Vec3) -> f32 {
        let (x, y) = (h.x / self.x, h.y / self.y);
        let s = x * x + y * y + h.z * h.z;
        1.0 / (PI * self.x * self.y * s * s)
    }

    /// Smith's function: hidden area per visible area.
    #[inline(always)]
    fn lambda(&self, v: Vec3) -> f32 {
        let (x, y) = (self.x * v.x, self.y * v.y);
        ((1.0 + (x * x + y * y) / (v.z * v.z)).sqrt() - 1.0) / 2.0
    }

    /// The share of microfacets that a direction sees.
    #[inline(always)]
    pub fn visible(&self, v: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(v))
    }

    /// The share that two directions see.
    #[inline(always)]
    pub fn visible_both(&self, v: Vec3, l: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(v) + self.lambda(l))
    }

    /// The share of what one direction sees that the other sees too.
    pub fn visible_also(&self, v: Vec3, l: Vec3) -> f32 {
        let seen = self.lambda(v);
        (1.0 + seen) / (1.0 + seen + self.lambda(l))
    }

    /// A normal as often as `v`, above the surface, sees it.
    #[inline(always)]
    pub fn sample(&self, v: Vec3, [a, b]: [f32; 2]) -> Vec3 {
        let standard = Vec3::new(self.x * v.x, self.y * v.y, v.z).normalize();
        let z = (1.0 - b) * (1.0 + standard.z) - standard.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = turn(a);
        let cap = Vec3::new(radius * cos, radius * sin, z);
        let h = cap + standard;
        Vec3::new(self.x * h.x, self.y * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// The density of [`Ggx::sample`] by solid angle.
    #[inline(always)]
    pub fn pdf(&self, v: Vec3, h: Vec3) -> f32 {
        self.visible(v) * v.dot(h).max(0.0) * self.density(h) / v.z
    }
}

/// How rough mirrors send light from `l` to `v`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facets {
    /// Between either direction and the normal of the microfacets that do.
    pub cosine: f32,
    /// What their reflectance is multiplied by, cosine of the light included.
    pub seen: f32,
    /// The density of sampling `l` by [`Ggx::sample`].
    pub pdf: f32,
}

impl Facets {
    #[inline(always)]
    pub fn new(ggx: &Ggx, v: Vec3, l: Vec3) -> Self {
        let h = (v + l).normalize_or(Vec3::Z);
        let shape = ggx.density(h) / (4.0 * v.z);
        Self {
            cosine: v.dot(h),
            seen: shape * ggx.visible_both(v, l),
            pdf: shape * ggx.visible(v),
        }
    }
}

/// The reflection of rough mirrors, times the cosine, and the density of sampling it.
pub(crate) fn microfacets(ggx: &Ggx, fresnel: &Fresnel, v: Vec3, l: Vec3) -> (Vec3, f32) {
    let Facets { cosine, seen, pdf } = Facets::new(ggx, v, l);
    (fresnel.reflected(cosine) * seen, pdf)
}
