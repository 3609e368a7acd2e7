//! A part of the tree that one thread builds while it lies in that core's cache.

use std::sync::PoisonError;

use super::binned::split;
use super::collapse::{Binary, children, collapse, emit};
use super::item::{Item, Octet, Range};
use super::{Leaves, Shared};
use crate::block::{Block, LEAF, Node};
use crate::dispatch::kernel;
use crate::simd::Isa;

/// What is to become a treelet.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub range: Range,
    /// How many items it has.
    pub count: usize,
    /// How many splits are above it.
    pub depth: usize,
}

/// A part of the tree, with references that count from its own start.
pub struct Treelet {
    pub blocks: Box<[Block]>,
    pub ids: Box<[u32]>,
    pub roots: Vec<Root>,
}

/// A child that a treelet gives the node above it.
#[derive(Clone, Copy)]
pub struct Root {
    pub bounds: Octet,
    pub reference: u32,
}

/// What a thread needs to build a treelet; kept from treelet to treelet, or most of the time would go into new pages.
#[derive(Default)]
pub struct Scratch<N> {
    tree: Vec<Binary>,
    /// Nodes to be split, their ranges and depths.
    open: Vec<(u32, u32, Range)>,
    notes: N,
    blocks: Vec<Block>,
    /// In the order of the leaves.
    ids: Vec<u32>,
    roots: Vec<Root>,
}

kernel! {
    /// [`treelet`].
    fn build_treelet[L: Leaves](items: &mut [Item], above: (&Part, usize), shared: &Shared<L>,
        scratch: &mut Scratch<L::Notes>) = treelet
}

impl Treelet {
    /// Builds the items of a part, which take at most so many places in the node above.
    pub fn build<L: Leaves>(
        items: &mut [Item],
        part: &Part,
        places: usize,
        shared: &Shared<L>,
    ) -> Treelet {
        // A thread that panicked has left nothing half done in what is idle.
        let lock = || shared.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = lock().pop().unwrap_or_default();
        build_treelet(shared.machine, items, (part, places), shared, &mut scratch);
        let treelet = Treelet {
            blocks: scratch.blocks.as_slice().into(),
            ids: scratch.ids.as_slice().into(),
            roots: scratch.roots.clone(),
        };
        lock().push(scratch);
        treelet
    }

    /// Moves every reference, so that blocks count from `base` on and ids from `first` on.
    pub fn relocate<L: Leaves>(&mut self, base: u32, first: u32) {
        let mut open = vec![];
        for root in &mut self.roots {
            open.push(root.reference);
            root.reference = moved::<L>(root.reference, base);
        }
        while let Some(at) = open.pop() {
            if at & LEAF != 0 {
                if L::IN_BLOCKS {
                    // SAFETY: references with `LEAF` lead to leaves where they lead to blocks.
                    unsafe { self.blocks[(at & !LEAF) as usize].leaf.first += first };
                }
                continue;
            }
            // SAFETY: references without `LEAF` lead to nodes.
            let node: &mut Node = unsafe { &mut self.blocks[at as usize].node };
            for child in &mut node.child[..node.children as usize] {
                open.push(*child);
                *child = moved::<L>(*child, base);
            }
        }
    }
}

/// A reference of a treelet whose blocks stand `base` further.
fn moved<L: Leaves>(child: u32, base: u32) -> u32 {
    if child & LEAF != 0 && !L::IN_BLOCKS {
        child
    } else {
        child + base
    }
}

/// Builds a treelet into `scratch`.
#[inline(always)]
fn treelet<I: Isa, L: Leaves>(
    items: &mut [Item],
    (part, places): (&Part, usize),
    shared: &Shared<L>,
    scratch: &mut Scratch<L::Notes>,
) {
    let leaves = shared.leaves;
    let Scratch {
        tree,
        open,
        notes,
        blocks,
        ids,
        roots,
    } = scratch;
    tree.clear();
    blocks.clear();
    ids.clear();
    roots.clear();
    let n = leaves.enter(items, notes);
    let range = if n == items.len() {
        part.range
    } else {
        Range::of::<I>(&items[..n])
    };
    let items = &mut items[..n];
    tree.push(Binary::leaf(range.bounds, 0, n as u32));
    open.push((0, part.depth as u32, range));
    while let Some((at, depth, range)) = open.pop() {
        let Binary { first, count, .. } = tree[at as usize];
        if count as usize <= leaves.binary_leaf() {
            continue;
        }
        let here = &mut items[first as usize..(first + count) as usize];
        let method = shared.method(count as usize);
        let (middle, left, right) = split::<I>(here, &range, depth as usize, method);
        let child = tree.len() as u32;
        tree[at as usize] = Binary::inner(range.bounds, child);
        (tree[at as usize].first, tree[at as usize].count) = (first, count);
        let middle = middle as u32;
        tree.push(Binary::leaf(left.bounds, first, middle));
        tree.push(Binary::leaf(right.bounds, first + middle, count - middle));
        open.push((child + 1, depth + 1, right));
        open.push((child, depth + 1, left));
    }
    let items = &*items;
    let below = |node: &Binary| &items[node.first as usize..(node.first + node.count) as usize];
    collapse::<I>(tree, |_| [1.0; 8], |node| leaves.fit(below(node), notes));
    for (at, _) in children(tree, 0, places, false) {
        let reference = emit(tree, at, blocks, &mut |node, blocks| {
            leaves.emit(below(node), notes, ids, blocks)
        });
        let bounds = tree[at].bounds;
        roots.push(Root { bounds, reference });
    }
}
