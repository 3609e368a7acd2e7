//! Queries of a scene: closest hit and any hit, in float32 and float64; crossings and closest points.

use crate::exact::closest_point::closest_point;
use crate::ray::{ClosestPoint, Coherence, ExactHit, ExactRay, Hit, HitDetail, HitFilter, INVALID_ID, Ray, Tie};
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{ExactTriangles, Scene};
use crate::traverse;
use crate::traverse::exact::crossings::Crossings;
use crate::traverse::exact::ties::MarkedHits;

impl Scene {
    /// Finds the closest hit of every ray, on the calling thread. `hits` must be as long as `rays`. Returns the rays
    /// that may have hit coplanar surfaces of two instances, in any order; [`Scene::closest_exact`] decides which
    /// surface they hit.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) -> Vec<u32> {
        assert_eq!(rays.len(), hits.len(), "the numbers of hits and rays must be equal");
        let mut marked = vec![];
        traverse::closest(self.dispatch, self, rays, hits, coherence, &mut marked);
        if let Some(mesh_ranges) = &self.mesh_ranges {
            mesh_ranges.remap_hits(hits.iter_mut().map(|hit| (&mut hit.instance, &mut hit.triangle)));
        }
        marked
    }

    /// Sets `occluded` to true for every ray that hits anything, on the calling thread. `occluded` must be as long as
    /// `rays`.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        assert_eq!(rays.len(), occluded.len(), "the numbers of results and rays must be equal");
        traverse::occluded(self.dispatch, self, rays, occluded, coherence);
    }

    /// Finds the closest hit of every ray, decided exactly for the float64 corners. Edges, corners and both ends of the
    /// range of t are included, and hits are ordered by (t, instance, triangle). If surfaces of several instances are
    /// coplanar up to rounding to float32, the ray hits the instance with the largest index. Returns a tie for each ray
    /// that hits several instances at the same distance, up to that rounding, in the order of the rays. Runs on the
    /// calling thread; `hits` must be as long as `rays`.
    pub fn closest_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        hits: &mut [ExactHit],
    ) -> Vec<Tie> {
        self.closest_exact_with(rays, triangles, None, HitDetail::Intersection, hits)
    }

    /// Same as [`Scene::closest_exact`] among the hits that the filter accepts. Only the fields that `detail` specifies
    /// are computed.
    pub fn closest_exact_with<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        detail: HitDetail,
        hits: &mut [ExactHit],
    ) -> Vec<Tie> {
        let ties = self.trace_exact(rays, triangles, filter, false, hits);
        match detail {
            HitDetail::Triangle => {}
            HitDetail::Side => traverse::orient(self.dispatch, rays, triangles, hits),
            HitDetail::Intersection => traverse::intersect(self.dispatch, rays, triangles, hits),
            HitDetail::Refined => traverse::refine(self.dispatch, rays, triangles, hits),
        }
        ties
    }

    /// Sets `occluded` to true for every ray that hits anything that the filter accepts; hits are decided as by
    /// [`Scene::closest_exact`].
    pub fn occluded_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        occluded: &mut [bool],
    ) {
        assert_eq!(rays.len(), occluded.len(), "the numbers of results and rays must be equal");
        let mut hits = vec![ExactHit::MISS; rays.len()];
        self.trace_exact(rays, triangles, filter, true, &mut hits);
        for (occluded, hit) in occluded.iter_mut().zip(hits) {
            *occluded = hit.instance != INVALID_ID;
        }
    }

    /// Finds the closest hits, or any hits. For closest hits that float32 determines, only the ids are set.
    fn trace_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        any_hit: bool,
        hits: &mut [ExactHit],
    ) -> Vec<Tie> {
        assert_eq!(rays.len(), hits.len(), "the numbers of hits and rays must be equal");
        let trace = |triangles: &dyn ExactTriangles, filter: Option<&dyn HitFilter>, hits: &mut [ExactHit]| {
            let mut marked = vec![];
            if !any_hit || filter.is_none() {
                traverse::closest_exact(
                    self.dispatch,
                    self,
                    rays,
                    triangles,
                    any_hit,
                    MarkedHits { hits, marked: &mut marked },
                );
            }
            if let Some(filter) = filter {
                if !any_hit {
                    traverse::intersect(self.dispatch, rays, triangles, hits);
                }
                traverse::filter_exact(
                    self.dispatch,
                    self,
                    rays,
                    triangles,
                    filter,
                    any_hit,
                    MarkedHits { hits, marked: &mut marked },
                );
            }
            if any_hit || marked.is_empty() {
                return vec![];
            }
            for &ray in &marked {
                let at = ray as usize..ray as usize + 1;
                traverse::intersect(self.dispatch, &rays[at.clone()], triangles, &mut hits[at]);
            }
            self.settle_ties(rays, triangles, filter, marked, hits)
        };
        match &self.mesh_ranges {
            None => trace(triangles, filter, hits),
            Some(mesh_ranges) => {
                let inner = filter.map(|filter| FlattenedFilter(mesh_ranges, filter));
                let filter = inner.as_ref().map(|filter| filter as &dyn HitFilter);
                let tied = trace(&FlattenedTriangles(mesh_ranges, triangles), filter, hits);
                mesh_ranges.remap_hits(hits.iter_mut().map(|hit| (&mut hit.instance, &mut hit.triangle)));
                tied
            }
        }
    }

    /// Recomputes t and the weights of every hit, accurate to one unit in the last place. `hits` must be as long as
    /// `rays`.
    ///
    /// # Panics
    /// For flattened scenes.
    pub fn refine<T: ExactTriangles>(&self, rays: &[ExactRay], triangles: &T, hits: &mut [ExactHit]) {
        assert!(
            rays.len() == hits.len() && self.mesh_ranges.is_none(),
            "the numbers of hits and rays must be equal, \
            and the scene must not be flattened"
        );
        traverse::refine(self.dispatch, rays, triangles, hits);
    }

    /// Finds the crossings of every ray within its range of t, at most `limit` per ray, sorted by (t, instance,
    /// triangle), with t and weights as in [`Scene::refine`]. The crossings are appended to `found` ray by ray; the
    /// number of crossings of each ray is written to `counts`, which must be as long as `rays`. Runs on the calling
    /// thread.
    ///
    /// Each ray is shifted by an infinitesimal vector (simulation of simplicity), so that it never passes exactly
    /// through an edge or a corner, or starts exactly on a surface. A surface is crossed once at an edge that its
    /// triangles share, and a line crosses a closed mesh an even number of times.
    ///
    /// # Panics
    /// For flattened scenes.
    pub fn crossings<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        limit: usize,
        (counts, found): (&mut [u32], &mut Vec<ExactHit>),
    ) {
        assert!(
            rays.len() == counts.len() && self.mesh_ranges.is_none(),
            "the numbers of counts and rays must be \
            equal, and the scene must not be flattened"
        );
        counts.fill(0);
        let mut answers = Crossings::List { limit, counts, found };
        traverse::crossings(self.dispatch, self, rays, triangles, filter, &mut answers);
    }

    /// Counts the crossings of every ray, which are defined as in [`Scene::crossings`]. If `signed` is true, the number
    /// is exits minus entries.
    ///
    /// # Panics
    /// For flattened scenes.
    pub fn count_crossings<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        signed: bool,
        counts: &mut [i32],
    ) {
        assert!(
            rays.len() == counts.len() && self.mesh_ranges.is_none(),
            "the numbers of counts and rays must be \
            equal, and the scene must not be flattened"
        );
        counts.fill(0);
        let mut answers = if signed { Crossings::SignedCount(counts) } else { Crossings::Count(counts) };
        traverse::crossings(self.dispatch, self, rays, triangles, filter, &mut answers);
    }

    /// Finds the scene's closest point to every given point within a distance. There is one distance for all points, or
    /// one per point. Of equally close triangles, the triangle whose outward normal has the smallest angle with the
    /// direction to the point is returned, and of these, the smallest (instance, triangle). The filter receives only
    /// the instance and triangle of a hit. The query runs on the calling thread, and is fast if consecutive points are
    /// close to each other. `found` must be as long as `points`.
    ///
    /// # Panics
    /// For flattened scenes.
    pub fn closest_points<T: ExactTriangles>(
        &self,
        points: &[[f64; 3]],
        max_distance: &[f64],
        triangles: &T,
        filter: Option<&dyn HitFilter>,
        found: &mut [ClosestPoint],
    ) {
        assert!(
            points.len() == found.len() && self.mesh_ranges.is_none(),
            "the numbers of results and points must be \
            equal, and the scene must not be flattened"
        );
        assert!(max_distance.len() == 1 || max_distance.len() == points.len(), "expected one limit, or one per point");
        traverse::closest_points(self.dispatch, self, points, max_distance, triangles, filter, found);
    }
}

/// Returns the squared distance from a point to a triangle, both in the same coordinate frame.
pub fn squared_distance_to_triangle(point: [f64; 3], corners: [[f64; 3]; 3]) -> f64 {
    closest_point(point, corners).squared_distance
}

/// Filter for a flattened scene: looks up the instance and triangle of a hit, and calls the inner filter.
struct FlattenedFilter<'a>(&'a InstanceRanges, &'a dyn HitFilter);

impl HitFilter for FlattenedFilter<'_> {
    fn accepts_instance(&self, _: usize, _: u32) -> bool {
        true
    }

    fn accepts(&self, ray: usize, hit: &ExactHit) -> bool {
        let (instance, triangle) = self.0.locate(hit.triangle);
        self.1.accepts_instance(ray, instance) && self.1.accepts(ray, &ExactHit { instance, triangle, ..*hit })
    }
}

/// The triangles of all instances, by their index in the flattened BLAS.
pub(crate) struct FlattenedTriangles<'a, T>(pub &'a InstanceRanges, pub &'a T);

impl<T: ExactTriangles> ExactTriangles for FlattenedTriangles<'_, T> {
    fn corners(&self, _: u32, triangle: u32) -> [[f64; 3]; 3] {
        let (mesh, triangle) = self.0.locate(triangle);
        self.1.corners(mesh, triangle)
    }
}
