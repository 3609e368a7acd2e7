//! Interfaces between the builder, its primitives and its leaves.

use crate::aabb::Aabb;
use crate::build::prim_ref::PrimRef;
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;

/// About the most prims of a part that is built by one thread. Few under Miri, which is slow: it sees every path all the same.
pub const TREELET_SIZE: usize = if cfg!(miri) { 1 << 5 } else { 1 << 12 };

/// Items that are worth another thread.
pub const PARALLEL_THRESHOLD: usize = 4 * TREELET_SIZE;

/// Items of which a sample is enough to find the top of the tree.
pub const SAMPLING_THRESHOLD: usize = 8 * TREELET_SIZE;

/// What becomes of a few prims that the tree does not separate further.
pub trait LeafBuilder: Sync {
    /// What one thread notes of the prims of the treelet it builds.
    type Scratch: Default + Send;
    /// Looks at the prims of a treelet, which it may join and give other ids; how many are left.
    fn begin_treelet(&self, prims: &mut [PrimRef], notes: &mut Self::Scratch) -> usize;
    /// Whether the prims, which are few, are of one kind: leaves are not of several.
    fn same_geometry(&self, _items: &[PrimRef], _notes: &Self::Scratch) -> bool {
        true
    }
    /// Whether the prims fit into one leaf. A single prim always does.
    fn fits(&self, prims: &[PrimRef], notes: &mut Self::Scratch) -> bool;
    /// The child reference of a leaf of `prims`, whose ids go to `ids`. It may push blocks.
    fn create_leaf(
        &self,
        prims: &[PrimRef],
        notes: &mut Self::Scratch,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<NodeBlock>,
    ) -> NodeRef;
    /// Whether the reference [`LeafBuilder::create_leaf`] returns counts from the start of `blocks`, where a leaf stands that
    /// counts from the start of `ids`.
    const LEAVES_ARE_BLOCKS: bool;
    /// How many prims a leaf holds as a rule.
    const TYPICAL_LEAF_PRIMS: usize;
    /// The most prims in a binary leaf, which must fit into one leaf if they are alike. Splits aim at full ones.
    fn max_binary_leaf_prims(&self) -> usize;
    /// How many bins along an axis a range of prims is worth: 8 or 16, and above the treelets 64 or 256.
    fn bin_count(&self, prims: usize) -> usize;
    /// About how many blocks and ids there will be: room that is not needed is given back, and where it does not suffice
    /// all is copied.
    fn size_estimate(&self) -> (usize, usize) {
        (0, 0)
    }
    /// Of how many prims one is looked at to find the top of a large tree; `None`: it takes all of them.
    fn sample_stride(&self) -> Option<usize> {
        None
    }
}

/// A finished tree.
pub struct BuiltBvh {
    /// Nodes and leaves.
    pub blocks: HugePageVec<NodeBlock>,
    /// The reference of the root; [`NodeRef::EMPTY`] where there is nothing.
    pub root: NodeRef,
    /// PrimRef ids in the order of the leaves.
    pub ids: Vec<u32>,
    /// The box of everything.
    pub bounds: Aabb,
}

/// What all parts of a build share.
pub struct BuildContext<'a, L: LeafBuilder> {
    pub leaves: &'a L,
    pub dispatch: Dispatch,
}

/// What a tree is built over.
pub trait PrimSource: Sync {
    /// How many there are.
    fn count(&self) -> usize;
    /// The box of one.
    fn prim(&self, at: usize) -> PrimRef;

    /// The boxes of some, after those that are there.
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
