//! Guided sampling of diffuse surfaces, many at a time.

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::guiding::Caustics;
use crate::guiding::caustic_casters::{CausticCaster, MAX_CASTERS};
use crate::guiding::caustic_map::GuideTargets;
use crate::guiding::cones::GuidingCones;
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::shading_frame::{sincos_turns, to_world_around};
use crate::soa::{Vec3xN, get_lane, lane_dvec3, lane_vec3, set_lane};

/// Fraction of a surface's samples that casters may have, at most.
pub(crate) const MAX_GUIDED_WEIGHT: f32 = 0.2;
/// Density of samples to a caster relative to uniform samples of the hemisphere, at most.
pub(crate) const MAX_DENSITY_RATIO: f32 = 16.0;
/// Weight and density of the regions of caustic maps, and the fraction of the casters' weight that remains beside a map.
const MAX_MAP_WEIGHT: f32 = 0.2;
const MAX_MAP_DENSITY_RATIO: f32 = 64.0;
const CASTER_FRACTION_BESIDE_MAP: f32 = 0.3;
/// Smallest cone that is sampled: 1 - cosine of the half angle.
const MIN_CONE: f32 = 1e-6;

/// The directions to a sphere.
pub(crate) struct TargetCone {
    pub axis: Vec3,
    pub one_minus_cos: f32,
    /// Upper bound of its fraction of the hemisphere above a surface; 0 for a cone that is not sampled.
    pub max_fraction: f32,
}

impl TargetCone {
    #[inline(always)]
    pub fn new(direction: Vec3, radius: f32, normal: Vec3) -> Self {
        let distance2 = direction.length_squared();
        let sin2 = radius * radius / distance2;
        let one_minus_cos = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let axis = direction / distance2.sqrt();
        let up = normal.dot(axis) + sin2.sqrt();
        let is_sampled = (sin2 < 0.999) & (one_minus_cos > MIN_CONE) & (up > 0.0);
        let fraction = 2.0 * one_minus_cos * up.clamp(0.0, 1.0);
        Self {
            axis,
            one_minus_cos: if is_sampled { one_minus_cos } else { 1.0 },
            max_fraction: if is_sampled { fraction } else { 0.0 },
        }
    }
}

impl<const N: usize> GuidingCones<N> {
    /// Sets the cones of all lanes, and the weights that they would have alone, times `weight`; returns each
    /// [`TargetCone::max_fraction`]. The arrays are local until they are full: loops that write into `self` while they read
    /// the interactions are not vectorised.
    #[inline(always)]
    fn set_cones(
        &mut self,
        k: usize,
        (directions, radii): (&Vec3xN<f32, N>, &[f32; N]),
        normals: &Vec3xN<f32, N>,
        density_ratio: f32,
        weight: f32,
    ) -> [f32; N] {
        let mut axis = [[0.0; N]; 3];
        let [mut one_minus_cos, mut weights, mut max_fractions] = [[0.0; N]; 3];
        for lane in 0..N {
            let cone = TargetCone::new(lane_vec3(directions, lane), radii[lane], lane_vec3(normals, lane));
            set_lane(&mut axis, lane, cone.axis.to_array());
            one_minus_cos[lane] = cone.one_minus_cos;
            weights[lane] = weight * (density_ratio * cone.max_fraction).min(1.0);
            max_fractions[lane] = cone.max_fraction;
        }
        self.axis[k] = axis;
        self.one_minus_cos[k] = one_minus_cos;
        self.weight[k] = weights;
        max_fractions
    }

    /// Adds the cones from points to the targets of a caustic map, all in units of the caster; returns what
    /// [`GuidingCones::set_cones`] returns.
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

    /// Scales the weights of some cones down to this sum, and reduces the cosine's weight by the result.
    #[inline(always)]
    fn limit_weights(&mut self, cones: std::ops::Range<usize>, max: &[f32; N]) {
        let mut all = [0.0; N];
        for weights in &self.weight[cones.clone()] {
            for (all, weight) in all.iter_mut().zip(weights) {
                *all += weight;
            }
        }
        let mut scale = [1.0; N];
        for lane in 0..N {
            let (all, max) = (all[lane], max[lane]);
            scale[lane] = if all > max { max / all } else { 1.0 };
            self.cosine_weight[lane] -= all * scale[lane];
        }
        for weights in &mut self.weight[cones] {
            for (weight, scale) in weights.iter_mut().zip(&scale) {
                *weight *= scale;
            }
        }
    }
}

/// Computes the cones, and samples a direction for every lane.
pub(crate) struct SampleGuided<'a, const N: usize> {
    pub caustics: &'a Caustics,
    /// Gaps that light passes, which samples are guided to as to casters.
    pub gaps: &'a [CausticCaster],
    pub interactions: &'a SurfaceInteractions<N>,
    /// Lanes whose samples are guided.
    pub active: &'a [bool; N],
    pub random: &'a [[f32; N]; 2],
    pub cones: &'a mut GuidingCones<N>,
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

impl<const N: usize> GuidingCones<N> {
    /// Sets the cones to the casters, the gaps, the spots and the regions of the casters' maps, and the weights of all.
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

    /// Samples a direction for every lane. The first random number chooses the cone; its remainder is again uniform.
    #[inline(always)]
    fn sample(&self, normals: &Vec3xN<f32, N>, [first, second]: &[[f32; N]; 2], out: &mut Vec3xN<f32, N>) {
        let mut begin = [0.0; N];
        let mut one_minus_cos = [1.0; N];
        let mut remainder = [0.0; N];
        let mut is_guided = [false; N];
        let mut axis = *normals;
        for k in 0..self.count {
            for lane in 0..N {
                let weight = self.weight[k][lane];
                let offset = first[lane] - begin[lane];
                let is_chosen = (offset >= 0.0) & (offset < weight);
                for (axis, cone) in axis.iter_mut().zip(&self.axis[k]) {
                    axis[lane] = if is_chosen { cone[lane] } else { axis[lane] };
                }
                one_minus_cos[lane] = if is_chosen { self.one_minus_cos[k][lane] } else { one_minus_cos[lane] };
                remainder[lane] = if is_chosen { offset / weight } else { remainder[lane] };
                is_guided[lane] |= is_chosen;
                begin[lane] += weight;
            }
        }
        for lane in 0..N {
            let is_guided = is_guided[lane];
            let rest = (first[lane] - begin[lane]) / self.cosine_weight[lane];
            let x = if is_guided { remainder[lane] } else { rest };
            let x = x.clamp(0.0, 1.0);
            let cap = x * one_minus_cos[lane];
            let sin2 = if is_guided { cap * (2.0 - cap) } else { x };
            let cosine = if is_guided { 1.0 - cap } else { (1.0 - x).sqrt() };
            let (sin, cos) = sincos_turns(second[lane]);
            let radius = sin2.sqrt();
            let local = Vec3::new(radius * cos, radius * sin, cosine);
            let direction = to_world_around(get_lane(&axis, lane).into(), local);
            set_lane(out, lane, direction.to_array());
        }
    }
}
