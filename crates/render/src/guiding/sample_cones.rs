//! Which cones rays of matte surfaces are aimed into, and where in them, many at a time.

use glam::Vec3;
use raycam_bvh::Loops;

use crate::guiding::caustic_casters::{MIRRORS, Mirror};
use crate::guiding::caustic_map::Thrown;
use crate::guiding::cones::Aims;
use crate::interaction::Places;
use crate::lobes::shading_frame::{above, turn};
use crate::soa::{Three, get, set, vector};

/// The largest share of a surface's rays that is aimed.
const MOST: f32 = 0.2;
/// How many times as densely as others rays are aimed, at most.
const DENSER: f32 = 16.0;
/// The same of those that are aimed at where thrown light comes from, and what part of the others stays then.
const MOST_THROWN: f32 = 0.2;
const THROWN_DENSER: f32 = 64.0;
const BESIDE: f32 = 0.3;
/// Smaller cones are not worth it: 1 - cos of the angle.
const SMALLEST: f32 = 1e-6;

/// The directions to a ball.
struct Cone {
    axis: Vec3,
    height: f32,
    /// What part of the half sphere above a matte surface it is, at most; 0 where it is nothing to aim at.
    part: f32,
}

impl Cone {
    #[inline(always)]
    fn new(way: Vec3, radius: f32, normal: Vec3) -> Self {
        let distance2 = way.length_squared();
        let sin2 = radius * radius / distance2;
        let height = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let axis = way / distance2.sqrt();
        let up = normal.dot(axis) + sin2.sqrt();
        let apt = (sin2 < 0.999) & (height > SMALLEST) & (up > 0.0);
        let part = 2.0 * height * up.clamp(0.0, 1.0);
        Self {
            axis,
            height: if apt { height } else { 1.0 },
            part: if apt { part } else { 0.0 },
        }
    }
}

impl<const N: usize> Aims<N> {
    /// Sets the cone of a lane, and the share that it would have alone.
    #[inline(always)]
    fn put(&mut self, k: usize, lane: usize, cone: &Cone, denser: f32) {
        set(&mut self.axis[k], lane, cone.axis.to_array());
        self.height[k][lane] = cone.height;
        self.share[k][lane] = (denser * cone.part).min(1.0);
    }

    /// Lessens the shares of some cones where together they are more than this; what is left of the rest.
    #[inline(always)]
    fn bound(&mut self, cones: std::ops::Range<usize>, most: &[f32; N]) {
        let mut all = [0.0; N];
        for shares in &self.share[cones.clone()] {
            for (all, share) in all.iter_mut().zip(shares) {
                *all += share;
            }
        }
        let mut scale = [1.0; N];
        for lane in 0..N {
            let (all, most) = (all[lane], most[lane]);
            scale[lane] = if all > most { most / all } else { 1.0 };
            self.rest[lane] -= all * scale[lane];
        }
        for shares in &mut self.share[cones] {
            for (share, scale) in shares.iter_mut().zip(&scale) {
                *share *= scale;
            }
        }
    }
}

/// Finds the cones, and draws a direction for every lane by two numbers.
pub(crate) struct Aim<'a, const N: usize> {
    pub mirrors: &'a [Mirror],
    /// What each of them throws, where that is known.
    pub thrown: &'a [Thrown],
    pub places: &'a Places<N>,
    /// Whose rays are aimed.
    pub active: &'a [bool; N],
    pub random: &'a [[f32; N]; 2],
    pub aims: &'a mut Aims<N>,
    pub out: &'a mut Three<f32, N>,
}

impl<const N: usize> Loops for Aim<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            mirrors,
            thrown,
            places,
            active,
            random: [first, second],
            aims,
            out,
        } = self;
        let mirrors = &mirrors[..mirrors.len().min(MIRRORS)];
        let whole = mirrors.len();
        let mut most = active.map(|active| if active { MOST } else { 0.0 });
        let most_thrown = active.map(|active| if active { MOST_THROWN } else { 0.0 });
        aims.count = whole;
        for (k, mirror) in mirrors.iter().enumerate() {
            for lane in 0..N {
                let way = (mirror.center - vector(places.positions(), lane)).as_vec3();
                let cone = Cone::new(way, mirror.radius as f32, places.normal(lane));
                aims.put(k, lane, &cone, DENSER);
            }
        }
        for (mirror, thrown) in mirrors.iter().zip(thrown) {
            for (lane, most) in most.iter_mut().enumerate() {
                let from = (vector(places.positions(), lane) - mirror.center) / mirror.radius;
                let from = from.as_vec3();
                let exit = thrown.exit(from);
                let way = Vec3::from(exit.center) - from;
                let cone = Cone::new(way, exit.radius, places.normal(lane));
                aims.put(aims.count, lane, &cone, THROWN_DENSER);
                let beside = most.min(MOST * BESIDE);
                *most = if cone.part > 0.0 { beside } else { *most };
            }
            aims.count += 1;
        }
        aims.rest = [1.0; N];
        aims.bound(0..whole, &most);
        aims.bound(whole..aims.count, &most_thrown);
        // Where the first number lies says which cone it is; what is left of it is as good as new.
        let mut from = [0.0; N];
        let mut height = [1.0; N];
        let mut number = [0.0; N];
        let mut aimed = [false; N];
        let mut axis = *places.normals();
        for k in 0..aims.count {
            for lane in 0..N {
                let share = aims.share[k][lane];
                let at = first[lane] - from[lane];
                let here = (at >= 0.0) & (at < share);
                for (axis, other) in axis.iter_mut().zip(&aims.axis[k]) {
                    axis[lane] = if here { other[lane] } else { axis[lane] };
                }
                height[lane] = if here {
                    aims.height[k][lane]
                } else {
                    height[lane]
                };
                number[lane] = if here { at / share } else { number[lane] };
                aimed[lane] |= here;
                from[lane] += share;
            }
        }
        for lane in 0..N {
            let rest = (first[lane] - from[lane]) / aims.rest[lane];
            let x = if aimed[lane] { number[lane] } else { rest };
            let x = x.clamp(0.0, 1.0);
            let cap = x * height[lane];
            let sin2 = if aimed[lane] { cap * (2.0 - cap) } else { x };
            let cos = if aimed[lane] {
                1.0 - cap
            } else {
                (1.0 - x).sqrt()
            };
            let (turn_sin, turn_cos) = turn(second[lane]);
            let radius = sin2.sqrt();
            let local = Vec3::new(radius * turn_cos, radius * turn_sin, cos);
            let direction = above(get(&axis, lane).into(), local);
            set(out, lane, direction.to_array());
        }
    }
}
