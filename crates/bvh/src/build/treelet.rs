//! A part of the tree that one thread builds while it lies in that core's cache.

use super::collapse::{Binary, children, collapse, emit};
use super::{Leaves, Shared, TREELET};
use crate::build::binned_sah::split;
use crate::build::large_prims::split_off;
use crate::build::prim_ref::{Item, Octet, Range};
use crate::node::{NodeBlock, LEAF, WideNode};
use crate::platform::dispatch::kernel;
use crate::simd::Isa;

/// What is to become a treelet.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its box, or about it.
    pub bounds: Octet,
    /// How many items it has.
    pub count: usize,
    /// How many splits are above it.
    pub depth: usize,
}

/// What is to be built: from which items, and how many places it takes in the node above.
pub type Job<'a> = (Batch<'a>, &'a Part, usize);

/// The items of a part.
pub enum Batch<'a> {
    Items(&'a mut [Item]),
    Made(&'a Make<'a>),
}

/// Makes items.
pub type Make<'a> = dyn Fn(&mut Vec<Item>) + Send + Sync + 'a;

/// A child that a treelet gives the node above it.
#[derive(Clone, Copy)]
pub struct Root {
    pub bounds: Octet,
    pub reference: u32,
}

/// A part of the tree, with references that count from its own start.
#[derive(Default)]
pub struct Treelet {
    pub blocks: Vec<NodeBlock>,
    /// In the order of the leaves.
    pub ids: Vec<u32>,
    roots: Vec<Root>,
}

/// What a thread needs to build treelets; kept from one to the next, or most of the time would go into new pages.
#[derive(Default)]
pub struct Scratch<N> {
    /// Those that are made here.
    items: Vec<Item>,
    tree: Vec<Binary>,
    /// Nodes to be split, their ranges and depths.
    open: Vec<(u32, u32, Range)>,
    notes: N,
}

kernel! {
    /// [`treelet`].
    fn build_treelet[L: Leaves](items: &mut [Item], above: (&Part, usize), shared: &Shared<L>,
        scratch: (&mut Scratch<L::Notes>, &mut Treelet)) = treelet
}

impl Treelet {
    /// Builds another one in its place.
    pub fn build<L: Leaves>(
        &mut self,
        job: Job,
        shared: &Shared<L>,
        scratch: &mut Scratch<L::Notes>,
    ) {
        let (batch, part, places) = job;
        let above = (part, places);
        match batch {
            Batch::Items(items) => {
                build_treelet(shared.machine, items, above, shared, (scratch, self));
            }
            Batch::Made(make) => {
                let mut items = std::mem::take(&mut scratch.items);
                items.clear();
                make(&mut items);
                build_treelet(shared.machine, &mut items, above, shared, (scratch, self));
                scratch.items = items;
            }
        }
    }

    /// Its roots, once it stands where so many blocks are before it.
    pub fn moved_roots<L: Leaves>(&self, [base, _]: [usize; 2]) -> Vec<Root> {
        let moved = |root: &Root| Root {
            reference: moved::<L>(root.reference, base as u32),
            ..*root
        };
        self.roots.iter().map(moved).collect()
    }

    /// Moves every reference to where so many blocks and ids are before it; the roots stay.
    pub fn relocate<L: Leaves>(&mut self, [base, first]: [usize; 2]) {
        let mut open: Vec<_> = self.roots.iter().map(|root| root.reference).collect();
        while let Some(at) = open.pop() {
            if at & LEAF != 0 {
                if L::IN_BLOCKS {
                    // SAFETY: references with `LEAF` lead to leaves where they lead to blocks.
                    unsafe { self.blocks[(at & !LEAF) as usize].leaf.first += first as u32 };
                }
                continue;
            }
            // SAFETY: references without `LEAF` lead to nodes.
            let node: &mut WideNode = unsafe { &mut self.blocks[at as usize].node };
            for child in &mut node.child[..node.children as usize] {
                open.push(*child);
                *child = moved::<L>(*child, base as u32);
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

/// Builds a treelet.
#[inline(always)]
fn treelet<I: Isa, L: Leaves>(
    items: &mut [Item],
    (part, places): (&Part, usize),
    shared: &Shared<L>,
    (scratch, treelet): (&mut Scratch<L::Notes>, &mut Treelet),
) {
    let leaves = shared.leaves;
    let Scratch {
        tree, open, notes, ..
    } = scratch;
    let Treelet { blocks, ids, roots } = treelet;
    tree.clear();
    blocks.clear();
    ids.clear();
    roots.clear();
    let n = leaves.enter(items, notes);
    let items = &mut items[..n];
    let range = Range::of::<I>(items);
    tree.push(Binary::leaf(range.bounds, 0, n as u32));
    open.push((0, part.depth as u32, range));
    while let Some((at, depth, range)) = open.pop() {
        let Binary { first, count, .. } = tree[at as usize];
        let here = &mut items[first as usize..(first + count) as usize];
        let few = count as usize <= leaves.binary_leaf();
        if count == 1 || few && leaves.alike(here, notes) {
            continue;
        }
        let bins = leaves.bins((count as usize).min(TREELET));
        let unit = leaves.binary_leaf() as u32;
        // Those of a cell or a part may be others than those of the whole tree, which are gone.
        let large = match at {
            0 => split_off::<I>(here, &range, depth as usize),
            _ => None,
        };
        let how = (bins, leaves.widest(), unit);
        let (middle, left, right) =
            large.unwrap_or_else(|| split::<I>(here, &range, depth as usize, how));
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
    let (found, n) = children(tree, 0, places, false);
    for (at, _) in found.into_iter().take(n) {
        let reference = emit(tree, at, blocks, |node, blocks| {
            leaves.emit(below(node), notes, ids, blocks)
        });
        let bounds = tree[at].bounds;
        roots.push(Root { bounds, reference });
    }
}
