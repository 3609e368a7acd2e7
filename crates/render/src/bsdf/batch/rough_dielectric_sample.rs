//! Where light goes on at frosted points.

use glam::Vec3;
use raycam_bvh::Loops;

use crate::bsdf::batch::rough_dielectric::{FrostedPoints, mirrors};
use crate::interaction::Places;
use crate::lobes::albedo_tables::tables;
use crate::lobes::shading_frame::cosine_direction;
use crate::prepare::PreparedWorld;
use crate::soa::{Three, get, set};

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goes<const N: usize> {
    pub goes: [bool; N],
    pub direction: Three<f32, N>,
    pub weight: Three<f32, N>,
    pub pdf: [f32; N],
    pub squeeze: [f32; N],
    pub start: Three<f32, N>,
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
pub(crate) struct FindFrosted<'a, const N: usize> {
    pub world: &'a PreparedWorld,
    pub places: &'a Places<N>,
    pub random: &'a [[f32; N]; 2],
    pub choice: &'a [f32; N],
    pub points: &'a mut FrostedPoints<N>,
}

impl<const N: usize> Loops for FindFrosted<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            world,
            places,
            random,
            choice,
            points,
        } = self;
        points.see(world, places, tables());
        let made = &points.made;
        let (mut facets, mut cosines) = ([[0.0; N]; 3], [0.0; N]);
        for lane in 0..N {
            let v = Vec3::from(get(&points.seen.view, lane));
            let h = made.ggx(lane).sample(v, [random[0][lane], random[1][lane]]);
            cosines[lane] = v.dot(h);
            set(&mut facets, lane, h.to_array());
        }
        let (reflected, over) = made.reflected(&cosines);
        let mut goes = Goes::default();
        for lane in 0..N {
            let (v, h) = (get(&points.seen.view, lane), get(&facets, lane));
            let (v, h, eta) = (Vec3::from(v), Vec3::from(h), made.eta[lane]);
            let [specular, above, below] =
                [0, 1, 2].map(|lobe: usize| points.seen.shares[lobe][lane]);
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
            let rest = Vec3::ONE - Vec3::from(get(&over, lane));
            let rest = rest * made.transmission(lane);
            let mirrored = left < mirrors(get(&reflected, lane).into(), rest) * specular;
            let cosine = cosines[lane];
            let mirror = 2.0 * cosine * h - v;
            let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
            let refraction = h * (cosine / eta - (1.0 - sin2).sqrt()) - v / eta;
            let diffuse = cosine_direction([random[0][lane], random[1][lane]]);
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
            let direction = points.frame(places, lane).world(l);
            let start = places.start(lane, direction).as_vec3();
            let through = places.geometric(lane).dot(direction) < 0.0;
            goes.goes[lane] = !is_first | (goes_on & (specular > 0.0));
            goes.squeeze[lane] = if through { eta * eta } else { 1.0 };
            set(&mut goes.direction, lane, direction.to_array());
            set(&mut goes.start, lane, start.to_array());
        }
        let values = points.evaluate(world, places, &goes.direction);
        for lane in 0..N {
            let pdf = values.pdf[lane];
            let weight = Vec3::from(get(&values.value, lane)) / pdf;
            goes.goes[lane] &= pdf > 0.0;
            goes.pdf[lane] = pdf;
            set(&mut goes.weight, lane, weight.to_array());
        }
        points.goes = goes;
    }
}
