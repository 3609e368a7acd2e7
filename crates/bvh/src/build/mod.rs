//! From boxes to blocks: a binary tree by the surface-area heuristic, folded into eight-wide nodes.
//!
//! What is about as large as all together is split off first ([`large`]).
//! The tree is cut into treelets of about [`TREELET_SIZE`] prims, which depends on the prims alone. Above them boxes are
//! binned in parallel ([`top`]), of large trees those of a sample ([`sample`]); that part is folded first, for an
//! expected cost of what is below ([`plan`]). Each treelet is then built and folded by one thread while it lies in that
//! core's cache ([`treelet`]).

pub(crate) mod binned_sah;
mod collapse;
pub(crate) mod concat;
pub(crate) mod kd_sample;
pub(crate) mod large_prims;
pub(crate) mod parallel_split;
mod partition;
pub(crate) mod prim_ref;
#[cfg(test)]
mod tests;
pub(crate) mod top_plan;
mod treelet;
pub(crate) mod triangle_leaves;
pub(crate) mod triangle_pair;
pub(crate) mod triangle_pairs;

use rayon::prelude::*;

use crate::build::top_plan::{TopPlan, TreeletInput};
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;

pub use crate::aabb::Aabb;
pub use crate::build::kd_sample::PrimSource;
use crate::build::prim_ref::PrimRef;

/// About the most prims of a part that is built by one thread. Few under Miri, which is slow: it sees every path all the same.
pub const TREELET_SIZE: usize = if cfg!(miri) { 1 << 5 } else { 1 << 12 };

/// Items that are worth another thread.
const PARALLEL_THRESHOLD: usize = 4 * TREELET_SIZE;

/// Items of which a sample is enough to find the top of the tree.
const SAMPLING_THRESHOLD: usize = 8 * TREELET_SIZE;

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
    leaves: &'a L,
    dispatch: Dispatch,
}

/// Builds over the prims of `source`, with the instruction set of `dispatch`: every one gives the same tree.
pub fn build<L: LeafBuilder, S: PrimSource + ?Sized>(
    dispatch: Dispatch,
    source: &S,
    leaves: &L,
) -> BuiltBvh {
    let shared = BuildContext { leaves, dispatch };
    let count = source.count();
    let (top, inputs) = match leaves.sample_stride() {
        Some(rate) if count > SAMPLING_THRESHOLD => {
            kd_sample::build_sampled_top(source, rate, &shared)
        }
        _ if count == 0 => (None, vec![]),
        _ => {
            let made = (0..count).into_par_iter().with_min_len(TREELET_SIZE);
            let mut prims: Vec<_> = made.map(|at| source.prim(at)).collect();
            let whole = parallel_split::prim_info(dispatch, &prims);
            let top = parallel_split::split_to_treelets(&mut prims, whole, 0, &shared);
            (Some(top), vec![TreeletInput::Prims(prims)])
        }
    };
    let Some(top) = top else {
        return BuiltBvh {
            blocks: HugePageVec::with_capacity(0),
            root: NodeRef::EMPTY,
            ids: vec![],
            bounds: Aabb::ORIGIN,
        };
    };
    TopPlan::new(top, L::TYPICAL_LEAF_PRIMS).build_tree(inputs, &shared)
}
