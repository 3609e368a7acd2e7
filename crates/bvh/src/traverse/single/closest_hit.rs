//! The closest hit of a single ray in a mesh, and its any-hit test.

use crate::blas::Bvh;
use crate::node::LeafNode;
use crate::traverse::triangle::single::{RayView, TriangleIntersection, intersect_triangle};

/// The closest hit so far, with t along the local ray.
#[derive(Clone, Copy, Debug)]
pub struct ClosestHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    /// Position in the primitive ids of the mesh, or [`NO_PRIM`].
    pub prim_index: u32,
}

/// The primitive index of a miss.
pub const NO_PRIM: u32 = u32::MAX;

impl ClosestHit {
    /// A miss up to `t_max`.
    #[inline(always)]
    pub fn miss(t_max: f32) -> ClosestHit {
        ClosestHit { t: t_max, u: 0.0, v: 0.0, prim_index: NO_PRIM }
    }

    /// Intersects the triangles `candidates` of a leaf; keeps the first by (t, id). True if the hit changed.
    #[inline(always)]
    pub fn update(&mut self, mesh: &Bvh, leaf: &LeafNode, mut candidates: u32, ray: impl RayView) -> bool {
        let mut closer = false;
        while candidates != 0 {
            let lane = candidates.trailing_zeros();
            candidates &= candidates - 1;
            let Some(TriangleIntersection { t, u, v }) = intersect_triangle(leaf, lane as usize, ray, self.t) else {
                continue;
            };
            let prim_index = leaf.first_prim + lane;
            if t < self.t || self.prim_index == NO_PRIM || mesh.prim_id(prim_index) < mesh.prim_id(self.prim_index) {
                *self = ClosestHit { t, u, v, prim_index };
                closer = true;
            }
        }
        closer
    }
}

/// True if the ray hits any of the triangles `candidates` of a leaf.
#[inline(always)]
pub fn any_hit(leaf: &LeafNode, mut candidates: u32, ray: impl RayView, t_max: f32) -> bool {
    while candidates != 0 {
        let lane = candidates.trailing_zeros() as usize;
        candidates &= candidates - 1;
        if intersect_triangle(leaf, lane, ray, t_max).is_some() {
            return true;
        }
    }
    false
}
