//! Closest and any hits in float64 of single rays.

use crate::ray::{ExactHit, ExactRay, HitFilter, INVALID_ID};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use crate::traverse::exact::clipped_ray::{ClippedRay, DONE};
use crate::traverse::exact::leaf::SureCrossings;
use crate::traverse::exact::ray_state::{ExactRayState, RaySearch};
use crate::traverse::exact::ties::MarkedHits;
use crate::traverse::single::interleaved::{RaySource, traverse_rays};

/// The search for the closest hit, or any, that a filter accepts.
pub struct HitSearch<'a> {
    pub ray: ClippedRay,
    /// The ray's index, for the filter.
    pub number: usize,
    pub filter: Option<&'a dyn HitFilter>,
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
    fn takes_sure(&self) -> bool {
        self.ray.any_hit && self.filter.is_none_or(HitFilter::accepts_every_hit)
    }

    #[inline(always)]
    fn take_sure(&mut self, instance: u32, sure: SureCrossings) {
        if sure.crossed != 0 {
            self.ray.best = ExactHit { t: DONE, instance, triangle: 0, ..self.ray.best };
        }
    }

    #[inline(always)]
    fn visit(&mut self, triangle: (u32, u32), corners: [[f64; 3]; 3], triangles: &dyn ExactTriangles) {
        let (number, filter) = (self.number, self.filter);
        let accepts = |hit: &ExactHit| filter.is_none_or(|filter| filter.accepts(number, hit));
        self.ray.intersect_exact(triangle, corners, triangles, accepts);
    }
}

/// Source of the rays of a batch with these numbers, and sink of their hits.
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
            if state.begin(self.scene, number, HitSearch { ray, number, filter: self.filter }, None) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut ExactRayState<'a, HitSearch<'b>>) {
        if let Some(search) = &state.search {
            self.hits[state.ray_id] = search.ray.to_hit();
            if search.ray.contested {
                self.marked.push(state.ray_id as u32);
            }
        }
    }
}

/// The closest hits, or any hits, of the rays with these numbers, and the rays that may have hit two surfaces at equal
/// distances. For any hits, only the presence of an instance is valid.
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

/// Finds any hits that a filter accepts. If the filter does not accept the given closest hits, finds the closest
/// accepted hits.
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
