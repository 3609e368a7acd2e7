//! All crossings of single rays within their range of t: float32 boxes find the candidates, exact signs of the shifted
//! ray decide (see [`crate::exact::predicates::RayPredicates::moved_edge_sign`]).

use crate::ray::{ExactHit, ExactRay, HitFilter};
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use crate::traverse::exact::clipped_ray::ClippedRay;
use crate::traverse::exact::ray_state::{Decision, ExactRayState, RaySearch, TriangleEstimate};
use crate::traverse::exact::refine::refine_hits;
use crate::traverse::single::interleaved::{RaySource, traverse_rays};

/// Number of crossings that are kept in addition to the requested number, before the farthest are dropped.
const SPARE_CROSSINGS: usize = 64;

/// Results of a search for crossings.
pub enum Crossings<'a> {
    /// The number of crossings of each ray.
    Count(&'a mut [i32]),
    /// The number of exits minus the number of entries.
    SignedCount(&'a mut [i32]),
    /// At most `limit` first crossings of each ray, ordered by (t, instance, triangle); `counts` receives the number of
    /// crossings.
    List { limit: usize, counts: &'a mut [u32], found: &'a mut Vec<ExactHit> },
}

#[inline(always)]
pub fn crossings_batch<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    filter: Option<&dyn HitFilter>,
    answers: &mut Crossings,
) {
    let lists = Lists { of_rays: vec![0..0; rays.len()], owners: vec![], hits: vec![], spare: vec![] };
    let mut source = CrossingSource { scene, rays: rays.iter().enumerate(), filter, answers, lists };
    traverse_rays::<I, _>(scene, rays.len(), || ExactRayState::idle(triangles), &mut source);
    let Lists { of_rays, owners, mut hits, .. } = source.lists;
    if let Crossings::List { limit, counts, found } = answers {
        refine_hits::<I>(rays, |i| owners[i], triangles, &mut hits);
        for (range, count) in of_rays.into_iter().zip(counts.iter_mut()) {
            let first = first_hits(&mut hits[range], *limit);
            *count = first.len() as u32;
            found.extend_from_slice(first);
        }
    }
}

/// The requested result of a search for crossings.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Count,
    SignedCount,
    List { limit: usize },
}

/// The search for all crossings of one ray.
struct CrossingSearch<'a> {
    /// The ray; its `best.t` is the t up to which boxes are visited.
    ray: ClippedRay,
    /// The smallest and the largest valid t, along the ray's scaled direction.
    range: [f64; 2],
    /// A t, counted from the clipped origin: smaller positive values of t are certainly within the range.
    certain_t_max: f32,
    number: usize,
    filter: Option<&'a dyn HitFilter>,
    wanted: Wanted,
    count: i32,
    /// The crossings found so far, if a list is requested.
    found: Vec<ExactHit>,
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
    fn uses_float32(&self) -> bool {
        let counts = matches!(self.wanted, Wanted::Count | Wanted::SignedCount);
        counts && self.filter.is_none_or(HitFilter::accepts_every_hit)
    }

    #[inline(always)]
    fn decide(&self, &TriangleEstimate { t: [least, greatest], is_sure, .. }: &TriangleEstimate) -> Decision {
        let is_within = least > 0.0 && greatest < self.certain_t_max;
        if is_sure && is_within { Decision::Accepted } else { Decision::Unknown }
    }

    #[inline(always)]
    fn accept(&mut self, _triangle: (u32, u32), estimate: &TriangleEstimate) {
        self.count += if self.wanted == Wanted::Count || estimate.leaves { 1 } else { -1 };
    }

    #[inline(always)]
    fn visit(&mut self, (instance, triangle): (u32, u32), corners: [[f64; 3]; 3], triangles: &dyn ExactTriangles) {
        let ray = &self.ray.ray;
        let Some(found) = ray.cross(corners) else { return };
        if !ray.is_within(&found, corners, self.range) {
            return;
        }
        let hit = found.to_hit(instance, triangle);
        if self.filter.is_some_and(|filter| !filter.accepts(self.number, &hit)) {
            return;
        }
        match self.wanted {
            Wanted::Count => self.count += 1,
            Wanted::SignedCount => self.count += if triangles.is_mirrored(instance) { -hit.side } else { hit.side },
            Wanted::List { limit } => {
                self.found.push(hit);
                if self.found.len() >= limit.saturating_add(SPARE_CROSSINGS) {
                    self.drop_farthest(limit, triangles);
                }
            }
        }
    }
}

impl CrossingSearch<'_> {
    /// Keeps only the first crossings, and ends the ray at the last of these.
    #[cold]
    #[inline(never)]
    fn drop_farthest(&mut self, limit: usize, triangles: &dyn ExactTriangles) {
        let ray = self.ray.ray.predicates();
        for hit in &mut self.found {
            hit.t = ray.intersection(triangles.corners(hit.instance, hit.triangle))[0];
        }
        let kept = first_hits(&mut self.found, limit).len();
        self.found.truncate(kept);
        self.ray.best.t = self.found.last().map_or(self.range[0], |last| last.t);
    }
}

/// Sorts hits by (t, instance, triangle), and returns the first `limit` of them.
fn first_hits(hits: &mut [ExactHit], limit: usize) -> &[ExactHit] {
    hits.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then((a.instance, a.triangle).cmp(&(b.instance, b.triangle))));
    &hits[..limit.min(hits.len())]
}

/// Lists of crossings of finished rays.
struct Lists {
    /// For each ray, the range of its crossings in `hits`.
    of_rays: Vec<std::ops::Range<usize>>,
    /// For each crossing, the index of its ray.
    owners: Vec<usize>,
    hits: Vec<ExactHit>,
    /// Empty lists whose memory can be reused.
    spare: Vec<Vec<ExactHit>>,
}

/// Source of the rays of a batch, and sink of their crossings.
struct CrossingSource<'a, 'b, 'c, W> {
    scene: &'a Scene,
    rays: W,
    filter: Option<&'b dyn HitFilter>,
    answers: &'b mut Crossings<'c>,
    lists: Lists,
}

impl<'a, 'b, 'r, W: Iterator<Item = (usize, &'r ExactRay)>> RaySource<ExactRayState<'a, CrossingSearch<'b>>>
    for CrossingSource<'a, 'b, '_, W>
{
    #[inline(always)]
    fn start(&mut self, state: &mut ExactRayState<'a, CrossingSearch<'b>>) -> bool {
        for (number, ray) in &mut self.rays {
            let Some(ray) = ClippedRay::new(self.scene, ray) else { continue };
            let wanted = match self.answers {
                Crossings::Count(_) => Wanted::Count,
                Crossings::SignedCount(_) => Wanted::SignedCount,
                Crossings::List { limit, .. } => Wanted::List { limit: *limit },
            };
            let (range, found) = ([ray.t_min, ray.best.t], self.lists.spare.pop().unwrap_or_default());
            let [certain_t_max, _] = ray.best_t_f32();
            let search =
                CrossingSearch { ray, range, certain_t_max, number, filter: self.filter, wanted, count: 0, found };
            if state.begin(self.scene, number, search, None) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, state: &mut ExactRayState<'a, CrossingSearch<'b>>) {
        let (Some(search), number) = (&mut state.search, state.ray_id) else { return };
        match self.answers {
            Crossings::Count(counts) | Crossings::SignedCount(counts) => counts[number] = search.count,
            Crossings::List { .. } => {
                let Lists { of_rays, owners, hits, spare } = &mut self.lists;
                of_rays[number] = hits.len()..hits.len() + search.found.len();
                hits.append(&mut search.found);
                owners.resize(hits.len(), number);
                spare.push(std::mem::take(&mut search.found));
            }
        }
    }
}
