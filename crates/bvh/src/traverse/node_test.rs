//! The ray-node test (slabs of eight AABBs), and the setup of rays for TLAS and BLAS.

use crate::node::{NodeBlock, NodeRef, WideNode};
use crate::ray::Ray;
use crate::scene::{InstanceRecord, Scene};
use crate::simd::{Isa, Vector};
use crate::traverse::trav_ray::{BOUNDS_ROW, SlabPlanes, TravRay};

/// The children of a node whose boxes the ray enters no later than `t_max`, and the t at which it enters each.
#[inline(always)]
pub fn intersect_children<I: Isa>(
    node: &WideNode,
    ray: &TravRay,
    t_max: f32,
) -> (<I::F32x8 as Vector>::Mask, I::F32x8) {
    let [x, y, z, _] = ray.near_rows;
    let enter = t_at::<I>(node, &ray.near, 0, x);
    let enter = enter.max(t_at::<I>(node, &ray.near, 1, y));
    let t_enter = enter.max(t_at::<I>(node, &ray.near, 2, z)).max(I::F32x8::splat(0.0));
    let leave = t_at::<I>(node, &ray.far, 0, x ^ BOUNDS_ROW);
    let leave = leave.min(t_at::<I>(node, &ray.far, 1, y ^ BOUNDS_ROW));
    let t_leave = leave.min(t_at::<I>(node, &ray.far, 2, z ^ BOUNDS_ROW)).min(I::F32x8::splat(t_max));
    (t_enter.le(t_leave), t_enter)
}

/// The t at which a ray crosses the planes in a row of bounds; `row` is the index of the row's first float.
#[inline(always)]
fn t_at<I: Isa>(node: &WideNode, side: &SlabPlanes, axis: usize, row: u32) -> I::F32x8 {
    debug_assert!(row.is_multiple_of(BOUNDS_ROW) && row < 6 * BOUNDS_ROW);
    // SAFETY: `row` is the index of the first float of one of the six rows of 8 floats; one bit of it selects the lower
    // or the upper bounds along an axis.
    let bound = unsafe { I::F32x8::load(node.bounds.as_ptr().cast::<f32>().add(row as usize)) };
    bound.mul_sub(I::F32x8::splat(side.reciprocal[axis]), I::F32x8::splat(side.offset[axis]))
}

/// Prefetches a block.
#[inline(always)]
pub fn prefetch_block<I: Isa>(blocks: &[NodeBlock], at: NodeRef) {
    let start = blocks.as_ptr().wrapping_add(at.index()).cast::<u8>();
    for line in 0..4 {
        I::prefetch(start.wrapping_add(64 * line));
    }
}

/// Sets up a ray of the scene in tree coordinates of an instance, as [`TravRay::setup`] does.
#[inline(always)]
pub fn setup_instance_ray(local: &mut TravRay, scene: &Scene, instance: &InstanceRecord, ray: &Ray) -> bool {
    let scale = scene.scale as f32;
    let scaled = Ray { origin: ray.origin.map(|x| x * scale), direction: ray.direction.map(|x| x * scale), ..*ray };
    let Ray { origin, direction, .. } = instance.ray_to_mesh(&scaled);
    local.setup(origin, direction, instance.bvh.bounds(), 0.0)
}

impl Scene {
    /// Sets up a ray for the TLAS, or for the only BLAS of a single-level scene, as `TravRay::setup` does.
    #[inline(always)]
    pub fn setup_ray(&self, outer: &mut TravRay, ray: &Ray) -> bool {
        let scale = self.scale as f32;
        let (mut o, mut d) = (ray.origin, ray.direction);
        if scale != 1.0 {
            (o, d) = (o.map(|x| x * scale), d.map(|x| x * scale));
        }
        let padding = if self.is_single_mesh {
            0.0
        } else {
            let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
            self.relative_padding(self.is_within_reach(o)) * (distance + self.max_abs_coord)
        };
        outer.setup(o, d, &self.bounds, padding)
    }
}
