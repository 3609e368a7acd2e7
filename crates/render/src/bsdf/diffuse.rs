//! Matte surfaces without anything else to them: most of what there is.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::guiding::cones::{GuidingCones, mixture_weight};
use crate::lobes::shading_frame::{
    ShadingFrame, cosine_hemisphere_pdf, sample_cosine_hemisphere, to_world_around,
};
use crate::soa::{LANES, Vec3xN, get_lane, set_lane};

/// One point of such a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Diffuse<'a> {
    pub albedo: Vec3,
    /// Where it scatters to, drawn by [`SampleCosineHemisphere`].
    pub sampled_direction: Vec3,
    /// Where its rays are aimed: in which lane.
    pub guiding: Option<(&'a GuidingCones<LANES>, usize)>,
}

impl Diffuse<'_> {
    #[inline(always)]
    fn pdf(&self, direction: Vec3, cosine: f32) -> f32 {
        match self.guiding {
            Some((aims, lane)) => aims.pdf(lane, direction, cosine),
            None => cosine_hemisphere_pdf(cosine),
        }
    }
}

impl BsdfModel for Diffuse<'_> {
    /// A triangle sends light back on the viewer's side, whatever the smooth surface says.
    #[inline]
    fn eval(&self, frame: &ShadingFrame, light: Vec3) -> BsdfEval {
        let cosine = frame.normal.dot(light);
        if frame.geometric.dot(light) <= 0.0 || cosine <= 0.0 {
            return BsdfEval::default();
        }
        BsdfEval {
            value: self.albedo * FRAC_1_PI * cosine,
            pdf: self.pdf(light, cosine),
        }
    }

    #[inline]
    fn sample(&self, frame: &ShadingFrame, _: [f32; 3]) -> Option<BsdfSample> {
        let direction = self.sampled_direction;
        if frame.geometric.dot(direction) <= 0.0 {
            return None;
        }
        let cosine = frame.normal.dot(direction);
        let pdf = self.pdf(direction, cosine);
        let weight = match self.guiding {
            Some(_) => self.albedo * mixture_weight(cosine, pdf),
            // Exactly: value and density differ by the albedo alone.
            None => self.albedo,
        };
        Some(BsdfSample {
            wi: direction,
            weight,
            pdf,
            is_specular: false,
            eta_scale: 1.0,
        })
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

/// Draws directions of many matte points, by two numbers each.
pub(crate) struct SampleCosineHemisphere<'a, const N: usize> {
    pub normals: &'a Vec3xN<f32, N>,
    pub random: &'a [[f32; N]; 2],
    pub out: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleCosineHemisphere<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let random = [self.random[0][lane], self.random[1][lane]];
            let direction = to_world_around(
                get_lane(self.normals, lane).into(),
                sample_cosine_hemisphere(random),
            );
            set_lane(self.out, lane, direction.to_array());
        }
    }
}
