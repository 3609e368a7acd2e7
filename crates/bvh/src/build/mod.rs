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
pub(crate) mod traits;
mod treelet;
pub(crate) mod triangle_leaves;
pub(crate) mod triangle_pairs;

use crate::aabb::Aabb;
use crate::build::traits::{
    BuildContext, BuiltBvh, LeafBuilder, PrimSource, SAMPLING_THRESHOLD, TREELET_SIZE,
};
use rayon::prelude::*;

use crate::build::top_plan::{TopPlan, TreeletInput};
use crate::node::NodeRef;
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;

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
