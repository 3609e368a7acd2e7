//! Where light goes on at frosted points.

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::bsdf::batch::rough_dielectric::{RoughDielectricBsdfBatch, reflect_probability};
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::albedo_tables::albedo_tables;
use crate::lobes::shading_frame::sample_cosine_hemisphere;
use crate::prepare::geometry::Geometry;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goes<const N: usize> {
    pub goes: [bool; N],
    pub direction: Vec3xN<f32, N>,
    pub weight: Vec3xN<f32, N>,
    pub pdf: [f32; N],
    pub squeeze: [f32; N],
    pub start: Vec3xN<f32, N>,
}

impl<const N: usize> Default for Goes<N> {
    fn default() -> Self {
        Self {
            goes: [false; N],
            direction: [[0.0; N]; 3],
            weight: [[0.0; N]; 3],
            pdf: [0.0; N],
            squeeze: [1.0; N],
            start: [[0.0; N]; 3],
        }
    }
}

/// Finds where light goes on, by two random numbers and one that chooses between lobes.
pub(crate) struct SampleRoughDielectric<'a, const N: usize> {
    pub world: &'a Geometry,
    pub places: &'a SurfaceInteractions<N>,
    pub random: &'a [[f32; N]; 2],
    pub choice: &'a [f32; N],
    pub batch: &'a mut RoughDielectricBsdfBatch<N>,
}

impl<const N: usize> WithSimd for SampleRoughDielectric<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            world,
            places,
            random,
            choice,
            batch: points,
        } = self;
        points.prepare_view(world, places, albedo_tables());
        let made = &points.params;
        let (mut facets, mut cosines) = ([[0.0; N]; 3], [0.0; N]);
        for lane in 0..N {
            let v = Vec3::from(get_lane(&points.view_terms.wo, lane));
            let h = made
                .ggx(lane)
                .sample_wm(v, [random[0][lane], random[1][lane]]);
            cosines[lane] = v.dot(h);
            set_lane(&mut facets, lane, h.to_array());
        }
        let (reflected, over) = made.reflectance(&cosines);
        let mut goes = Goes::default();
        for lane in 0..N {
            let (v, h) = (
                get_lane(&points.view_terms.wo, lane),
                get_lane(&facets, lane),
            );
            let (v, h, eta) = (Vec3::from(v), Vec3::from(h), made.eta[lane]);
            let [specular, above, below] =
                [0, 1, 2].map(|lobe: usize| points.view_terms.lobe_probabilities[lobe][lane]);
            // As `Layered` does: never a lobe without a share.
            let first = choice[lane];
            let (second, third) = (first - specular, first - specular - above);
            let is_third = (first >= specular) & (second >= above) & (below > 0.0);
            let is_second = (first >= specular) & !is_third & (above > 0.0);
            let is_first = !is_second & !is_third;
            let left = if first < specular {
                first
            } else {
                // Rounding has gone beyond the last.
                third - below
            };
            let rest = Vec3::ONE - Vec3::from(get_lane(&over, lane));
            let rest = rest * made.transmission(lane);
            let mirrored =
                left < reflect_probability(get_lane(&reflected, lane).into(), rest) * specular;
            let cosine = cosines[lane];
            let mirror = 2.0 * cosine * h - v;
            let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
            let refraction = h * (cosine / eta - (1.0 - sin2).sqrt()) - v / eta;
            let diffuse = sample_cosine_hemisphere([random[0][lane], random[1][lane]]);
            let (facet, goes_on) = if mirrored {
                (mirror, mirror.z > 0.0)
            } else {
                (refraction, (sin2 < 1.0) & (refraction.z < 0.0))
            };
            let l = if is_first {
                facet
            } else if is_second {
                diffuse
            } else {
                -diffuse
            };
            let direction = points.shading_frame(places, lane).to_world(l);
            let start = places.offset_ray_origin(lane, direction).as_vec3();
            let through = places.geometric_normal(lane).dot(direction) < 0.0;
            goes.goes[lane] = !is_first | (goes_on & (specular > 0.0));
            goes.squeeze[lane] = if through { eta * eta } else { 1.0 };
            set_lane(&mut goes.direction, lane, direction.to_array());
            set_lane(&mut goes.start, lane, start.to_array());
        }
        let values = points.eval(world, places, &goes.direction);
        for lane in 0..N {
            let pdf = values.pdf[lane];
            let weight = Vec3::from(get_lane(&values.value, lane)) / pdf;
            goes.goes[lane] &= pdf > 0.0;
            goes.pdf[lane] = pdf;
            set_lane(&mut goes.weight, lane, weight.to_array());
        }
        points.samples = goes;
    }
}
