//! The BLAS: a BVH over one mesh. This file defines the data; the modules `build`, `refit` and `bounding_boxes`
//! implement the BLAS. The builder is in `crate::build`.

pub(crate) mod bounding_boxes;
pub(crate) mod build;
pub(crate) mod refit;

use crate::aabb::Aabb;
use crate::node::{NodeBlock, NodeRef};
use crate::platform::huge_page_vec::HugePageVec;
use crate::simd::Isa;

/// A bottom-level BVH (BLAS) over one mesh, in mesh-local float32 coordinates.
#[derive(Clone)]
pub struct Bvh {
    blocks: HugePageVec<NodeBlock>,
    root: NodeRef,
    prim_ids: Vec<u32>,
    bounds: Aabb,
    scale: f32,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Bvh of {} triangles in {} blocks", self.prim_ids.len(), self.blocks.len())
    }
}

impl Bvh {
    /// The number of triangles of the mesh.
    pub fn triangle_count(&self) -> usize {
        self.prim_ids.len()
    }

    /// Power of two by which mesh coordinates are multiplied in the tree.
    pub(crate) fn scale(&self) -> f32 {
        self.scale
    }

    /// The bounds of all triangles, in tree coordinates.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// The largest absolute coordinate in the tree.
    pub(crate) fn max_abs_coord(&self) -> f32 {
        self.bounds.max_abs_coord()
    }

    pub(crate) fn root(&self) -> NodeRef {
        self.root
    }

    /// Borrows the parts of the tree: the root, the primitive ids in the order of the leaves, and all blocks.
    pub(crate) fn split_mut(&mut self) -> (NodeRef, &[u32], &mut [NodeBlock]) {
        (self.root, &self.prim_ids, &mut self.blocks)
    }

    pub(crate) fn set_bounds(&mut self, bounds: Aabb) {
        self.bounds = bounds;
    }

    pub(crate) fn blocks(&self) -> &[NodeBlock] {
        &self.blocks
    }

    /// Prefetches the id that [`Bvh::prim_id`] returns for `slot`.
    #[inline(always)]
    pub(crate) fn prefetch_prim_id<I: Isa>(&self, slot: u32) {
        I::prefetch(self.prim_ids.as_ptr().wrapping_add(slot as usize).cast());
    }

    /// Returns the id of the triangle at position `slot` in the order of the leaves.
    #[inline(always)]
    pub(crate) fn prim_id(&self, slot: u32) -> u32 {
        debug_assert!((slot as usize) < self.prim_ids.len());
        // SAFETY: positions come from the leaves of this tree, whose triangles all have an id.
        unsafe { *self.prim_ids.get_unchecked(slot as usize) }
    }
}
