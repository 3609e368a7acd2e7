//! The closest hit of a single ray in a mesh, and its any-hit test.

use crate::blas::Bvh;
use crate::node::LeafNode;
use crate::scene::instance_ranges::InstanceRanges;
use crate::traverse::near_ties::widen;
use crate::traverse::triangle::single::{RayView, TriangleIntersection, intersect_triangle};

/// The closest hit so far, with t along the local ray.
#[derive(Clone, Copy, Debug)]
pub struct ClosestHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    /// Position in the primitive ids of the mesh, or [`NO_PRIM`].
    pub prim_index: u32,
    /// The largest t at which triangles are of interest: `t`, or the end of the range behind the hit in which
    /// [`crate::traverse::near_ties`] searches.
    pub limit: f32,
}

/// The primitive index of a miss.
pub const NO_PRIM: u32 = u32::MAX;

impl ClosestHit {
    /// Creates a miss: no hit at a t of up to `t_max`.
    #[inline(always)]
    pub fn miss(t_max: f32) -> ClosestHit {
        ClosestHit { t: t_max, u: 0.0, v: 0.0, prim_index: NO_PRIM, limit: t_max }
    }

    /// Intersects the triangles `candidates` of a leaf; keeps the first hit by (t, id). Returns true if the hit
    /// changed. Sets `ties.contested` if triangles of two instances are at nearly the same t.
    #[inline(always)]
    pub fn update(
        &mut self,
        mesh: &Bvh,
        leaf: &LeafNode,
        mut candidates: u32,
        ray: impl RayView,
        ties: &mut MeshTies,
    ) -> bool {
        let mut closer = false;
        let absolute = ties.width * ray.shear(2).abs();
        while candidates != 0 {
            let lane = candidates.trailing_zeros();
            candidates &= candidates - 1;
            let Some(TriangleIntersection { t, u, v }) = intersect_triangle(leaf, lane as usize, ray, self.limit)
            else {
                continue;
            };
            let prim_index = leaf.first_prim + lane;
            let limit = widen(t, absolute);
            if widen(limit, absolute) < self.limit || self.is_after(mesh, t, prim_index, ties) {
                *self = ClosestHit { t, u, v, prim_index, limit };
                closer = true;
            }
        }
        closer
    }

    /// True if a triangle at nearly the same t precedes the hit by (t, id), or if there is no hit.
    #[cold]
    #[inline(never)]
    fn is_after(&self, mesh: &Bvh, t: f32, prim_index: u32, ties: &mut MeshTies) -> bool {
        if self.prim_index == NO_PRIM {
            return true;
        }
        let (found, known) = (mesh.prim_id(prim_index), mesh.prim_id(self.prim_index));
        if let Some(ranges) = ties.ranges {
            ties.contested |= ranges.locate(found).0 != ranges.locate(known).0;
        }
        (t, found) < (self.t, known)
    }
}

/// Detection of near ties of a ray in a mesh.
#[derive(Clone, Copy)]
pub struct MeshTies<'a> {
    /// The instances of a flattened scene; otherwise `None`.
    pub ranges: Option<&'a InstanceRanges>,
    /// Width at t = 0, as a length, of the range of t in which [`crate::traverse::near_ties`] searches.
    pub width: f32,
    /// True if the ray may have hit coplanar surfaces of two instances.
    pub contested: bool,
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
