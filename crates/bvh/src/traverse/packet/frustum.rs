//! Frustum of a packet: rays that start or end near one point, bounded by intervals (A. Reshetov, A. Soupikov and J.
//! Hurley, "Multi-Level Ray Tracing Algorithm", 2005). One box test applies to all rays.

use crate::node::WideNode;
use crate::ray::Ray;
use crate::simd::{Isa, Vector};

/// Interval bounds of all rays of a packet; t is measured from the apex.
#[derive(Clone, Copy)]
pub struct Frustum {
    pub apex: [f32; 3],
    /// For each axis, the smallest and the largest reciprocal of the rays' direction components.
    pub reciprocal: [[f32; 2]; 3],
    /// Padding of the t at which boxes are entered and left, because rays are rounded and do not start exactly at the
    /// apex.
    pub t_near_pad: [f32; 3],
    pub t_far_pad: [f32; 3],
    pub near_rows: [usize; 3],
}

impl Frustum {
    /// The children that some ray may enter at a t up to `t_max`, and the earliest t of entry.
    #[inline(always)]
    pub fn intersect_children<I: Isa>(&self, node: &WideNode, t_max: f32) -> (u32, I::F32x8) {
        let mut enter = I::F32x8::splat(0.0);
        let mut leave = I::F32x8::splat(t_max);
        for axis in 0..3 {
            // SAFETY: `near_rows` contains, for each axis, one of the six rows of 8 floats; the lowest bit selects the
            // lower or the upper bounds.
            let (first, last) = unsafe {
                let row = self.near_rows[axis];
                (
                    I::F32x8::load(node.bounds.get_unchecked(row).as_ptr()),
                    I::F32x8::load(node.bounds.get_unchecked(row ^ 1).as_ptr()),
                )
            };
            let apex = I::F32x8::splat(self.apex[axis]);
            let (low, high) = (I::F32x8::splat(self.reciprocal[axis][0]), I::F32x8::splat(self.reciprocal[axis][1]));
            let (first, last) = (first.sub(apex), last.sub(apex));
            enter = enter.max(first.mul(low).min(first.mul(high)).sub(I::F32x8::splat(self.t_near_pad[axis])));
            leave = leave.min(last.mul(low).max(last.mul(high)).add(I::F32x8::splat(self.t_far_pad[axis])));
        }
        (<I::F32x8 as Vector>::to_bitmask(enter.le(leave)), enter)
    }
}

/// The apex of a packet's frustum.
#[derive(Clone, Copy, PartialEq)]
pub enum Apex {
    /// The rays start at one point, or close to one point.
    Origin,
    /// The rays end at one point, from which t is measured backwards. Only any-hit queries use this apex.
    Target,
}

impl Apex {
    /// Selects the end at which the rays are closer together, judging by three rays.
    #[inline(always)]
    pub fn choose(rays: &[Ray]) -> Apex {
        let (mut starts, mut ends) = (0.0, 0.0);
        let first = &rays[0];
        for ray in [&rays[rays.len() / 2], &rays[rays.len() - 1]] {
            for a in 0..3 {
                let (p, q) = (ray.origin[a], first.origin[a]);
                starts += (p - q).abs();
                ends += ((p + ray.direction[a] * ray.t_max) - (q + first.direction[a] * first.t_max)).abs();
            }
        }
        if ends < starts { Apex::Target } else { Apex::Origin }
    }
}
