//! From boxes to blocks: a binary tree by the surface-area heuristic, folded into eight-wide nodes.
//!
//! The tree is cut into treelets of at most [`TREELET`] items, which depends on the items alone. Above them, the
//! boxes are binned in parallel; each treelet is built and folded by one thread while it lies in that core's cache.

mod binned;
mod collapse;
mod item;
mod morton;
mod partition;
mod top;

use std::sync::{Mutex, PoisonError};

use crate::block::{Block, LEAF, NO_CHILD, Node};
use crate::dispatch::{Machine, kernel};
use crate::memory::Pages;
use crate::simd::Portable;
use binned::Method;
use collapse::{Binary, Scratch, collapse, treelet};
use item::{Item, Range};
use morton::Curve;

pub use item::Item as BuildItem;

/// The most items of a part that is built by one thread. Few under Miri, which is slow: it sees every path all the same.
pub const TREELET: usize = if cfg!(miri) { 1 << 5 } else { 1 << 12 };

/// Items that are worth another thread.
const PARALLEL: usize = 4 * TREELET;

/// No path from the root is longer, in binary splits and therefore in nodes: where the heuristic would dig deeper,
/// the items are halved. It bounds the stack of every traversal.
pub const MAX_DEPTH: usize = 56;

/// What becomes of a few items that the tree does not separate further.
pub trait Leaves: Sync {
    /// What one thread notes of the items of the treelet it builds.
    type Notes: Default + Send;
    /// Looks at the items of a treelet, which it may join and give other ids; how many are left.
    fn enter(&self, items: &mut [Item], notes: &mut Self::Notes) -> usize;
    /// Whether the items fit into one leaf. A single item always does.
    fn fit(&self, items: &[Item], notes: &mut Self::Notes) -> bool;
    /// The child reference of a leaf of `items`, whose ids go to `ids`. It may push blocks.
    fn emit(
        &self,
        items: &[Item],
        notes: &mut Self::Notes,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<Block>,
    ) -> u32;
    /// Whether the reference [`Leaves::emit`] returns counts from the start of `blocks`, where a leaf stands that
    /// counts from the start of `ids`.
    const IN_BLOCKS: bool;
    /// The most items in a binary leaf, which must fit into one leaf whatever they are. Splits aim at full ones.
    fn binary_leaf(&self) -> usize;
    /// How many bins along an axis a range of items is worth: 8, 16 or 32. `None`: it is split along a curve.
    fn bins(&self, items: usize) -> Option<usize>;
}

/// A finished tree.
pub struct Tree {
    /// Nodes and leaves.
    pub blocks: Pages<Block>,
    /// The reference of the root; [`NO_CHILD`] where there is nothing.
    pub root: u32,
    /// Item ids in the order of the leaves.
    pub ids: Vec<u32>,
    /// The box of everything.
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}

/// Builds over `items`, with the instruction set of `machine`: every one gives the same tree.
pub fn build<L: Leaves>(machine: Machine, mut items: Vec<Item>, leaves: &L) -> Tree {
    if items.is_empty() {
        return Tree {
            blocks: Pages::with_capacity(0),
            root: NO_CHILD,
            ids: vec![],
            lower: [0.0; 3],
            upper: [0.0; 3],
        };
    }
    let whole = top::range(machine, &items);
    let (lower, upper) = item::corners(&whole.bounds);
    let shared = Shared {
        leaves,
        machine,
        curve: Curve::of(&whole),
        idle: Mutex::default(),
    };
    if leaves.bins(items.len()).is_none() {
        items = shared.curve.sort(items);
    }
    let top = split_top(&mut items, whole, 0, &shared);
    drop(items);
    let mut treelets = vec![];
    let mut binary = vec![];
    flatten(top, &mut binary, &mut treelets);
    let (blocks, root, ids) = join::<L>(&binary, treelets);
    Tree {
        blocks,
        root,
        ids,
        lower,
        upper,
    }
}

/// The tree above the treelets.
enum Top {
    Split(Range, Box<[Top; 2]>),
    Treelet(Treelet),
}

/// A part of the tree, with references that count from its own start.
struct Treelet {
    range: Range,
    blocks: Box<[Block]>,
    ids: Box<[u32]>,
    root: u32,
}

/// What all parts of a build share.
pub struct Shared<'a, L: Leaves> {
    leaves: &'a L,
    machine: Machine,
    curve: Curve,
    idle: Mutex<Vec<Scratch<L::Notes>>>,
}

impl<L: Leaves> Shared<'_, L> {
    fn method(&self, items: usize) -> Method<'_> {
        let bins = self.leaves.bins(items);
        let unit = self.leaves.binary_leaf() as u32;
        bins.map_or(Method::Curve(&self.curve), |bins| Method::Bins(bins, unit))
    }
}

kernel! {
    /// [`treelet`].
    fn build_treelet[L: Leaves](items: &mut [Item], above: (&Range, usize), shared: &Shared<L>,
        scratch: &mut Scratch<L::Notes>, root: &mut u32) = treelet
}

fn split_top<L: Leaves>(items: &mut [Item], range: Range, depth: usize, shared: &Shared<L>) -> Top {
    if items.len() <= TREELET {
        // A thread that panicked has left nothing half done in what is idle.
        let lock = || shared.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = lock().pop().unwrap_or_default();
        let mut root = NO_CHILD;
        build_treelet(
            shared.machine,
            items,
            (&range, depth),
            shared,
            &mut scratch,
            &mut root,
        );
        let treelet = Treelet {
            range,
            blocks: scratch.blocks.as_slice().into(),
            ids: scratch.ids.as_slice().into(),
            root,
        };
        lock().push(scratch);
        return Top::Treelet(treelet);
    }
    let (middle, left, right) = top::split(
        shared.machine,
        items,
        &range,
        depth,
        shared.method(items.len()),
    );
    let (a, b) = items.split_at_mut(middle);
    let (a, b) = rayon::join(
        || split_top(a, left, depth + 1, shared),
        || split_top(b, right, depth + 1, shared),
    );
    Top::Split(range, Box::new([a, b]))
}

/// Lists the binary nodes above the treelets, parents before children.
fn flatten(top: Top, binary: &mut Vec<Binary>, treelets: &mut Vec<Treelet>) {
    let mut open = vec![(top, 0)];
    binary.push(Binary::default());
    while let Some((top, at)) = open.pop() {
        match top {
            Top::Split(range, children) => {
                let child = binary.len();
                binary.push(Binary::default());
                binary.push(Binary::default());
                binary[at] = Binary::inner(range.bounds, child as u32);
                let [a, b] = *children;
                open.push((b, child + 1));
                open.push((a, child));
            }
            Top::Treelet(treelet) => {
                binary[at] = Binary::leaf(treelet.range.bounds, treelets.len() as u32, 1);
                treelets.push(treelet);
            }
        }
    }
}

/// Folds the top of the tree and appends the treelets, whose references move along.
fn join<L: Leaves>(binary: &[Binary], treelets: Vec<Treelet>) -> (Pages<Block>, u32, Vec<u32>) {
    let mut top = vec![];
    let mut roots: Vec<u32> = vec![];
    let mut decisions = binary.to_vec();
    collapse::<Portable>(&mut decisions, |_| false);
    // Where each treelet will stand is known once the size of the top is: fold it with the treelets' numbers first.
    let root = collapse::emit(&decisions, 0, &mut top, &mut |node, _| LEAF | node.first);
    let mut base = top.len();
    for treelet in &treelets {
        roots.push(moved::<L>(treelet.root, base as u32));
        base += treelet.blocks.len();
    }
    let resolve = |child: u32| {
        if child != NO_CHILD && child & LEAF != 0 {
            roots[(child & !LEAF) as usize]
        } else {
            child
        }
    };
    let root = resolve(root);
    for block in &mut top {
        // SAFETY: the top is made of nodes only.
        let node: &mut Node = unsafe { &mut block.node };
        node.child = node.child.map(resolve);
    }
    let mut ids = Vec::with_capacity(treelets.iter().map(|treelet| treelet.ids.len()).sum());
    let mut parts = vec![Part {
        blocks: top.into(),
        root: None,
        first: 0,
    }];
    for treelet in treelets {
        parts.push(Part {
            blocks: treelet.blocks,
            root: Some(treelet.root),
            first: ids.len() as u32,
        });
        ids.extend_from_slice(&treelet.ids);
    }
    // Treelets go as they are copied: never is everything there twice.
    let blocks = Pages::collect(base, parts, |part, base| {
        if let Some(root) = part.root {
            relocate::<L>(&mut part.blocks, root, base as u32, part.first);
        }
    });
    (blocks, root, ids)
}

/// A part of the blocks, the reference of its root if there is something to be moved, and where its ids start.
struct Part {
    blocks: Box<[Block]>,
    root: Option<u32>,
    first: u32,
}

impl AsRef<[Block]> for Part {
    fn as_ref(&self) -> &[Block] {
        &self.blocks
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

/// Moves every reference at and below one.
fn relocate<L: Leaves>(blocks: &mut [Block], root: u32, base: u32, first: u32) {
    let mut open = vec![root];
    while let Some(at) = open.pop() {
        if at & LEAF != 0 {
            if L::IN_BLOCKS {
                // SAFETY: references with `LEAF` lead to leaves where they lead to blocks.
                unsafe { blocks[(at & !LEAF) as usize].leaf.first += first };
            }
            continue;
        }
        // SAFETY: references without `LEAF` lead to nodes.
        let node: &mut Node = unsafe { &mut blocks[at as usize].node };
        for child in &mut node.child[..node.children as usize] {
            open.push(*child);
            *child = moved::<L>(*child, base);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes as leaves, one each; by bins or along a curve.
    struct Boxes(bool);

    impl Leaves for Boxes {
        const IN_BLOCKS: bool = false;
        type Notes = ();
        fn enter(&self, items: &mut [Item], _notes: &mut ()) -> usize {
            items.len()
        }
        fn fit(&self, items: &[Item], _notes: &mut ()) -> bool {
            items.len() == 1
        }
        fn emit(
            &self,
            items: &[Item],
            _notes: &mut (),
            ids: &mut Vec<u32>,
            _blocks: &mut Vec<Block>,
        ) -> u32 {
            ids.push(items[0].id);
            LEAF | items[0].id
        }
        fn binary_leaf(&self) -> usize {
            1
        }
        fn bins(&self, _items: usize) -> Option<usize> {
            self.0.then_some(16)
        }
    }

    /// Every box is in the tree once, inside all boxes above it, and no path is too long; the longest path.
    fn check(tree: &Tree, boxes: &[([f32; 3], [f32; 3])]) -> usize {
        let mut seen = vec![false; boxes.len()];
        let mut deepest = 0;
        let mut open = vec![(tree.root, tree.lower, tree.upper, 0)];
        while let Some((at, lower, upper, depth)) = open.pop() {
            deepest = deepest.max(depth);
            if at & LEAF != 0 {
                let id = (at & !LEAF) as usize;
                assert!(
                    !std::mem::replace(&mut seen[id], true),
                    "box {id} is there twice"
                );
                let (l, u) = boxes[id];
                assert!(
                    (0..3).all(|a| lower[a] <= l[a] && u[a] <= upper[a]),
                    "box {id} sticks out"
                );
                continue;
            }
            let node = crate::block::node(&tree.blocks, at);
            assert!(node.children > 0);
            for k in 0..node.children as usize {
                let l = [node.bounds[0][k], node.bounds[2][k], node.bounds[4][k]];
                let u = [node.bounds[1][k], node.bounds[3][k], node.bounds[5][k]];
                assert!(
                    (0..3).all(|a| lower[a] <= l[a] && u[a] <= upper[a]),
                    "child {k} of {at} sticks out"
                );
                open.push((node.child[k], l, u, depth + 1));
            }
        }
        assert!(seen.iter().all(|s| *s), "a box is missing");
        assert!(deepest <= MAX_DEPTH, "{deepest} levels");
        deepest
    }

    fn built(boxes: &[([f32; 3], [f32; 3])], bins: bool) -> Tree {
        build(
            Machine::best(),
            boxes
                .iter()
                .zip(0..)
                .map(|(b, id)| Item::new(b.0, b.1, id))
                .collect(),
            &Boxes(bins),
        )
    }

    #[test]
    fn trees_hold_every_box_once_whatever_the_boxes() {
        const N: u32 = 12 * TREELET as u32;
        let point = |x: f32| ([x; 3], [x; 3]);
        let same = vec![point(1.0); N as usize];
        let spread: Vec<_> = (0..N)
            .map(|i| point((i.wrapping_mul(2_654_435_761) >> 8) as f32))
            .collect();
        // Each box half the size of the last: the heuristic alone would make a list.
        let shrinking: Vec<_> = (0..140)
            .map(|i| ([0.0; 3], [0.5f32.powi(i - 30); 3]))
            .collect();
        let nested: Vec<_> = (0..N)
            .map(|i| ([-1.0 - i as f32; 3], [1.0 + i as f32; 3]))
            .collect();
        for boxes in [same, spread, shrinking, nested, vec![point(0.0)]] {
            check(&built(&boxes, true), &boxes);
            check(&built(&boxes, false), &boxes);
        }
    }

    #[test]
    fn the_tree_does_not_depend_on_the_number_of_threads() {
        let boxes: Vec<_> = (0..15 * TREELET as u32)
            .map(|i| {
                let x = |k: u32| ((i * 3 + k).wrapping_mul(2_654_435_761) >> 8) as f32;
                ([x(0), x(1), x(2)], [x(0) + 9e3, x(1) + 9e3, x(2) + 9e3])
            })
            .collect();
        for bins in [true, false] {
            let trees = [1, 2, 5].map(|n| {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(n)
                    .build()
                    .unwrap();
                pool.install(|| built(&boxes, bins))
            });
            for tree in &trees[1..] {
                assert_eq!(tree.root, trees[0].root);
                assert_eq!(tree.ids, trees[0].ids);
                let nodes = |tree: &Tree| {
                    // SAFETY: this tree has no leaf blocks.
                    let node = |block: &Block| unsafe { (block.node.bounds, block.node.child) };
                    tree.blocks.iter().map(node).collect::<Vec<_>>()
                };
                assert!(nodes(tree) == nodes(&trees[0]));
            }
        }
    }
}
