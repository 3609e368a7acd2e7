//! Where light goes on from glossy points.

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::bsdf::batch::glossy::GlossyBsdfBatch;
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::albedo_tables::albedo_tables;
use crate::lobes::shading_frame::sample_cosine_hemisphere;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goes<const N: usize> {
    pub goes: [bool; N],
    pub direction: Vec3xN<f32, N>,
    pub weight: Vec3xN<f32, N>,
    pub pdf: [f32; N],
    /// Where coats are mirrors.
    pub delta: [bool; N],
    pub start: Vec3xN<f32, N>,
}

impl<const N: usize> Default for Goes<N> {
    fn default() -> Self {
        Self {
            goes: [false; N],
            direction: [[0.0; N]; 3],
            weight: [[0.0; N]; 3],
            pdf: [0.0; N],
            delta: [false; N],
            start: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> GlossyBsdfBatch<N> {
    /// Where coats are asked where light goes on: there.
    #[inline(always)]
    fn sample_coat(
        &self,
        places: &SurfaceInteractions<N>,
        random: &[[f32; N]; 2],
        choice: &[f32; N],
        goes: &mut Goes<N>,
    ) {
        let found = self.coat.sample(places, random);
        for (lane, &choice) in choice.iter().enumerate() {
            let [specular, diffuse, coat] =
                [0, 1, 2].map(|lobe: usize| self.view_terms.lobe_probabilities[lobe][lane]);
            let left = choice - specular;
            if (left >= 0.0) & (left >= diffuse) & (coat > 0.0) {
                let direction = Vec3::from(get_lane(&found.direction, lane));
                let weight = found.weight[lane] * (self.coat.weight(lane) / coat);
                let start = places.offset_ray_origin(lane, direction).as_vec3();
                goes.goes[lane] = found.goes[lane];
                goes.delta[lane] = found.delta[lane];
                set_lane(&mut goes.direction, lane, direction.to_array());
                set_lane(&mut goes.weight, lane, [weight; 3]);
                set_lane(&mut goes.start, lane, start.to_array());
            }
        }
    }
}

/// Finds where light goes on, by two random numbers and one that chooses between the interface and the base.
pub(crate) struct SampleGlossy<'a, const N: usize> {
    pub places: &'a SurfaceInteractions<N>,
    pub random: &'a [[f32; N]; 2],
    pub choice: &'a [f32; N],
    pub batch: &'a mut GlossyBsdfBatch<N>,
}

impl<const N: usize> WithSimd for SampleGlossy<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            random,
            choice,
            batch: points,
        } = self;
        points.prepare_view(places, albedo_tables());
        let mut goes = Goes::default();
        for lane in 0..N {
            let v = Vec3::from(get_lane(&points.view_terms.wo, lane));
            let [specular, diffuse] =
                [0, 1].map(|lobe: usize| points.view_terms.lobe_probabilities[lobe][lane]);
            let random = [random[0][lane], random[1][lane]];
            // As `Layered` does: never a lobe without a share.
            let mirrored = (choice[lane] < specular) | (diffuse == 0.0);
            let h = points.params.ggx(lane).sample_wm(v, random);
            let reflected = 2.0 * v.dot(h) * h - v;
            let there = if mirrored {
                (reflected.z > 0.0) & (specular > 0.0)
            } else {
                true
            };
            let l = if mirrored {
                reflected
            } else {
                sample_cosine_hemisphere(random)
            };
            let direction = points.shading_frame(places, lane).to_world(l);
            let start = places.offset_ray_origin(lane, direction).as_vec3();
            goes.goes[lane] = there;
            set_lane(&mut goes.direction, lane, direction.to_array());
            set_lane(&mut goes.start, lane, start.to_array());
        }
        if points.coat.any_active {
            points.sample_coat(places, random, choice, &mut goes);
        }
        let values = points.eval(places, &goes.direction);
        for lane in 0..N {
            let pdf = values.pdf[lane];
            let weight = Vec3::from(get_lane(&values.value, lane)) / pdf;
            let delta = goes.delta[lane];
            let weight = if delta {
                Vec3::from(get_lane(&goes.weight, lane))
            } else {
                weight
            };
            goes.goes[lane] &= delta | (pdf > 0.0);
            goes.pdf[lane] = if delta { 0.0 } else { pdf };
            set_lane(&mut goes.weight, lane, weight.to_array());
        }
        points.samples = goes;
    }
}
