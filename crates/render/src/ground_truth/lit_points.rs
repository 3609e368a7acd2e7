//! Surface points that a light at one point illuminates, by exact shadow rays.

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, INVALID_ID};

use crate::ground_truth::convert::to_float_hit;
use crate::prepare::geometry::Geometry;

/// Relative distance from both ends of a shadow ray within which surfaces do not occlude; larger than float64 rounding
/// errors.
const END_OFFSET: f64 = 1e-9;
/// Maximum number of shadowless surfaces that a shadow ray may pass; beyond this number, the point counts as
/// shadowed.
const MAX_PASSED: usize = 1000;

impl Geometry {
    /// True if a light at a scene-local position illuminates the hit of a camera ray: the light is on the camera's side
    /// of the triangle, and nothing that casts a shadow is between hit and light.
    pub(crate) fn is_lit_from(&self, ray: &ExactRay, hit: &ExactHit, light: DVec3) -> bool {
        let point = DVec3::from(ray.origin) + hit.t * DVec3::from(ray.direction);
        let towards = light + self.origin - point;
        let [a, b, c] = self.corners(hit.instance, hit.triangle);
        let normal = (b - a).cross(c - a);
        let is_same_side = (normal.dot(towards) > 0.0) != (normal.dot(DVec3::from(ray.direction)) > 0.0);
        is_same_side && !self.is_shadowed(point, towards)
    }

    /// True if a surface that casts a shadow is between the points `point` and `point + towards`.
    fn is_shadowed(&self, point: DVec3, towards: DVec3) -> bool {
        let mut begin = END_OFFSET;
        for _ in 0..MAX_PASSED {
            let ray = ExactRay {
                origin: point.to_array(),
                direction: towards.to_array(),
                t_min: begin,
                t_max: 1.0 - END_OFFSET,
            };
            let mut hits = [ExactHit::MISS];
            self.closest_exact(&[ray], &mut hits);
            let [hit] = hits;
            if hit.instance == INVALID_ID {
                return false;
            }
            let has_shadow = self.ray_visibility(hit.instance).shadow && self.opacity(&to_float_hit(&hit)) > 0.0;
            if has_shadow {
                return true;
            }
            begin = hit.t * (1.0 + END_OFFSET) + f64::MIN_POSITIVE;
        }
        true
    }
}
