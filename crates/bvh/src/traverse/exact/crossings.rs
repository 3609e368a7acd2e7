//! All crossings of single rays within their range of t: float32 boxes find the candidates, exact signs of the moved ray
//! decide (see [`crate::exact::predicates::RayPredicates::moved_edge_sign`]).

use crate::ray::{Crossing, ExactHit, ExactRay, HitFilter};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use crate::traverse::exact::single::{ClippedRay, RaySearch, intersect_tlas};

/// Crossings beyond the wanted number that are kept before the farthest are dropped.
const SPARE_CROSSINGS: usize = 64;

/// The answers of a search for crossings.
pub enum Crossings<'a> {
    /// The number of crossings of each ray.
    Count(&'a mut [i32]),
    /// The crossings that leave less those that enter.
    SignedCount(&'a mut [i32]),
    /// The first crossings of each ray, at most `limit`, by (t, instance, triangle); their numbers in `counts`.
    List { limit: usize, counts: &'a mut [u32], found: &'a mut Vec<Crossing> },
}

#[inline(always)]
pub fn crossings_batch<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    filter: Option<&dyn HitFilter>,
    answers: &mut Crossings,
) {
    for (number, ray) in rays.iter().enumerate() {
        let Some(ray) = ClippedRay::new(scene, ray) else {
            continue;
        };
        let (range, direction_scale) = ([ray.t_min, ray.best.t], ray.direction_scale);
        let first = if let Crossings::List { found, .. } = answers { found.len() } else { 0 };
        let sink = match answers {
            Crossings::Count(counts) => Sink::Count(&mut counts[number]),
            Crossings::SignedCount(counts) => Sink::SignedCount(&mut counts[number]),
            Crossings::List { limit, found, .. } => Sink::List { first, limit: *limit, found },
        };
        // One call, not one in a closure: the kernel must be inlined to have its instruction set.
        intersect_tlas::<I>(scene, &mut CrossingSearch { ray, range, number, filter, sink }, triangles);
        if let Crossings::List { limit, counts, found } = answers {
            keep_first(found, first, *limit);
            for crossing in &mut found[first..] {
                crossing.hit.t /= direction_scale;
            }
            counts[number] = (found.len() - first) as u32;
        }
    }
}

/// The destination of the crossings of one ray.
enum Sink<'a> {
    Count(&'a mut i32),
    SignedCount(&'a mut i32),
    List { first: usize, limit: usize, found: &'a mut Vec<Crossing> },
}

/// The search for all crossings of one ray.
struct CrossingSearch<'a> {
    /// The ray; the `t` of its `best` is that up to which boxes are visited.
    ray: ClippedRay,
    /// The valid t, along the ray's scaled direction.
    range: [f64; 2],
    number: usize,
    filter: Option<&'a dyn HitFilter>,
    sink: Sink<'a>,
}

impl RaySearch for CrossingSearch<'_> {
    #[inline(always)]
    fn clipped_ray(&self) -> &ClippedRay {
        &self.ray
    }

    #[inline(always)]
    fn accepts_instance(&self, instance: u32) -> bool {
        self.filter.is_none_or(|filter| filter.accepts_instance(self.number, instance))
    }

    #[inline(always)]
    fn visit(&mut self, instance: u32, triangle: u32, triangles: &dyn ExactTriangles) {
        let ray = &self.ray.ray;
        let corners = triangles.corners(instance, triangle);
        let Some((found, side)) = ray.cross(corners) else {
            return;
        };
        if !ray.is_within(&found, corners, side, self.range) {
            return;
        }
        let side = if triangles.is_mirrored(instance) { -side } else { side };
        let mut hit = ExactHit { t: found.t, u: found.u, v: found.v, instance, triangle, normal: found.normal };
        if self.filter.is_some_and(|filter| !filter.accepts(self.number, &hit)) {
            return;
        }
        match &mut self.sink {
            Sink::Count(count) => **count += 1,
            Sink::SignedCount(count) => **count += side,
            Sink::List { first, limit, found } => {
                [hit.t, hit.u, hit.v] = ray.precise_intersection(corners);
                found.push(Crossing { hit, side });
                if found.len() - *first >= limit.saturating_add(SPARE_CROSSINGS) {
                    keep_first(found, *first, *limit);
                    self.ray.best.t = found.last().map_or(self.range[0], |last| last.hit.t);
                }
            }
        }
    }
}

/// Sorts the crossings from `first` on by (t, instance, triangle), and keeps at most `limit` of them.
fn keep_first(found: &mut Vec<Crossing>, first: usize, limit: usize) {
    let order = |a: &Crossing, b: &Crossing| {
        a.hit.t.total_cmp(&b.hit.t).then((a.hit.instance, a.hit.triangle).cmp(&(b.hit.instance, b.hit.triangle)))
    };
    found[first..].sort_unstable_by(order);
    found.truncate(first.saturating_add(limit).min(found.len()));
}
