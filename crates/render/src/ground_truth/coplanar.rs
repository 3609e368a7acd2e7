//! Rule for coplanar surfaces of several objects, by which float32 rays hit the same surface as exact rays.
//!
//! If surfaces are in the same plane up to rounding errors, rays hit the object that comes last in the world (see
//! [`Scene::closest_exact`]). If the ray does not find the chosen surface, or if this surface is mostly transparent at
//! the point, another coplanar surface is chosen.

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, HitDetail, HitFilter, INVALID_ID, Ray, Scene, Tie};
use raycam_scene::world::RayVisibility;

use crate::ground_truth::convert::to_float_hit;
use crate::ground_truth::transparent::OPACITY_THRESHOLD;
use crate::prepare::geometry::Geometry;

/// Distance in front of and behind a float32 hit within which the exact hit is searched for: a fraction of t plus a
/// fraction of the scene's radius.
const RELATIVE_SEARCH: f64 = 1.0 / (1u64 << 13) as f64;
const ABSOLUTE_SEARCH: f64 = 1.0 / (1u64 << 14) as f64;

/// Returns true if the visibility of an object allows rays of a certain kind to hit the object.
type FindsRay = fn(&RayVisibility) -> bool;

impl Geometry {
    /// First hits of float32 rays in `scene`, one of the geometry's scenes; `finds` tests whether rays of
    /// this kind can hit an object. Returns the rays that hit several objects at the same distance, up to
    /// rounding, in ascending order of the rays.
    pub(crate) fn closest(
        &self,
        scene: &Scene,
        rays: &[Ray],
        hits: &mut [Hit],
        coherence: Coherence,
        finds: FindsRay,
    ) -> Vec<Tie> {
        let marked = scene.closest(rays, hits, coherence);
        if marked.is_empty() { vec![] } else { self.decide_exactly(rays, hits, marked, finds) }
    }

    /// Replaces the hits of marked rays, which may hit several objects at the same distance, up to rounding.
    /// If exact arithmetic confirms this, the exact hit replaces the float32 hit. Otherwise, the float32 hit
    /// is kept, because the marks depend on the order of traversal.
    #[cold]
    #[inline(never)]
    fn decide_exactly(&self, rays: &[Ray], hits: &mut [Hit], mut marked: Vec<u32>, finds: FindsRay) -> Vec<Tie> {
        marked.sort_unstable();
        marked.dedup();
        marked.retain(|&i| hits[i as usize].instance != INVALID_ID);
        let exact = |&i: &u32| {
            let ray = &rays[i as usize];
            let origin = (Vec3::from(ray.origin).as_dvec3() + self.origin).to_array();
            let (direction, t_max) = (ray.direction.map(f64::from), f64::from(ray.t_max));
            self.around_hit(&ExactRay { origin, direction, t_min: 0.0, t_max }, f64::from(hits[i as usize].t))
        };
        let exact: Vec<ExactRay> = marked.iter().map(exact).collect();
        let mut found = vec![ExactHit::MISS; exact.len()];
        let ties = self.closest_exact(&exact, &mut found);
        self.prefer_opaque(&exact, &mut found, &ties, finds);
        let decide = |tie: Tie| {
            let ray = marked[tie.ray as usize];
            hits[ray as usize] = to_float_hit(&found[tie.ray as usize]);
            Tie { ray, ..tie }
        };
        ties.into_iter().map(decide).collect()
    }

    /// Replaces exact hits on coplanar surfaces by hits on other surfaces in the same plane, if there are any. A hit is
    /// replaced if rays of this kind do not find its surface, or if the surface is mostly transparent at the hit.
    pub(crate) fn prefer_opaque(&self, rays: &[ExactRay], hits: &mut [ExactHit], ties: &[Tie], finds: FindsRay) {
        let filter = SurfaceFilter { geometry: self, finds };
        for tie in ties {
            let (ray, hit) = (&rays[tie.ray as usize], &mut hits[tie.ray as usize]);
            let mut found = [*hit];
            self.exact_scene().closest_exact_with(
                &[self.around_hit(ray, hit.t)],
                self,
                Some(&filter),
                HitDetail::Intersection,
                &mut found,
            );
            if found[0].instance != INVALID_ID {
                *hit = found[0];
            }
        }
    }

    /// The part of a ray in which the exact hit near the float32 hit at `t` is searched for.
    fn around_hit(&self, ray: &ExactRay, t: f64) -> ExactRay {
        let search = t * RELATIVE_SEARCH + self.radius * ABSOLUTE_SEARCH / DVec3::from(ray.direction).length();
        ExactRay { t_min: (t - search).max(ray.t_min), t_max: (t + search).min(ray.t_max), ..*ray }
    }
}

/// Filter that accepts surfaces that rays of one kind can hit and that are not mostly transparent.
struct SurfaceFilter<'a> {
    geometry: &'a Geometry,
    finds: FindsRay,
}

impl HitFilter for SurfaceFilter<'_> {
    fn accepts_instance(&self, _: usize, instance: u32) -> bool {
        (self.finds)(&self.geometry.ray_visibility(instance))
    }

    fn accepts(&self, _: usize, hit: &ExactHit) -> bool {
        self.geometry.opacity(&to_float_hit(hit)) >= OPACITY_THRESHOLD
    }
}
