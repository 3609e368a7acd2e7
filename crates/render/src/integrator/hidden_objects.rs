//! Objects that are hidden from some kinds of rays.
//!
//! Light samples pass objects that cast no shadow. They are stopped by objects that cast a shadow, even if
//! other rays do not find these objects. Rays that BSDFs sample must find the same light, because multiple
//! importance sampling divides the light between the two strategies. At an object that casts no shadow, a
//! second path searches for the light behind the object. Behind a hidden object that casts a shadow, a path
//! ignores light that light samples would find.

use glam::Vec3;
use raycam_bvh::{Hit, Ray};

use crate::integrator::batch::hits::{Chunk, HitBatch};
use crate::integrator::path_state::{LightSearch, PathState};
use crate::integrator::path_tracer::PathTracer;

impl PathTracer<'_> {
    /// True if an object is hidden from the ray of a path that hits it.
    pub fn is_hidden(&self, path: &PathState, hit: &Hit) -> bool {
        let rays = self.geometry.ray_visibility(hit.instance);
        if path.is_camera_ray { !rays.camera } else { !rays.reflection }
    }

    /// True if light samples already include light that a path finds directly.
    #[inline]
    pub fn skips_light(&self, path: &PathState) -> bool {
        path.light_search == LightSearch::Scattered && !path.specular_bounce
    }

    /// Adds the light of a hit that both BSDF samples and light samples can find. Returns false if the path ends at the
    /// hit. If a second path searches for the light behind the hit, also returns that path and its ray.
    #[inline(never)]
    pub fn meet_hidden(
        &self,
        path: &mut PathState,
        (hits, chunk, lane): (&HitBatch, Chunk, usize),
        radiance: &mut [Vec3],
    ) -> (bool, Option<(PathState, Ray)>) {
        let hit = &chunk.hits[lane];
        let (is_passed, is_hidden) = (hits.alpha_rejected[lane], self.is_hidden(path, hit));
        if path.specular_bounce || is_passed && !is_hidden {
            return (true, None);
        }
        let stops_light = self.geometry.ray_visibility(hit.instance).shadow;
        let is_search = path.light_search == LightSearch::Sampled;
        let (position, out) = (hits.interactions.position(lane), &mut radiance[path.ray_index()]);
        let distance = path.distance_to(position);
        if is_search && !is_hidden || is_hidden && stops_light {
            self.add_intersected_lights(path, distance, out);
        }
        if is_search || is_hidden {
            self.add_emission(path, &self.geometry.material(hit).material, hit, distance, out);
        }
        if is_hidden {
            if stops_light && !is_search {
                path.light_search = LightSearch::Scattered;
            }
            return (!(stops_light && is_search), None);
        }
        if stops_light || path.light_search == LightSearch::Scattered {
            return (!is_search, None);
        }
        // Lights in front of the object are added to this path, not to the path behind the object.
        let passed_distance = distance as f32;
        let behind = PathState { light_search: LightSearch::Sampled, passed_distance, ..*path };
        (!is_search, Some((behind, hits.interactions.lane(lane).ray_beyond(path.direction, f32::INFINITY))))
    }
}
