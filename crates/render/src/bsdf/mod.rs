//! Bidirectional scattering distribution functions (BSDFs) of every [`raycam_scene::MaterialModel`] at a point.
//!
//! `wo` points towards the viewer and `wi` towards the light; both point away from the surface and have unit length.
//! `eval` and `sample` agree: a sample's weight is its value divided by its density, and a direction that `sample`
//! never returns has density zero.
//!
//! [`diffuse`], [`specular`], [`phong`] and [`layered`] are the BSDFs of one point; [`conductor`], [`dielectric`] and
//! [`principled`] are layers; [`batch`] evaluates the frequent BSDFs for many points at once. This folder uses `lobes`,
//! `sampling`, `interaction` and `prepare`.

pub(crate) mod base_directions;
pub(crate) mod batch;
pub(crate) mod conductor;
pub(crate) mod dielectric;
pub(crate) mod diffuse;
pub(crate) mod exact_interface;
pub(crate) mod hit_layers;
pub(crate) mod layer_stack;
pub(crate) mod layered;
pub(crate) mod layered_sampling;
pub(crate) mod material_hit;
pub(crate) mod multiscatter_dielectric;
pub(crate) mod phong;
pub(crate) mod principled;
pub(crate) mod shading_point;
pub(crate) mod specular;
#[cfg(test)]
pub(crate) mod tests;

use glam::Vec3;

use crate::lobes::shading_frame::ShadingFrame;

/// A sampled direction, with its weight and density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfSample {
    /// World direction towards the light.
    pub wi: Vec3,
    /// Value (reflectance or transmittance times cosine) divided by density.
    pub weight: Vec3,
    /// Density by solid angle; 0 for specular samples.
    pub pdf: f32,
    /// True for a direction from a discrete set, which light sampling never finds.
    pub is_specular: bool,
    /// Square of the relative index of refraction for a refracted sample, otherwise 1. The weight is divided by this
    /// factor, and multiplied by it again when the path leaves the medium.
    pub eta_scale: f32,
}

impl BsdfSample {
    /// Creates a specular sample that is not refracted.
    #[inline(always)]
    pub fn specular(wi: Vec3, weight: Vec3) -> Self {
        Self { wi, weight, pdf: 0.0, is_specular: true, eta_scale: 1.0 }
    }
}

/// Value of a direction, and the density of sampling that direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BsdfEval {
    /// Reflectance or transmittance in 1/sr times the cosine.
    pub value: Vec3,
    /// Density by solid angle.
    pub pdf: f32,
}

/// The BSDF at a point for one viewing direction.
pub(crate) trait BsdfModel {
    /// Value and density for light from the world direction `wi`.
    fn eval(&self, frame: &ShadingFrame, wi: Vec3) -> BsdfEval;
    /// Part of the value that comes from diffuse lobes.
    fn eval_diffuse(&self, _frame: &ShadingFrame, _wi: Vec3) -> Vec3 {
        Vec3::ZERO
    }
    /// Samples a world direction; `None` if the light is absorbed. The first random number selects a lobe.
    fn sample(&self, frame: &ShadingFrame, random: [f32; 3]) -> Option<BsdfSample>;
    /// Directional albedo for the viewing direction.
    fn albedo(&self, frame: &ShadingFrame) -> Vec3;
    /// Part of the directional albedo that comes from diffuse lobes.
    fn diffuse_albedo(&self, _frame: &ShadingFrame) -> Vec3 {
        Vec3::ZERO
    }
    /// True if light sampling may contribute.
    fn is_non_specular(&self) -> bool;
    /// True if light from behind the surface reaches the viewer.
    fn is_transmissive(&self) -> bool;
    /// True if [`BsdfModel::sample`] needs its first random number.
    fn needs_lobe_sample(&self) -> bool;
}
