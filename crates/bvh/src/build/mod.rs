//! The builder: from primitives to a wide BVH with eight children per node.
//!
//! 1. Large primitives, such as a floor, are split off ([`large_prims`]).
//! 2. The top of the tree is split by all threads with the binned surface area heuristic (SAH; Wald 2007) of 64 or 256
//!    bins ([`parallel_split`], [`binned_sah`]); for a large mesh from a sample, as a k-d tree over centroids
//!    ([`kd_sample`]). Its leaves are treelets of about [`traits::TREELET_SIZE`] primitives.
//! 3. The wide nodes of the top are planned from the expected costs of the treelets ([`top_plan`]).
//! 4. One thread builds each treelet while it is in the cache of its core ([`treelet`]): triangles are paired
//!    ([`triangle_pairs`]), split by binned SAH and partitioned in place ([`partition`]), collapsed into wide nodes at
//!    the least cost (Ylitie, Karras and Laine 2017; [`collapse`]), and written as leaves with shared vertices
//!    ([`triangle_leaves`]).
//! 5. Treelets are concatenated in order ([`mod@concat`]).
//!
//! [`traits`] is the interface to primitives and leaves. The tree depends only on the primitives, not on threads or the
//! instruction set.

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
pub(crate) mod traits;
mod treelet;
pub(crate) mod triangle_leaves;
pub(crate) mod triangle_pairs;

use crate::aabb::Aabb;
use crate::build::traits::{BuildContext, BuiltBvh, LeafBuilder, PrimSource, SAMPLING_THRESHOLD, TREELET_SIZE};
use rayon::prelude::*;

use crate::build::top_plan::{TopPlan, TreeletInput};
use crate::node::NodeRef;
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;

/// Builds over the primitives of `source`, with the instruction set of `dispatch`; every instruction set gives the same
/// tree.
pub fn build<L: LeafBuilder, S: PrimSource + ?Sized>(dispatch: Dispatch, source: &S, leaves: &L) -> BuiltBvh {
    let shared = BuildContext { leaves, dispatch };
    let count = source.count();
    let (top, inputs) = match leaves.sample_stride() {
        Some(rate) if count > SAMPLING_THRESHOLD => kd_sample::build_sampled_top(source, rate, &shared),
        _ if count == 0 => (None, vec![]),
        _ => {
            // A build of a few primitives never uses rayon, because the caller may not be in a pool.
            let mut prims: Vec<_> = match count <= TREELET_SIZE {
                true => (0..count).map(|at| source.prim(at)).collect(),
                false => (0..count).into_par_iter().with_min_len(TREELET_SIZE).map(|at| source.prim(at)).collect(),
            };
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
