//! Where light goes on from glossy points.

use glam::Vec3;
use raycam_bvh::Loops;

use crate::bsdf::batch::glossy::GlossyPoints;
use crate::interaction::Places;
use crate::lobes::albedo_tables::tables;
use crate::lobes::shading_frame::cosine_direction;
use crate::soa::{Three, get, set};

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goes<const N: usize> {
    pub goes: [bool; N],
    pub direction: Three<f32, N>,
    pub weight: Three<f32, N>,
    pub pdf: [f32; N],
    /// Where coats are mirrors.
    pub delta: [bool; N],
    pub start: Three<f32, N>,
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

impl<const N: usize> GlossyPoints<N> {
    /// Where coats are asked where light goes on: there.
    #[inline(always)]
    fn coat(
        &self,
        places: &Places<N>,
        random: &[[f32; N]; 2],
        choice: &[f32; N],
        goes: &mut Goes<N>,
    ) {
        let found = self.coats.sample(places, random);
        for (lane, &choice) in choice.iter().enumerate() {
            let [specular, diffuse, coat] =
                [0, 1, 2].map(|lobe: usize| self.seen.shares[lobe][lane]);
            let left = choice - specular;
            if (left >= 0.0) & (left >= diffuse) & (coat > 0.0) {
                let direction = Vec3::from(get(&found.direction, lane));
                let weight = found.weight[lane] * (self.coats.weight(lane) / coat);
                let start = places.start(lane, direction).as_vec3();
                goes.goes[lane] = found.goes[lane];
                goes.delta[lane] = found.delta[lane];
                set(&mut goes.direction, lane, direction.to_array());
                set(&mut goes.weight, lane, [weight; 3]);
                set(&mut goes.start, lane, start.to_array());
            }
        }
    }
}

/// Finds where light goes on, by two random numbers and one that chooses between the interface and the base.
pub(crate) struct FindLobes<'a, const N: usize> {
    pub places: &'a Places<N>,
    pub random: &'a [[f32; N]; 2],
    pub choice: &'a [f32; N],
    pub points: &'a mut GlossyPoints<N>,
}

impl<const N: usize> Loops for FindLobes<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            random,
            choice,
            points,
        } = self;
        points.see(places, tables());
        let mut goes = Goes::default();
        for lane in 0..N {
            let v = Vec3::from(get(&points.seen.view, lane));
            let [specular, diffuse] = [0, 1].map(|lobe: usize| points.seen.shares[lobe][lane]);
            let random = [random[0][lane], random[1][lane]];
            // As `Layered` does: never a lobe without a share.
            let mirrored = (choice[lane] < specular) | (diffuse == 0.0);
            let h = points.made.ggx(lane).sample(v, random);
            let reflected = 2.0 * v.dot(h) * h - v;
            let there = if mirrored {
                (reflected.z > 0.0) & (specular > 0.0)
            } else {
                true
            };
            let l = if mirrored {
                reflected
            } else {
                cosine_direction(random)
            };
            let direction = points.frame(places, lane).world(l);
            let start = places.start(lane, direction).as_vec3();
            goes.goes[lane] = there;
            set(&mut goes.direction, lane, direction.to_array());
            set(&mut goes.start, lane, start.to_array());
        }
        if points.coats.any {
            points.coat(places, random, choice, &mut goes);
        }
        let values = points.evaluate(places, &goes.direction);
        for lane in 0..N {
            let pdf = values.pdf[lane];
            let weight = Vec3::from(get(&values.value, lane)) / pdf;
            let delta = goes.delta[lane];
            let weight = if delta {
                Vec3::from(get(&goes.weight, lane))
            } else {
                weight
            };
            goes.goes[lane] &= delta | (pdf > 0.0);
            goes.pdf[lane] = if delta { 0.0 } else { pdf };
            set(&mut goes.weight, lane, weight.to_array());
        }
        points.goes = goes;
    }
}
