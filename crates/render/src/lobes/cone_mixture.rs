//! Guiding cones: a mixture of cosine-weighted and cone sampling for diffuse surfaces.
//!
//! Light that a mirror or a lens casts on a diffuse surface is found by BSDF samples that happen to hit the caster. A
//! fraction of the samples therefore goes uniformly into the cones of the casters' bounding spheres, and a larger one, where
//! caustic maps have them, into the cones of the regions that photons came from. Every direction has the density of the
//! whole mixture (one-sample multiple importance sampling: E. Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation", 1997, section 9.2.4).

use std::f32::consts::TAU;

use glam::Vec3;

use crate::guiding::caustic_casters::MAX_CASTERS;
use crate::guiding::caustic_spots::MAX_SPOTS;
use crate::lobes::shading_frame::cosine_hemisphere_pdf;
use crate::soa::{Vec3xN, get_lane};

/// Gaps, at most.
pub(crate) const MAX_GAPS: usize = 8;
/// Cones of a lane, at most: one for each caster, each gap and each spot, and two for each map.
const MAX_CONES: usize = 3 * MAX_CASTERS + MAX_GAPS + MAX_SPOTS;

/// The cones of every lane.
#[derive(Clone, Debug)]
pub(crate) struct GuidingCones<const N: usize> {
    pub(crate) count: usize,
    pub(crate) axis: [Vec3xN<f32, N>; MAX_CONES],
    /// 1 - cosine of the half angle.
    pub(crate) one_minus_cos: [[f32; N]; MAX_CONES],
    /// Fraction of the samples.
    pub(crate) weight: [[f32; N]; MAX_CONES],
    /// Fraction of the samples that follow the cosine.
    pub(crate) cosine_weight: [f32; N],
}

impl<const N: usize> Default for GuidingCones<N> {
    fn default() -> Self {
        Self {
            count: 0,
            axis: [[[0.0; N]; 3]; MAX_CONES],
            one_minus_cos: [[1.0; N]; MAX_CONES],
            weight: [[0.0; N]; MAX_CONES],
            cosine_weight: [1.0; N],
        }
    }
}

impl<const N: usize> GuidingCones<N> {
    /// Removes all cones.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// True if samples may be guided.
    pub fn has_cones(&self) -> bool {
        self.count > 0
    }

    /// The density of a direction in a lane, by its cosine to the normal.
    #[inline(always)]
    pub fn pdf(&self, lane: usize, direction: Vec3, cosine: f32) -> f32 {
        let mut density = cosine_hemisphere_pdf(cosine);
        if self.has_cones() {
            density *= self.cosine_weight[lane];
            for k in 0..self.count {
                density += self.cone_pdf(k, lane, direction);
            }
        }
        density
    }

    /// [`GuidingCones::pdf`] of every lane.
    #[inline(always)]
    pub fn pdfs(&self, directions: &Vec3xN<f32, N>, cosines: &[f32; N]) -> [f32; N] {
        let mut densities = cosines.map(cosine_hemisphere_pdf);
        if self.has_cones() {
            for (density, rest) in densities.iter_mut().zip(&self.cosine_weight) {
                *density *= rest;
            }
            for k in 0..self.count {
                for (lane, density) in densities.iter_mut().enumerate() {
                    *density += self.cone_pdf(k, lane, get_lane(directions, lane).into());
                }
            }
        }
        densities
    }

    #[inline(always)]
    fn cone_pdf(&self, k: usize, lane: usize, direction: Vec3) -> f32 {
        // 1 - cosine = |a - b|^2 / 2, without cancellation.
        let off = direction - Vec3::from(get_lane(&self.axis[k], lane));
        let height = self.one_minus_cos[k][lane];
        let density = self.weight[k][lane] / (TAU * height);
        if off.length_squared() <= 2.0 * height { density } else { 0.0 }
    }
}

/// The ratio of the cosine-weighted density to the density of the mixture; 0 where the mixture has none.
#[inline(always)]
pub(crate) fn mixture_weight(cosine: f32, density: f32) -> f32 {
    let share = cosine_hemisphere_pdf(cosine) / density;
    if density > 0.0 { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DAffine3, DVec3};
    use raycam_bvh::{Hit, WithSimd, dispatch_simd};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::guiding::Caustics;
    use crate::guiding::caustic_casters::CausticCaster;
    use crate::guiding::caustic_map::CausticMap;
    use crate::guiding::caustic_map::tests::from_balls;
    use crate::guiding::sample_cones::SampleGuided;
    use crate::interaction::batch::SurfaceInteractions;
    use crate::prepare::world::PreparedWorld;
    use crate::sampling::chi_squared::{limit, statistic};
    use crate::soa::{LANES, set_triangle};

    fn floor() -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([2.0, 2.0]).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let object = Object::new("", floor, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    /// Rays that come down on places of the floor, the first of which is `first`.
    fn places<const N: usize>(world: &PreparedWorld, first: usize) -> SurfaceInteractions<N> {
        let mut places = SurfaceInteractions::<N>::default();
        let corners = places.clear();
        for lane in 0..N {
            set_triangle(corners, lane, world.geometry.corners(0, 0));
        }
        for lane in 0..N {
            let hit = Hit { t: 1.0, u: 0.05 * (first + lane) as f32, v: 0.1, instance: 0, triangle: 0 };
            places.set_lane(lane, &world.geometry, -Vec3::Z, &hit, 0.0);
        }
        places.run();
        places
    }

    /// A caster above the floor, one that the floor cuts, one around all points, one too far away, a gap, and a spot.
    fn some() -> Vec<CausticCaster> {
        [
            (DVec3::new(1.5, 0.0, 1.0), 0.4),
            (DVec3::new(-1.0, 2.0, 0.1), 0.6),
            (DVec3::new(0.0, 0.0, 2.0), 5.0),
            (DVec3::new(0.0, 0.0, 9e3), 1.0),
            (DVec3::new(-0.9, -1.2, 1.2), 0.5),
            (DVec3::new(0.8, 1.1, 0.4), 0.05),
        ]
        .map(|(center, radius)| CausticCaster { instance: 0, center, radius, is_rough: false, weight: 1.0 })
        .into()
    }

    /// The maps of two of them, the second with two targets.
    fn thrown() -> Vec<CausticMap> {
        let beside = 0.7 * DVec3::X;
        let balls: [Vec<(DVec3, f64)>; 2] =
            [vec![(DVec3::new(0.3, 0.2, -0.5), 0.2)], vec![(beside, 0.1), (-beside, 0.1)]];
        let throws = |(i, mirror): (usize, &CausticCaster)| match balls.get(i) {
            Some(balls) => from_balls(mirror, balls),
            None => CausticMap::new(mirror, [].into_iter()),
        };
        some().iter().enumerate().map(throws).collect()
    }

    fn aimed<const N: usize>(
        places: &SurfaceInteractions<N>,
        thrown: &[CausticMap],
        active: [bool; N],
        random: [[f32; N]; 2],
    ) -> (GuidingCones<N>, Vec3xN<f32, N>) {
        let (mut aims, mut out) = (GuidingCones::default(), [[0.0; N]; 3]);
        dispatch_simd(SampleGuided {
            caustics: &Caustics { casters: some()[..4].to_vec(), maps: thrown.to_vec(), spots: some()[5..].to_vec() },
            gaps: &some()[4..5],
            interactions: places,
            active: &active,
            random: &random,
            cones: &mut aims,
            out: &mut out,
        });
        (aims, out)
    }

    fn random(at: usize) -> f32 {
        let mut x = at as u32;
        for factor in [0x7feb_352d, 0x846c_a68b] {
            x = (x ^ (x >> 16)).wrapping_mul(factor);
        }
        (x >> 8) as f32 / (1 << 24) as f32
    }

    #[test]
    fn directions_are_as_dense_as_they_say() {
        const HIGH: usize = 40;
        const AROUND: usize = 40;
        const FINE: usize = 32;
        const SAMPLES: usize = 1 << 16;
        let world = floor();
        let mut places = SurfaceInteractions::<LANES>::default();
        let corners = places.clear();
        (0..LANES).for_each(|lane| set_triangle(corners, lane, world.geometry.corners(0, 0)));
        let hit = Hit { t: 1.0, u: 0.2, v: 0.1, instance: 0, triangle: 0 };
        (0..LANES).for_each(|lane| places.set_lane(lane, &world.geometry, -Vec3::Z, &hit, 0.0));
        places.run();
        let cell = |d: DVec3| {
            let turn = (d.y.atan2(d.x) / TAU).rem_euclid(1.0);
            let row = ((d.z + 1.0) / 2.0 * HIGH as f64) as usize;
            row.min(HIGH - 1) * AROUND + ((turn * AROUND as f64) as usize).min(AROUND - 1)
        };
        for thrown in [vec![], thrown()] {
            let mut seen = vec![0.0f64; HIGH * AROUND];
            for at in 0..SAMPLES {
                let number = |which| std::array::from_fn(|lane| random(2 * (at * LANES + lane) + which));
                let (_, out) = aimed(&places, &thrown, [true; LANES], [number(0), number(1)]);
                for lane in 0..LANES {
                    let direction = Vec3::from(get_lane(&out, lane));
                    assert!((direction.length() - 1.0).abs() < 1e-5);
                    seen[cell(direction.as_dvec3())] += 1.0;
                }
            }
            let (aims, _) = aimed(&places, &thrown, [true; LANES], [[0.5; LANES]; 2]);
            let mut expected = vec![0.0f64; HIGH * AROUND];
            for row in 0..HIGH * FINE {
                for column in 0..AROUND * FINE {
                    let z = (row as f64 + 0.5) / (HIGH * FINE) as f64 * 2.0 - 1.0;
                    let (sin, cos) = ((column as f64 + 0.5) / (AROUND * FINE) as f64 * TAU).sin_cos();
                    let radius = (1.0 - z * z).sqrt();
                    let direction = DVec3::new(radius * cos, radius * sin, z);
                    let density = aims.pdf(5, direction.as_vec3(), z as f32);
                    let solid = 2.0 * TAU / (HIGH * AROUND * FINE * FINE) as f64;
                    expected[row / FINE * AROUND + column / FINE] += f64::from(density) * solid;
                }
            }
            let all: f64 = expected.iter().sum();
            assert!((all - 1.0).abs() < 1e-3, "{all}");
            let count = (SAMPLES * LANES) as f64;
            let (chi2, freedom) = statistic(seen.into_iter().zip(expected.iter().map(|e| e * count)));
            assert!(freedom > 500.0 && chi2 < limit(freedom, 1), "{chi2} of {freedom}");
            // A fifth is aimed, and none at what holds all places; three tenths of that beside what is thrown.
            let shares: Vec<_> = aims.weight[..aims.count].iter().map(|s| s[5]).collect();
            let (whole, balls) = shares.split_at(5);
            let (&[spot], balls) = balls.split_first_chunk().unwrap();
            assert!(spot > 0.0 && spot < 0.2, "{spot}");
            let most = if thrown.is_empty() { 0.2 } else { 0.3 * 0.2 };
            assert!((whole.iter().sum::<f32>() - most).abs() < 1e-6, "{whole:?}");
            assert_eq!(whole[2..4], [0.0, 0.0]);
            assert!(whole[4] > 0.0);
            let thrown_at = balls.iter().sum::<f32>();
            assert_eq!(thrown_at > 0.0, !thrown.is_empty(), "{balls:?}");
            assert!(thrown_at <= 0.2 + 1e-6, "{balls:?}");
            assert!((aims.cosine_weight[5] - (1.0 - most - spot - thrown_at)).abs() < 1e-6);
        }
    }

    #[test]
    fn batch_equals_scalar() {
        let world = floor();
        let whole = places::<LANES>(&world, 0);
        let thrown = thrown();
        let active = std::array::from_fn(|lane| lane % 5 != 4);
        let number = |which| std::array::from_fn(|lane| random(2 * lane + which));
        let numbers: [[f32; LANES]; 2] = [number(0), number(1)];
        let (aims, out) = aimed(&whole, &thrown, active, numbers);
        let cosines = std::array::from_fn(|lane| out[2][lane]);
        let densities = aims.pdfs(&out, &cosines);
        for lane in 0..LANES {
            let own = numbers.map(|numbers| [numbers[lane]]);
            let (alone, direction) = aimed(&places::<1>(&world, lane), &thrown, [active[lane]], own);
            assert_eq!(get_lane(&direction, 0), get_lane(&out, lane));
            let density = alone.pdf(0, get_lane(&direction, 0).into(), cosines[lane]);
            assert_eq!(density, densities[lane]);
            assert_eq!(alone.cosine_weight[0] < 1.0, active[lane]);
        }
    }
}
