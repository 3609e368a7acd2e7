//! From boxes to blocks: a binary tree by the surface-area heuristic, folded into eight-wide nodes.
//!
//! What is about as large as all together is split off first ([`large`]).
//! The tree is cut into treelets of about [`TREELET`] items, which depends on the items alone. Above them boxes are
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

use crate::build::prim_ref::Item;
use crate::build::top_plan::{Plan, Stock};
use crate::node::{NodeBlock, LEAF, NO_CHILD};
use crate::platform::dispatch::Machine;
use crate::platform::huge_page_vec::Pages;

pub use crate::build::kd_sample::Source;
pub use crate::build::prim_ref::Item as BuildItem;

/// About the most items of a part that is built by one thread. Few under Miri, which is slow: it sees every path all the same.
pub const TREELET: usize = if cfg!(miri) { 1 << 5 } else { 1 << 12 };

/// Items that are worth another thread.
const PARALLEL: usize = 4 * TREELET;

/// Items of which a sample is enough to find the top of the tree.
const MANY: usize = 8 * TREELET;

/// No path from the root is longer, in binary splits and therefore in nodes: where the heuristic would dig deeper,
/// the items are halved. It bounds the stack of every traversal.
pub const MAX_DEPTH: usize = 56;

/// What becomes of a few items that the tree does not separate further.
pub trait Leaves: Sync {
    /// What one thread notes of the items of the treelet it builds.
    type Notes: Default + Send;
    /// Looks at the items of a treelet, which it may join and give other ids; how many are left.
    fn enter(&self, items: &mut [Item], notes: &mut Self::Notes) -> usize;
    /// Whether the items, which are few, are of one kind: leaves are not of several.
    fn alike(&self, _items: &[Item], _notes: &Self::Notes) -> bool {
        true
    }
    /// Whether the items fit into one leaf. A single item always does.
    fn fit(&self, items: &[Item], notes: &mut Self::Notes) -> bool;
    /// The child reference of a leaf of `items`, whose ids go to `ids`. It may push blocks.
    fn emit(
        &self,
        items: &[Item],
        notes: &mut Self::Notes,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<NodeBlock>,
    ) -> u32;
    /// Whether the reference [`Leaves::emit`] returns counts from the start of `blocks`, where a leaf stands that
    /// counts from the start of `ids`.
    const IN_BLOCKS: bool;
    /// How many items a leaf holds as a rule.
    const USUAL: usize;
    /// The most items in a binary leaf, which must fit into one leaf if they are alike. Splits aim at full ones.
    fn binary_leaf(&self) -> usize;
    /// How many bins along an axis a range of items is worth: 8, 16 or 32, and above the treelets 64 or 256.
    fn bins(&self, items: usize) -> usize;
    /// Whether treelets are split across the widest axis only.
    fn widest(&self) -> bool {
        false
    }
    /// About how many blocks and ids there will be: room that is not needed is given back, and where it does not suffice
    /// all is copied.
    fn expected(&self) -> (usize, usize) {
        (0, 0)
    }
    /// Of how many items one is looked at to find the top of a large tree; `None`: it takes all of them.
    fn sample(&self) -> Option<usize> {
        None
    }
}

/// A finished tree.
pub struct Tree {
    /// Nodes and leaves.
    pub blocks: Pages<NodeBlock>,
    /// The reference of the root; [`NO_CHILD`] where there is nothing.
    pub root: u32,
    /// Item ids in the order of the leaves.
    pub ids: Vec<u32>,
    /// The box of everything.
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}

/// What all parts of a build share.
pub struct Shared<'a, L: Leaves> {
    leaves: &'a L,
    machine: Machine,
}

/// Builds over the items of `source`, with the instruction set of `machine`: every one gives the same tree.
pub fn build<L: Leaves, S: Source + ?Sized>(machine: Machine, source: &S, leaves: &L) -> Tree {
    let shared = Shared { leaves, machine };
    let count = source.count();
    let (top, stocks) = match leaves.sample() {
        Some(rate) if count > MANY => kd_sample::divide(source, rate, &shared),
        _ if count == 0 => (None, vec![]),
        _ => {
            let made = (0..count).into_par_iter().with_min_len(TREELET);
            let mut items: Vec<_> = made.map(|at| source.item(at)).collect();
            let whole = parallel_split::range(machine, &items);
            let top = parallel_split::divide(&mut items, whole, 0, &shared);
            (Some(top), vec![Stock::Items(items)])
        }
    };
    let Some(top) = top else {
        return Tree {
            blocks: Pages::with_capacity(0),
            root: NO_CHILD,
            ids: vec![],
            lower: [0.0; 3],
            upper: [0.0; 3],
        };
    };
    Plan::of(top, L::USUAL).tree(stocks, &shared)
}
