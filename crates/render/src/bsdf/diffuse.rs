//! Lambertian reflection, the most frequent BSDF: for a single point, and for many points.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::{Hit, WithSimd};
use raycam_scene::MaterialModel;

use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::interaction::ray_cone::Footprint;
use crate::lobes::cone_mixture::{ConeMixture, mixture_weight};
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf, sample_cosine_hemisphere, to_world_around};
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::soa::{LANES, Vec3xN, get_lane, set_lane};

/// Diffuse BSDF at a point, and the direction that sampling returns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Diffuse<'a> {
    pub albedo: Vec3,
    /// Sampled direction, from [`SampleCosineHemisphere`] or path guiding.
    pub sampled_direction: Vec3,
    /// Mixture of cones that guides the samples, and the lane to use; `None` without guiding.
    pub guiding: Option<(&'a ConeMixture<LANES>, usize)>,
}

/// Albedo of a hit whose material only reflects diffusely (and may emit) and has no normal or height map;
/// `None` for other materials.
#[inline]
pub(crate) fn diffuse_albedo(
    geometry: &Geometry,
    prepared: &PreparedMaterial,
    hit: &Hit,
    footprint: &Footprint,
) -> Option<Vec3> {
    let MaterialModel::Phong { diffuse, .. } = prepared.material.model else {
        return None;
    };
    (prepared.phong_lobe.is_none() && !prepared.material.bends_normals())
        .then(|| geometry.base_color_with(prepared, hit, footprint) * diffuse)
}

/// Value of a Lambertian BSDF times the cosine.
#[inline(always)]
pub(crate) fn lambert(albedo: Vec3, cosine: f32) -> Vec3 {
    albedo * FRAC_1_PI * cosine
}

impl Diffuse<'_> {
    #[inline(always)]
    fn pdf(&self, wi: Vec3, cosine: f32) -> f32 {
        match self.guiding {
            Some((cones, lane)) => cones.pdf(lane, wi, cosine),
            None => cosine_hemisphere_pdf(cosine),
        }
    }
}

impl BsdfModel for Diffuse<'_> {
    /// The triangle reflects only on the viewer's side, for any shading normal.
    #[inline]
    fn eval(&self, frame: &ShadingFrame, wi: Vec3) -> BsdfEval {
        let cosine = frame.normal.dot(wi);
        if frame.geometric.dot(wi) <= 0.0 || cosine <= 0.0 {
            return BsdfEval::default();
        }
        BsdfEval { value: lambert(self.albedo, cosine), pdf: self.pdf(wi, cosine) }
    }

    fn eval_diffuse(&self, frame: &ShadingFrame, wi: Vec3) -> Vec3 {
        self.eval(frame, wi).value
    }

    fn diffuse_albedo(&self, _: &ShadingFrame) -> Vec3 {
        self.albedo
    }

    #[inline]
    fn sample(&self, frame: &ShadingFrame, _: [f32; 3]) -> Option<BsdfSample> {
        let wi = self.sampled_direction;
        if frame.geometric.dot(wi) <= 0.0 {
            return None;
        }
        let cosine = frame.normal.dot(wi);
        let pdf = self.pdf(wi, cosine);
        let weight = match self.guiding {
            Some(_) => self.albedo * mixture_weight(cosine, pdf),
            // Without guiding, the weight is exactly the albedo: the value is the density times the albedo.
            None => self.albedo,
        };
        Some(BsdfSample { wi, weight, pdf, is_specular: false, eta_scale: 1.0 })
    }

    fn albedo(&self, _: &ShadingFrame) -> Vec3 {
        self.albedo
    }

    fn is_non_specular(&self) -> bool {
        true
    }

    fn is_transmissive(&self) -> bool {
        false
    }

    fn needs_lobe_sample(&self) -> bool {
        false
    }
}

/// Samples a direction of the cosine-weighted hemisphere for every lane.
pub(crate) struct SampleCosineHemisphere<'a, const N: usize> {
    pub normals: &'a Vec3xN<f32, N>,
    pub random: &'a [[f32; N]; 2],
    pub out: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleCosineHemisphere<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let local = sample_cosine_hemisphere([self.random[0][lane], self.random[1][lane]]);
            let direction = to_world_around(get_lane(self.normals, lane).into(), local);
            set_lane(self.out, lane, direction.to_array());
        }
    }
}
