//! Lambertian reflection of many points at once. Samples may be guided.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::batch::{ActiveLanes, BatchModel, BsdfEvals, BsdfSamples, LaneContext, LaneRandoms};
use crate::bsdf::diffuse::{Diffuse, lambert};
use crate::lobes::cone_mixture::{ConeMixture, mixture_weight};
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// Diffuse BSDFs of the lanes: their albedos and sampled directions.
#[derive(Debug, Default)]
pub(crate) struct DiffuseModel {
    pub albedo: Vec3xN<f32, LANES>,
    pub guiding: ConeMixture<LANES>,
    /// Sampled direction of every lane, for any BSDF model, from [`crate::bsdf::diffuse::SampleCosineHemisphere`] or
    /// path guiding.
    pub directions: Vec3xN<f32, LANES>,
}

impl DiffuseModel {
    /// Diffuse BSDF of a single lane.
    pub fn lane(&self, lane: usize) -> Diffuse<'_> {
        Diffuse {
            albedo: lane_vec3(&self.albedo, lane),
            sampled_direction: lane_vec3(&self.directions, lane),
            guiding: self.guiding.has_cones().then_some((&self.guiding, lane)),
        }
    }
}

impl BatchModel for DiffuseModel {
    type View = ();

    #[inline(always)]
    fn prepare_view(&self, _: &ActiveLanes, _: LaneContext, _: LaneRandoms) {}

    #[inline(always)]
    fn sample(&self, (): &(), _: &ActiveLanes, context: LaneContext, _: LaneRandoms) -> BsdfSamples {
        let interactions = context.interactions;
        let mut samples = BsdfSamples::default();
        let mut cosines = [0.0; LANES];
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            let wi = lane_vec3(&self.directions, lane);
            *cosine = interactions.shading_normal(lane).dot(wi);
            samples.is_valid[lane] = interactions.side_normal(lane).dot(wi) > 0.0;
            samples.set_direction(context, lane, wi);
        }
        samples.pdf = self.guiding.pdfs(&self.directions, &cosines);
        samples.weight = self.albedo;
        if self.guiding.has_cones() {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let ratio = mixture_weight(cosine, samples.pdf[lane]);
                let weight = lane_vec3(&self.albedo, lane) * ratio;
                set_lane(&mut samples.weight, lane, weight.to_array());
            }
        }
        samples
    }

    #[inline(always)]
    fn eval(&self, (): &(), _: &ActiveLanes, context: LaneContext, wi: &Vec3xN<f32, LANES>) -> BsdfEvals {
        let interactions = context.interactions;
        let (mut evals, mut cosines) = (BsdfEvals::default(), [0.0; LANES]);
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            *cosine = interactions.shading_normal(lane).dot(lane_vec3(wi, lane));
        }
        let pdfs = self.guiding.pdfs(wi, &cosines);
        for lane in 0..LANES {
            let (wi, cosine): (Vec3, f32) = (lane_vec3(wi, lane), cosines[lane]);
            let is_back = (interactions.side_normal(lane).dot(wi) <= 0.0) | (cosine <= 0.0);
            let eval = BsdfEval { value: lambert(lane_vec3(&self.albedo, lane), cosine), pdf: pdfs[lane] };
            evals.set(lane, !is_back, eval);
        }
        evals
    }

    fn single(&self, lane: usize) -> Option<Diffuse<'_>> {
        Some(self.lane(lane))
    }
}
