//! Interfaces between the builder, its primitives and its leaves.

use crate::aabb::Aabb;
use crate::build::prim_ref::PrimRef;
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;

/// Approximate maximum number of primitives that one thread builds at a time, chosen for the L2 cache. The number is
/// small under Miri, which is slow.
pub const TREELET_SIZE: usize = if cfg!(miri) { 1 << 5 } else { 1 << 12 };

/// Minimum number of primitives per additional thread.
pub const PARALLEL_THRESHOLD: usize = 4 * TREELET_SIZE;

/// Number of primitives above which a sample determines the top of the tree.
pub const SAMPLING_THRESHOLD: usize = 8 * TREELET_SIZE;

/// Turns small groups of primitives into leaves.
pub trait LeafBuilder: Sync {
    /// Scratch memory of one thread for one treelet.
    type Scratch: Default + Send;
    /// Prepares a treelet. Merges and renumbers primitives if possible; returns the number of remaining primitives.
    fn begin_treelet(&self, prims: &mut [PrimRef], scratch: &mut Self::Scratch) -> usize;
    /// True if the given primitives, which are few, belong to one mesh; a leaf contains primitives of one mesh only.
    fn same_geometry(&self, _items: &[PrimRef], _scratch: &Self::Scratch) -> bool {
        true
    }
    /// True if the primitives fit into one leaf. A single primitive always fits.
    fn fits(&self, prims: &[PrimRef], scratch: &mut Self::Scratch) -> bool;
    /// Creates a leaf of `prims` and appends their ids to `ids`; returns the leaf's reference. May append blocks.
    fn create_leaf(
        &self,
        prims: &[PrimRef],
        scratch: &mut Self::Scratch,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<NodeBlock>,
    ) -> NodeRef;
    /// True if leaf references are indices into `blocks`, whose leaves refer to `ids`.
    const LEAVES_ARE_BLOCKS: bool;
    /// The typical number of primitives in a leaf.
    const TYPICAL_LEAF_PRIMS: usize;
    /// Maximum number of primitives in a leaf of the binary tree, which must fit into one leaf of the wide tree. Splits
    /// are chosen so that leaves are full.
    fn max_binary_leaf_prims(&self) -> usize;
    /// Number of bins per axis for a split of this number of primitives: 8 or 16 within treelets, 64 or 256 above them.
    fn bin_count(&self, prims: usize) -> usize;
    /// Estimated numbers of blocks and ids, for which memory is reserved. Excess memory is released; if the reserved
    /// memory is too small, the data is copied once more.
    fn size_estimate(&self) -> (usize, usize) {
        (0, 0)
    }
    /// One in this many primitives is sampled for the top of a large tree; `None` disables sampling.
    fn sample_stride(&self) -> Option<usize> {
        None
    }
}

/// A finished tree.
pub struct BuiltBvh {
    /// Nodes and leaves.
    pub blocks: HugePageVec<NodeBlock>,
    /// The root; [`NodeRef::EMPTY`] for an empty tree.
    pub root: NodeRef,
    /// Primitive ids in the order of the leaves.
    pub ids: Vec<u32>,
    /// The bounds of all primitives.
    pub bounds: Aabb,
}

/// The context that all tasks of a build share.
pub struct BuildContext<'a, L: LeafBuilder> {
    pub leaves: &'a L,
    pub dispatch: Dispatch,
}

/// The primitives of a build.
pub trait PrimSource: Sync {
    /// The number of primitives.
    fn count(&self) -> usize;
    /// Returns the primitive with index `at`.
    fn prim(&self, at: usize) -> PrimRef;

    /// Appends the primitives with these ids to `prims`.
    fn prims(&self, ids: &[u32], prims: &mut Vec<PrimRef>) {
        prims.extend(ids.iter().map(|&id| self.prim(id as usize)));
    }
}

impl PrimSource for [PrimRef] {
    fn count(&self) -> usize {
        self.len()
    }

    fn prim(&self, at: usize) -> PrimRef {
        self[at]
    }
}
