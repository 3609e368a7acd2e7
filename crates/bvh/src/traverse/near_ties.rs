//! Detection of float32 rays that hit two instances at nearly the same t. [`crate::traverse::exact::ties`] decides
//! which instance such a ray hits.

use crate::limits::MACHINE_EPSILON;
use crate::ray::{Hit, INVALID_ID, Ray};
use crate::scene::{InstanceRecord, Scene};
use crate::simd::{Isa, Vector};

/// Width of the range of t behind a hit in which the traversal also finds other hits: a fraction of t plus a fraction
/// of the scene's size. The range is wider than the window of exact ties by the error of t.
const RELATIVE_WIDTH: f32 = 1024.0 * MACHINE_EPSILON;
const ABSOLUTE_WIDTH: f32 = 256.0 * MACHINE_EPSILON;

/// The end of the range behind a hit at `t`; `absolute` is the range's width at t = 0.
#[inline(always)]
pub fn widen(t: f32, absolute: f32) -> f32 {
    t + t * RELATIVE_WIDTH + absolute
}

/// Same as [`widen`], lane by lane.
#[inline(always)]
pub fn widen_lanes<V: Vector>(t: V, absolute: V) -> V {
    t.mul(V::splat(1.0 + RELATIVE_WIDTH)).add(absolute)
}

impl Scene {
    /// The range's width at t = 0, as a length in scaled scene coordinates.
    #[inline(always)]
    pub(crate) fn near_tie_width(&self) -> f32 {
        self.max_abs_coord * ABSOLUTE_WIDTH
    }

    /// The range's width at t = 0, as a length in the coordinates of a mesh.
    #[inline(always)]
    pub(crate) fn near_tie_width_in(&self, instance: &InstanceRecord) -> f32 {
        // A component of a transformed direction is at most three times the largest component before the transform.
        self.near_tie_width() * instance.max_scale.max(1.0)
    }

    /// The range's width at t = 0, as a t along a ray in scene coordinates that are not scaled.
    #[inline(always)]
    pub(crate) fn outer_near_tie_width(&self, ray: &Ray) -> f32 {
        self.near_tie_width() / self.scale as f32 * t_per_length(ray)
    }

    /// Keeps the closer of two hits. Returns true if the hits may be on coplanar surfaces of two instances.
    #[inline(always)]
    pub(crate) fn keep_closer(&self, known: &mut Hit, other: Hit, absolute: f32) -> bool {
        let (first, last) = if other.t < known.t { (other.t, known.t) } else { (known.t, other.t) };
        let is_near = last <= widen(widen(first, absolute), absolute) && last < f32::INFINITY;
        let is_tied = is_near && self.are_of_two_instances(known, &other);
        known.keep_closer(other);
        is_tied
    }

    /// True if two hits are on different instances.
    #[cold]
    #[inline(never)]
    fn are_of_two_instances(&self, a: &Hit, b: &Hit) -> bool {
        let instance = |hit: &Hit| match &self.mesh_ranges {
            Some(ranges) => ranges.locate(hit.triangle).0,
            None => hit.instance,
        };
        a.instance != INVALID_ID && b.instance != INVALID_ID && instance(a) != instance(b)
    }
}

/// The reciprocal of the direction's largest absolute component: the factor that converts lengths to t.
#[inline(always)]
pub fn t_per_length(ray: &Ray) -> f32 {
    let [x, y, z] = ray.direction.map(f32::abs);
    let most = if x > y { x } else { y };
    1.0 / if most > z { most } else { z }
}

/// The range's width at t = 0, as a t, for rays with these scales of z; see [`crate::traverse::packet::Packet::shear`].
#[inline(always)]
pub fn absolute_lanes<I: Isa>(width: f32, scale: I::RayVec) -> I::RayVec {
    scale.abs().mul(I::RayVec::splat(width))
}
