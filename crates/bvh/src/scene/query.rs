//! Ray queries of a scene: closest hit, any hit, and closest hit in float64.

use crate::ray::{Coherence, ExactHit, ExactRay, Hit, INVALID_ID, Ray};
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{ExactTriangles, Scene};
use crate::traverse;

impl Scene {
    /// The closest hit of every ray, on the calling thread. `hits` is as long as `rays`.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        traverse::closest(self.dispatch, self, rays, hits, coherence);
        if let Some(mesh_ranges) = &self.mesh_ranges {
            mesh_ranges.remap_hits(hits.iter_mut().map(|hit| (&mut hit.instance, &mut hit.triangle)));
        }
    }

    /// True for every ray that hits anything, on the calling thread. `occluded` is as long as `rays`.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        traverse::occluded(self.dispatch, self, rays, occluded, coherence);
    }

    /// The closest hit of every ray, decided exactly for the float64 corners: edges, corners and both ends of the range of t
    /// belong to it, and the order is that of (t, instance, triangle). On the calling thread; `hits` is as long as `rays`.
    pub fn closest_exact<T: ExactTriangles>(&self, rays: &[ExactRay], triangles: &T, hits: &mut [ExactHit]) {
        self.trace_exact(rays, triangles, false, hits);
    }

    /// True for every ray that hits anything, decided as by [`Scene::closest_exact`].
    pub fn occluded_exact<T: ExactTriangles>(&self, rays: &[ExactRay], triangles: &T, occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        let mut hits = vec![ExactHit::MISS; rays.len()];
        self.trace_exact(rays, triangles, true, &mut hits);
        for (occluded, hit) in occluded.iter_mut().zip(hits) {
            *occluded = hit.instance != INVALID_ID;
        }
    }

    fn trace_exact<T: ExactTriangles>(&self, rays: &[ExactRay], triangles: &T, any_hit: bool, hits: &mut [ExactHit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        match &self.mesh_ranges {
            None => traverse::closest_exact(self.dispatch, self, rays, triangles, any_hit, hits),
            Some(mesh_ranges) => {
                let all = FlattenedTriangles(mesh_ranges, triangles);
                traverse::closest_exact(self.dispatch, self, rays, &all, any_hit, hits);
                mesh_ranges.remap_hits(hits.iter_mut().map(|hit| (&mut hit.instance, &mut hit.triangle)));
            }
        }
    }
}

/// The triangles of all instances as those of the flattened BLAS.
pub(crate) struct FlattenedTriangles<'a, T>(pub &'a InstanceRanges, pub &'a T);

impl<T: ExactTriangles> ExactTriangles for FlattenedTriangles<'_, T> {
    fn corners(&self, _: u32, triangle: u32) -> [[f64; 3]; 3] {
        let (mesh, triangle) = self.0.locate(triangle);
        self.1.corners(mesh, triangle)
    }
}
