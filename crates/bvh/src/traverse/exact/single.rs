//! Closest hits and any hits of single rays, in float64.

use crate::ray::{ExactHit, ExactRay, HitFilter, INVALID_ID};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use crate::traverse::exact::clipped_ray::{ClippedRay, DONE};
use crate::traverse::exact::ray_state::{Decision, ExactRayState, RaySearch, TriangleEstimate};
use crate::traverse::exact::ties::MarkedHits;
use crate::traverse::single::interleaved::{RaySource, traverse_rays};

/// The search for the closest hit, or for any hit, that a filter accepts.
///
/// Float32 rejects triangles that are certainly behind the closest hit so far, and accepts triangles that are certainly
/// hit before it. Of an accepted triangle, only the ids are kept. The intersection is computed in float64 if another
/// triangle is too close, or at the end by [`crate::traverse::exact::refine`].
pub struct HitSearch<'a> {
    pub ray: ClippedRay,
    /// The ray's index, for the filter.
    pub number: usize,
    pub filter: Option<&'a dyn HitFilter>,
    /// Bounds of the t of the closest hit so far, or of the end of the ray, counted from the clipped origin.
    best_t: [f32; 2],
    /// True if the intersection of the closest hit so far has not been computed; its t is then an upper bound.
    is_pending: bool,
}

impl<'a> HitSearch<'a> {
    #[inline(always)]
    pub fn new(ray: ClippedRay, number: usize, filter: Option<&'a dyn HitFilter>) -> Self {
        HitSearch { best_t: ray.best_t_f32(), ray, number, filter, is_pending: false }
    }

    /// Computes the intersection of the closest hit, if this has not been done.
    #[inline(always)]
    pub fn finish(&mut self, triangles: &dyn ExactTriangles) {
        if self.is_pending {
            self.resolve(triangles);
        }
    }

    #[inline(never)]
    fn resolve(&mut self, triangles: &dyn ExactTriangles) {
        let ExactHit { instance, triangle, .. } = self.ray.best;
        if let Some(found) = self.ray.ray.intersect(triangles.corners(instance, triangle)) {
            self.ray.best = found.to_hit(instance, triangle);
            self.ray.t_error = found.t_error;
            self.best_t = self.ray.best_t_f32();
        }
        self.is_pending = false;
    }

    /// The hit, with t in units of the given direction's length. For a pending hit, only the ids are set.
    #[inline(always)]
    fn to_hit(&self) -> ExactHit {
        let ExactHit { instance, triangle, .. } = self.ray.best;
        if self.is_pending { ExactHit { instance, triangle, ..ExactHit::MISS } } else { self.ray.to_hit() }
    }
}

impl RaySearch for HitSearch<'_> {
    #[inline(always)]
    fn clipped_ray(&self) -> &ClippedRay {
        &self.ray
    }

    #[inline(always)]
    fn accepts_instance(&self, instance: u32) -> bool {
        self.filter.is_none_or(|filter| filter.accepts_instance(self.number, instance))
    }

    #[inline(always)]
    fn uses_float32(&self) -> bool {
        self.filter.is_none_or(HitFilter::accepts_every_hit)
    }

    #[inline(always)]
    fn decide(&self, &TriangleEstimate { t: [least, greatest], is_sure, .. }: &TriangleEstimate) -> Decision {
        let [near, far] = self.best_t;
        let tie = if self.ray.any_hit { 0.0 } else { self.ray.tie_width_f32([least, greatest]) };
        if greatest < 0.0 || least > far + tie {
            return Decision::Rejected;
        }
        if is_sure && least > 0.0 && greatest + tie < near { Decision::Accepted } else { Decision::Unknown }
    }

    #[inline(always)]
    fn accept(&mut self, (instance, triangle): (u32, u32), estimate: &TriangleEstimate) {
        let best = &mut self.ray.best;
        (best.instance, best.triangle) = (instance, triangle);
        if self.ray.any_hit {
            best.t = DONE;
            return;
        }
        best.t = f64::from(estimate.t[1]) + self.ray.t_offset;
        self.best_t = estimate.t;
        self.is_pending = true;
    }

    #[inline(always)]
    fn visit(&mut self, triangle: (u32, u32), corners: [[f64; 3]; 3], triangles: &dyn ExactTriangles) {
        let Some(found) = self.ray.ray.intersect(corners) else { return };
        self.finish(triangles);
        let (number, filter) = (self.number, self.filter);
        let accepts = |hit: &ExactHit| filter.is_none_or(|filter| filter.accepts(number, hit));
        if self.ray.keep_closer(&found, triangle, corners, triangles, accepts) {
            self.best_t = self.ray.best_t_f32();
        }
    }
}

/// Source of those rays of a batch whose indices are in `numbers`, and sink of their hits.
struct HitSource<'a, 'b, W> {
    scene: &'a Scene,
    rays: &'b [ExactRay],
    numbers: W,
    filter: Option<&'b dyn HitFilter>,
    any_hit: bool,
    hits: &'b mut [ExactHit],
    /// Rays that may have hit two surfaces at equal distances.
    marked: &'b mut Vec<u32>,
}

impl<'a, 'b, W: Iterator<Item = usize>> RaySource<ExactRayState<'a, HitSearch<'b>>> for HitSource<'a, 'b, W> {
    #[inline(always)]
    fn start(&mut self, state: &mut ExactRayState<'a, HitSearch<'b>>) -> bool {
        for number in &mut self.numbers {
            self.hits[number] = ExactHit::MISS;
            let Some(mut ray) = ClippedRay::new(self.scene, &self.rays[number]) else { continue };
            ray.any_hit = self.any_hit;
            if state.begin(self.scene, number, HitSearch::new(ray, number, self.filter), None) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut ExactRayState<'a, HitSearch<'b>>) {
        if let Some(search) = &state.search {
            self.hits[state.ray_id] = search.to_hit();
            if search.ray.contested {
                self.marked.push(state.ray_id as u32);
            }
        }
    }
}

/// Finds the closest hits, or any hits, of the rays whose indices are given, and marks the rays that may have hit two
/// surfaces at equal distances. In a search for any hits, `instance` only shows whether the ray hit anything, and all
/// other fields are unspecified.
#[inline(always)]
pub fn trace_alone<I: Isa>(
    scene: &Scene,
    (rays, numbers): (&[ExactRay], impl Iterator<Item = usize>),
    triangles: &dyn ExactTriangles,
    filter: Option<&dyn HitFilter>,
    any_hit: bool,
    MarkedHits { hits, marked }: MarkedHits,
) {
    let mut source = HitSource { scene, rays, numbers, filter, any_hit, hits, marked };
    traverse_rays::<I, _>(scene, rays.len(), || ExactRayState::idle(triangles), &mut source);
}

/// Finds any hits that a filter accepts or, in a search for closest hits, replaces each given hit that the filter
/// rejects by the closest accepted hit.
#[inline(always)]
pub fn filter_hits<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    filter: &dyn HitFilter,
    any_hit: bool,
    answers: MarkedHits,
) {
    let refused = |(number, hit): (usize, &ExactHit)| {
        let counts = || filter.accepts_instance(number, hit.instance) && filter.accepts(number, hit);
        (any_hit || hit.instance != INVALID_ID && !counts()).then_some(number)
    };
    let numbers: Vec<usize> = answers.hits.iter().enumerate().filter_map(refused).collect();
    if !numbers.is_empty() {
        trace_alone::<I>(scene, (rays, numbers.into_iter()), triangles, Some(filter), any_hit, answers);
    }
}
