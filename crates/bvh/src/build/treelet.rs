//! Treelets: subtrees that one thread builds while they are in its core's cache.

use crate::build::collapse::{BinaryNode, collapse, emit_wide_nodes, select_children};
use crate::build::large_prims::split_large;
use crate::build::partition::split;
use crate::build::prim_ref::{PackedBounds, PrimInfo, PrimRef};
use crate::build::traits::{BuildContext, LeafBuilder, TREELET_SIZE};
use crate::node::{NodeBlock, NodeRef, WideNode};
use crate::platform::dispatch::kernel;
use crate::simd::Isa;

/// The description of a treelet before it is built.
#[derive(Clone, Copy, Debug)]
pub struct TreeletDesc {
    /// The treelet's bounds, exact or estimated.
    pub bounds: PackedBounds,
    /// The number of primitives in the treelet.
    pub count: usize,
    /// The number of splits above this treelet.
    pub depth: usize,
}

/// A treelet to build: primitives, description, and child slots in the node above.
pub struct TreeletJob<'a> {
    pub prims: TreeletPrims<'a>,
    pub desc: &'a TreeletDesc,
    pub child_slots: usize,
}

/// The primitives of a treelet: existing primitives, or a function that generates them.
pub enum TreeletPrims<'a> {
    Refs(&'a mut [PrimRef]),
    Deferred(&'a PrimGenerator<'a>),
}

/// Function that appends the primitives of a treelet to a vector.
pub type PrimGenerator<'a> = dyn Fn(&mut Vec<PrimRef>) + Send + Sync + 'a;

/// Child that a treelet gives to the node above it.
#[derive(Clone, Copy)]
pub struct SubtreeRoot {
    pub bounds: PackedBounds,
    pub reference: NodeRef,
}

/// A subtree whose references are relative to the subtree's start.
#[derive(Default)]
pub struct Treelet {
    pub blocks: Vec<NodeBlock>,
    /// Primitive ids in the order of the leaves.
    pub ids: Vec<u32>,
    roots: Vec<SubtreeRoot>,
}

/// Scratch memory of a thread, reused between treelets to avoid page faults.
#[derive(Default)]
pub struct Scratch<N> {
    /// Generated primitives.
    prims: Vec<PrimRef>,
    tree: Vec<BinaryNode>,
    /// Nodes to split: index, depth and bounds.
    open: Vec<(u32, u32, PrimInfo)>,
    leaf_scratch: N,
}

kernel! {
    /// [`build_generic`], compiled for each instruction set.
    fn build_treelet[L: LeafBuilder](prims: &mut [PrimRef], desc: &TreeletDesc, child_slots: usize,
        shared: &BuildContext<L>, scratch: &mut Scratch<L::Scratch>, treelet: &mut Treelet) = build_generic
}

impl Treelet {
    /// Builds a treelet in the memory of the previous treelet.
    pub fn build<L: LeafBuilder>(
        &mut self,
        job: TreeletJob,
        shared: &BuildContext<L>,
        scratch: &mut Scratch<L::Scratch>,
    ) {
        let TreeletJob { prims, desc, child_slots } = job;
        match prims {
            TreeletPrims::Refs(prims) => {
                build_treelet(shared.dispatch, prims, desc, child_slots, shared, scratch, self);
            }
            TreeletPrims::Deferred(make) => {
                let mut prims = std::mem::take(&mut scratch.prims);
                prims.clear();
                make(&mut prims);
                build_treelet(shared.dispatch, &mut prims, desc, child_slots, shared, scratch, self);
                scratch.prims = prims;
            }
        }
    }

    /// The roots after the indices of all blocks have increased by `base`.
    pub fn relocated_roots<L: LeafBuilder>(&self, [base, _]: [usize; 2]) -> Vec<SubtreeRoot> {
        let relocate = |root: &SubtreeRoot| SubtreeRoot { reference: relocated::<L>(root.reference, base), ..*root };
        self.roots.iter().map(relocate).collect()
    }

    /// Increases block indices by `base` and positions of ids by `first`, in every reference except the roots.
    pub fn relocate<L: LeafBuilder>(&mut self, [base, first]: [usize; 2]) {
        let mut open: Vec<_> = self.roots.iter().map(|root| root.reference).collect();
        while let Some(at) = open.pop() {
            if at.is_leaf() {
                if L::LEAVES_ARE_BLOCKS {
                    // SAFETY: the leaf references of this builder are block indices, so they refer to leaves.
                    unsafe { self.blocks[at.index()].leaf.first_prim += first as u32 };
                }
                continue;
            }
            // SAFETY: node references refer to nodes.
            let node: &mut WideNode = unsafe { &mut self.blocks[at.index()].node };
            for child in &mut node.children[..node.child_count as usize] {
                open.push(*child);
                *child = relocated::<L>(*child, base);
            }
        }
    }
}

/// The reference after the indices of the treelet's blocks have increased by `base`.
fn relocated<L: LeafBuilder>(child: NodeRef, base: usize) -> NodeRef {
    if child.is_leaf() && !L::LEAVES_ARE_BLOCKS { child } else { child.offset(base) }
}

/// Builds a treelet: binary SAH splits, then the collapse into wide nodes.
#[inline(always)]
fn build_generic<I: Isa, L: LeafBuilder>(
    prims: &mut [PrimRef],
    desc: &TreeletDesc,
    child_slots: usize,
    shared: &BuildContext<L>,
    scratch: &mut Scratch<L::Scratch>,
    treelet: &mut Treelet,
) {
    let leaves = shared.leaves;
    let Scratch { tree, open, leaf_scratch, .. } = scratch;
    let Treelet { blocks, ids, roots } = treelet;
    tree.clear();
    blocks.clear();
    ids.clear();
    roots.clear();
    let n = leaves.begin_treelet(prims, leaf_scratch);
    let prims = &mut prims[..n];
    let range = PrimInfo::from_prims::<I>(prims);
    tree.push(BinaryNode::leaf(range.bounds, 0, n as u32));
    open.push((0, desc.depth as u32, range));
    while let Some((at, depth, range)) = open.pop() {
        let BinaryNode { first, count, .. } = tree[at as usize];
        let here = &mut prims[first as usize..(first + count) as usize];
        let few = count as usize <= leaves.max_binary_leaf_prims();
        if count == 1 || few && leaves.same_geometry(here, leaf_scratch) {
            continue;
        }
        let bins = leaves.bin_count((count as usize).min(TREELET_SIZE));
        let leaf_size = leaves.max_binary_leaf_prims() as u32;
        // Primitives that are large compared with the whole mesh have already been split off. A cell or treelet may
        // contain primitives that are large compared with the cell or treelet.
        let large = match at {
            0 => split_large::<I>(here, &range, depth as usize),
            _ => None,
        };
        // A closure would be compiled without the instruction set of this function.
        let (middle, left, right) = match large {
            Some(parts) => parts,
            None => split::<I>(here, &range, depth as usize, bins, leaf_size),
        };
        let child = tree.len() as u32;
        tree[at as usize] = BinaryNode::inner(range.bounds, child);
        (tree[at as usize].first, tree[at as usize].count) = (first, count);
        let middle = middle as u32;
        tree.push(BinaryNode::leaf(left.bounds, first, middle));
        tree.push(BinaryNode::leaf(right.bounds, first + middle, count - middle));
        open.push((child + 1, depth + 1, right));
        open.push((child, depth + 1, left));
    }
    let prims = &*prims;
    let below = |node: &BinaryNode| &prims[node.first as usize..(node.first + node.count) as usize];
    collapse::<I>(tree, |_| [1.0; 8], |node| leaves.fits(below(node), leaf_scratch));
    let (found, n) = select_children(tree, 0, child_slots, false);
    for (at, _) in found.into_iter().take(n) {
        let reference = emit_wide_nodes(tree, at, blocks, |node, blocks| {
            leaves.create_leaf(below(node), leaf_scratch, ids, blocks)
        });
        let bounds = tree[at].bounds;
        roots.push(SubtreeRoot { bounds, reference });
    }
}
