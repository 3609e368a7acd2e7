//! Guided sampling of diffuse surfaces, for many points at a time.

use raycam_bvh::WithSimd;

use crate::guiding::caustic_casters::{CausticCaster, MAX_CASTERS};
use crate::guiding::caustic_map::GuideTargets;
use crate::guiding::caustics::Caustics;
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::cone_mixture::ConeMixture;
use crate::soa::{Vec3xN, lane_dvec3, lane_vec3, set_lane};

/// Maximum fraction of a surface's samples that are guided to casters and gaps. Lab note: "Up to a fifth of the rays",
/// 11-22; 0.3 to 0.5 were rejected.
pub(crate) const MAX_GUIDED_WEIGHT: f32 = 0.2;
/// Maximum density of samples towards a caster, relative to uniform samples of the hemisphere. Lab note: "at most 16
/// times the density", 11-22.
pub(crate) const MAX_DENSITY_RATIO: f32 = 16.0;
/// Maximum fraction of a surface's samples that are guided by caustic maps. Lab note: "the constants of caustic maps",
/// 11-23.
const MAX_MAP_WEIGHT: f32 = 0.2;
/// Maximum density of samples guided by caustic maps. Lab note: "up to 64 times the density", 11-23.
const MAX_MAP_DENSITY_RATIO: f32 = 64.0;
/// Fraction of [`MAX_GUIDED_WEIGHT`] that remains for the casters if a caustic map guides samples. Not tuned.
const CASTER_FRACTION_BESIDE_MAP: f32 = 0.3;

/// Computes the cones and samples a direction for every lane.
pub(crate) struct SampleGuided<'a, const N: usize> {
    pub caustics: &'a Caustics,
    /// Gaps through which light passes. Samples are guided to gaps in the same way as to casters.
    pub gaps: &'a [CausticCaster],
    pub interactions: &'a SurfaceInteractions<N>,
    /// Lanes whose samples are guided.
    pub active: &'a [bool; N],
    pub random: &'a [[f32; N]; 2],
    pub cones: &'a mut ConeMixture<N>,
    pub out: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleGuided<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self { caustics, gaps, interactions, active, random, cones, out } = self;
        cones.set_targets(caustics, gaps, interactions, active);
        cones.sample(interactions.shading_normals(), random, out);
    }
}

impl<const N: usize> ConeMixture<N> {
    /// Adds one cone per lane, from a point to a target of a caustic map. Coordinates are relative to the caster, which
    /// has the centre 0 and the radius 1. Returns the result of [`ConeMixture::set_cones`].
    #[inline(always)]
    fn add_map_cones(
        &mut self,
        points: &Vec3xN<f32, N>,
        targets: &GuideTargets<N>,
        normals: &Vec3xN<f32, N>,
        weight: f32,
    ) -> [f32; N] {
        let mut directions = [[0.0; N]; 3];
        for lane in 0..N {
            let direction = lane_vec3(&targets.center, lane) - lane_vec3(points, lane);
            set_lane(&mut directions, lane, direction.to_array());
        }
        self.count += 1;
        self.set_cones(self.count - 1, (&directions, &targets.radius), normals, MAX_MAP_DENSITY_RATIO, weight)
    }

    /// Sets the cones to the casters, gaps, spots and map regions, and sets all their weights.
    #[inline(always)]
    fn set_targets(
        &mut self,
        Caustics { casters, maps, spots }: &Caustics,
        gaps: &[CausticCaster],
        interactions: &SurfaceInteractions<N>,
        active: &[bool; N],
    ) {
        let casters = &casters[..casters.len().min(MAX_CASTERS)];
        let mut max_casters = active.map(|active| if active { MAX_GUIDED_WEIGHT } else { 0.0 });
        let max_maps = active.map(|active| if active { MAX_MAP_WEIGHT } else { 0.0 });
        let max_spots = max_casters;
        let (positions, normals) = (interactions.positions(), interactions.shading_normals());
        let (passages, balls) = (casters.len() + gaps.len(), casters.len() + gaps.len() + spots.len());
        self.count = balls;
        for (k, caster) in casters.iter().chain(gaps).chain(spots).enumerate() {
            let mut directions = [[0.0; N]; 3];
            for lane in 0..N {
                let direction = (caster.center - lane_dvec3(positions, lane)).as_vec3();
                set_lane(&mut directions, lane, direction.to_array());
            }
            let radii = [caster.radius as f32; N];
            self.set_cones(k, (&directions, &radii), normals, MAX_DENSITY_RATIO, caster.weight);
        }
        for (caster, map) in casters.iter().zip(maps) {
            let mut points = [[0.0; N]; 3];
            for lane in 0..N {
                let point = ((lane_dvec3(positions, lane) - caster.center) / caster.radius).as_vec3();
                set_lane(&mut points, lane, point.to_array());
            }
            let (first, second) = map.lookup_lanes(&points);
            let fractions = self.add_map_cones(&points, &first, normals, caster.weight);
            if let Some(second) = second {
                self.add_map_cones(&points, &second, normals, caster.weight);
            }
            for (max_casters, fraction) in max_casters.iter_mut().zip(fractions) {
                let beside = max_casters.min(MAX_GUIDED_WEIGHT * CASTER_FRACTION_BESIDE_MAP);
                *max_casters = if fraction > 0.0 { beside } else { *max_casters };
            }
        }
        self.cosine_weight = [1.0; N];
        self.limit_weights(0..passages, &max_casters);
        self.limit_weights(passages..balls, &max_spots);
        self.limit_weights(balls..self.count, &max_maps);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DAffine3, DVec3, Vec3};
    use raycam_bvh::{Hit, dispatch_simd};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::guiding::caustic_map::CausticMap;
    use crate::guiding::caustic_map::tests::from_balls;
    use crate::interaction::batch::SurfaceInteractions;
    use crate::interaction::ray_cone::RayCone;
    use crate::prepare::world::PreparedWorld;
    use crate::sampling::chi_squared::{limit, statistic};
    use crate::soa::{LANES, get_lane, set_triangle};

    fn floor() -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([2.0, 2.0]).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let object = Object::new("", floor, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    /// Surface interactions of rays that hit the floor from above; lane i hits the floor's point with the number `first
    /// + i`.
    fn places<const N: usize>(world: &PreparedWorld, first: usize) -> SurfaceInteractions<N> {
        let mut places = SurfaceInteractions::<N>::default();
        let corners = places.clear();
        for lane in 0..N {
            set_triangle(corners, lane, world.geometry.corners(0, 0));
        }
        for lane in 0..N {
            let hit = Hit { t: 1.0, u: 0.05 * (first + lane) as f32, v: 0.1, instance: 0, triangle: 0 };
            places.set_lane(lane, &world.geometry, -Vec3::Z, &hit, &RayCone::default());
        }
        places.run();
        places
    }

    /// A caster above the floor, a second caster that intersects the floor, a third around all points, and a fourth
    /// that is too far away; a gap; and a spot.
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

    /// Caustic maps of two casters; the second map has two targets.
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
    ) -> (ConeMixture<N>, Vec3xN<f32, N>) {
        let (mut aims, mut out) = (ConeMixture::default(), [[0.0; N]; 3]);
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
    fn sampled_directions_follow_their_density() {
        const HIGH: usize = 40;
        const AROUND: usize = 40;
        const FINE: usize = 32;
        const SAMPLES: usize = 1 << 16;
        let world = floor();
        let mut places = SurfaceInteractions::<LANES>::default();
        let corners = places.clear();
        (0..LANES).for_each(|lane| set_triangle(corners, lane, world.geometry.corners(0, 0)));
        let hit = Hit { t: 1.0, u: 0.2, v: 0.1, instance: 0, triangle: 0 };
        (0..LANES).for_each(|lane| places.set_lane(lane, &world.geometry, -Vec3::Z, &hit, &RayCone::default()));
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
            // A fifth of the samples is guided, except towards the caster that contains all points. With caustic maps,
            // the casters keep three tenths of this fifth.
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
    fn guided_lanes_equal_scalar_evaluation() {
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
