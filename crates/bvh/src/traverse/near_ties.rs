//! Detection of float32 rays that hit two instances at nearly the same t. [`crate::traverse::exact::ties`] decides
//! which instance such a ray hits.

use crate::limits::MACHINE_EPSILON;
use crate::ray::{Hit, INVALID_ID, Ray};
use crate::scene::{InstanceRecord, Scene};
use crate::simd::{Isa, Vector};

/// Width of the range of t behind a hit in which other hits are also found: a fraction of t plus a fraction of the
/// scene's size. Both exceed the window of exact ties by the error of t.
const RELATIVE_WIDTH: f32 = 1024.0 * MACHINE_EPSILON;
const ABSOLUTE_WIDTH: f32 = 256.0 * MACHINE_EPSILON;

/// The end of the window behind a hit at `t`; `absolute` is the width at 0.
#[inline(always)]
pub fn widen(t: f32, absolute: f32) -> f32 {
    t + t * RELATIVE_WIDTH + absolute
}

/// [`widen`], lane by lane.
#[inline(always)]
pub fn widen_lanes<V: Vector>(t: V, absolute: V) -> V {
    t.mul(V::splat(1.0 + RELATIVE_WIDTH)).add(absolute)
}

impl Scene {
    /// The window's width at t = 0, times the length of the direction in scaled scene coordinates.
    #[inline(always)]
    pub(crate) fn near_tie_width(&self) -> f32 {
        self.max_abs_coord * ABSOLUTE_WIDTH
    }

    /// The window's width at t = 0, times the length of a direction in the coordinates of a mesh.
    #[inline(always)]
    pub(crate) fn near_tie_width_in(&self, instance: &InstanceRecord) -> f32 {
        // A component of a transformed direction is at most three times the largest component before the transform.
        self.near_tie_width() * instance.max_scale.max(1.0)
    }

    /// The window's width at t = 0 for a ray that is not scaled.
    #[inline(always)]
    pub(crate) fn outer_near_tie_width(&self, ray: &Ray) -> f32 {
        self.near_tie_width() / self.scale as f32 * t_per_length(ray)
    }

    /// Keeps the closer of two hits. True if they may be on coplanar surfaces of two instances.
    #[inline(always)]
    pub(crate) fn keep_closer(&self, known: &mut Hit, other: Hit, absolute: f32) -> bool {
        let (first, last) = if other.t < known.t { (other.t, known.t) } else { (known.t, other.t) };
        let is_near = last <= widen(widen(first, absolute), absolute) && last < f32::INFINITY;
        let is_tied = is_near && self.are_of_two_instances(known, &other);
        known.keep_closer(other);
        is_tied
    }

    /// True for hits of two instances.
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

/// One over the largest component of a direction: the factor that converts lengths to t.
#[inline(always)]
pub fn t_per_length(ray: &Ray) -> f32 {
    let [x, y, z] = ray.direction.map(f32::abs);
    let most = if x > y { x } else { y };
    1.0 / if most > z { most } else { z }
}

/// The range's width at t = 0 for rays with a given scale of z; see [`crate::traverse::packet::Packet::shear`].
#[inline(always)]
pub fn absolute_lanes<I: Isa>(width: f32, scale: I::RayVec) -> I::RayVec {
    scale.abs().mul(I::RayVec::splat(width))
}
