//! Which cones rays of matte surfaces are aimed into, and where in them, many at a time.

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::guiding::caustic_casters::{CausticCaster, MAX_CASTERS};
use crate::guiding::caustic_map::CausticMap;
use crate::guiding::cones::GuidingCones;
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::shading_frame::{sincos_turns, to_world_around};
use crate::soa::{Vec3xN, get_lane, lane_dvec3, set_lane};

/// The largest share of a surface's rays that is aimed.
const MAX_GUIDED_WEIGHT: f32 = 0.2;
/// How many times as densely as others rays are aimed, at most.
const MAX_DENSITY_RATIO: f32 = 16.0;
/// The same of those that are aimed at where thrown light comes from, and what part of the others stays then.
const MAX_MAP_WEIGHT: f32 = 0.2;
const MAX_MAP_DENSITY_RATIO: f32 = 64.0;
const CASTER_FRACTION_BESIDE_MAP: f32 = 0.3;
/// Smaller cones are not worth it: 1 - cos of the angle.
const MIN_CONE: f32 = 1e-6;

/// The directions to a ball.
struct TargetCone {
    axis: Vec3,
    one_minus_cos: f32,
    /// What part of the half sphere above a matte surface it is, at most; 0 where it is nothing to aim at.
    max_fraction: f32,
}

impl TargetCone {
    #[inline(always)]
    fn new(way: Vec3, radius: f32, normal: Vec3) -> Self {
        let distance2 = way.length_squared();
        let sin2 = radius * radius / distance2;
        let height = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let axis = way / distance2.sqrt();
        let up = normal.dot(axis) + sin2.sqrt();
        let apt = (sin2 < 0.999) & (height > MIN_CONE) & (up > 0.0);
        let part = 2.0 * height * up.clamp(0.0, 1.0);
        Self {
            axis,
            one_minus_cos: if apt { height } else { 1.0 },
            max_fraction: if apt { part } else { 0.0 },
        }
    }
}

impl<const N: usize> GuidingCones<N> {
    /// Sets the cone of a lane, and the share that it would have alone.
    #[inline(always)]
    fn set_cone(&mut self, k: usize, lane: usize, cone: &TargetCone, denser: f32) {
        set_lane(&mut self.axis[k], lane, cone.axis.to_array());
        self.one_minus_cos[k][lane] = cone.one_minus_cos;
        self.weight[k][lane] = (denser * cone.max_fraction).min(1.0);
    }

    /// Lessens the shares of some cones where together they are more than this; what is left of the rest.
    #[inline(always)]
    fn limit_weights(&mut self, cones: std::ops::Range<usize>, most: &[f32; N]) {
        let mut all = [0.0; N];
        for shares in &self.weight[cones.clone()] {
            for (all, share) in all.iter_mut().zip(shares) {
                *all += share;
            }
        }
        let mut scale = [1.0; N];
        for lane in 0..N {
            let (all, most) = (all[lane], most[lane]);
            scale[lane] = if all > most { most / all } else { 1.0 };
            self.cosine_weight[lane] -= all * scale[lane];
        }
        for shares in &mut self.weight[cones] {
            for (share, scale) in shares.iter_mut().zip(&scale) {
                *share *= scale;
            }
        }
    }
}

/// Finds the cones, and draws a direction for every lane by two numbers.
pub(crate) struct SampleGuided<'a, const N: usize> {
    pub casters: &'a [CausticCaster],
    /// What each of them throws, where that is known.
    pub maps: &'a [CausticMap],
    pub places: &'a SurfaceInteractions<N>,
    /// Whose rays are aimed.
    pub active: &'a [bool; N],
    pub random: &'a [[f32; N]; 2],
    pub cones: &'a mut GuidingCones<N>,
    pub out: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleGuided<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            casters: mirrors,
            maps: thrown,
            places,
            active,
            random: [first, second],
            cones: aims,
            out,
        } = self;
        let mirrors = &mirrors[..mirrors.len().min(MAX_CASTERS)];
        let whole = mirrors.len();
        let mut most = active.map(|active| if active { MAX_GUIDED_WEIGHT } else { 0.0 });
        let most_thrown = active.map(|active| if active { MAX_MAP_WEIGHT } else { 0.0 });
        aims.count = whole;
        for (k, mirror) in mirrors.iter().enumerate() {
            for lane in 0..N {
                let way = (mirror.center - lane_dvec3(places.positions(), lane)).as_vec3();
                let cone = TargetCone::new(way, mirror.radius as f32, places.shading_normal(lane));
                aims.set_cone(k, lane, &cone, MAX_DENSITY_RATIO);
            }
        }
        for (mirror, thrown) in mirrors.iter().zip(thrown) {
            for (lane, most) in most.iter_mut().enumerate() {
                let from = (lane_dvec3(places.positions(), lane) - mirror.center) / mirror.radius;
                let from = from.as_vec3();
                let exit = thrown.lookup(from);
                let way = Vec3::from(exit.center) - from;
                let cone = TargetCone::new(way, exit.radius, places.shading_normal(lane));
                aims.set_cone(aims.count, lane, &cone, MAX_MAP_DENSITY_RATIO);
                let beside = most.min(MAX_GUIDED_WEIGHT * CASTER_FRACTION_BESIDE_MAP);
                *most = if cone.max_fraction > 0.0 {
                    beside
                } else {
                    *most
                };
            }
            aims.count += 1;
        }
        aims.cosine_weight = [1.0; N];
        aims.limit_weights(0..whole, &most);
        aims.limit_weights(whole..aims.count, &most_thrown);
        // Where the first number lies says which cone it is; what is left of it is as good as new.
        let mut from = [0.0; N];
        let mut height = [1.0; N];
        let mut number = [0.0; N];
        let mut aimed = [false; N];
        let mut axis = *places.shading_normals();
        for k in 0..aims.count {
            for lane in 0..N {
                let share = aims.weight[k][lane];
                let at = first[lane] - from[lane];
                let here = (at >= 0.0) & (at < share);
                for (axis, other) in axis.iter_mut().zip(&aims.axis[k]) {
                    axis[lane] = if here { other[lane] } else { axis[lane] };
                }
                height[lane] = if here {
                    aims.one_minus_cos[k][lane]
                } else {
                    height[lane]
                };
                number[lane] = if here { at / share } else { number[lane] };
                aimed[lane] |= here;
                from[lane] += share;
            }
        }
        for lane in 0..N {
            let rest = (first[lane] - from[lane]) / aims.cosine_weight[lane];
            let x = if aimed[lane] { number[lane] } else { rest };
            let x = x.clamp(0.0, 1.0);
            let cap = x * height[lane];
            let sin2 = if aimed[lane] { cap * (2.0 - cap) } else { x };
            let cos = if aimed[lane] {
                1.0 - cap
            } else {
                (1.0 - x).sqrt()
            };
            let (turn_sin, turn_cos) = sincos_turns(second[lane]);
            let radius = sin2.sqrt();
            let local = Vec3::new(radius * turn_cos, radius * turn_sin, cos);
            let direction = to_world_around(get_lane(&axis, lane).into(), local);
            set_lane(out, lane, direction.to_array());
        }
    }
}
