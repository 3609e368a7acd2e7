//! From boxes to blocks: a binary tree by the surface-area heuristic, folded into eight-wide nodes.
//!
//! The tree is cut into treelets of at most [`TREELET`] items, which depends on the items alone. Above them, the
//! boxes are binned in parallel; each treelet is built and folded by one thread while it lies in that core's cache.

mod binned;
mod collapse;
mod morton;

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::block::{Block, LEAF, NO_CHILD, Node};
use crate::memory::Pages;
use binned::{Item, Method, Range};
use collapse::{Binary, Scratch, collapse};
use morton::Curve;

pub use binned::Item as BuildItem;

/// The most items of a part that is built by one thread.
const TREELET: usize = 1 << 14;

/// No path from the root is longer, in binary splits and therefore in nodes: where the heuristic would dig deeper,
/// the items are halved. It bounds the stack of every traversal.
pub const MAX_DEPTH: usize = 56;

/// What becomes of a few items that the tree does not separate further.
pub trait Leaves: Sync {
    /// Whether the items fit into one leaf. A single item always does.
    fn fit(&self, items: &[Item]) -> bool;
    /// The child reference of a leaf of `items`, which start at `first` in the final order. It may push blocks.
    fn emit(&self, items: &[Item], first: usize, blocks: &mut Vec<Block>) -> u32;
    /// Whether the reference [`Leaves::emit`] returns counts from the start of `blocks`.
    const IN_BLOCKS: bool;
    /// The most items in a binary leaf, which must fit into one leaf whatever they are.
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

/// Builds over `items`.
pub fn build<L: Leaves>(mut items: Vec<Item>, leaves: &L) -> Tree {
    if items.is_empty() {
        return Tree {
            blocks: Pages::with_capacity(0),
            root: NO_CHILD,
            ids: vec![],
            lower: [0.0; 3],
            upper: [0.0; 3],
        };
    }
    let whole = Range::of(&items);
    let (lower, upper) = (whole.lower(), whole.upper());
    let shared = Shared {
        leaves,
        curve: Curve::of(&whole),
        idle: Mutex::default(),
    };
    if leaves.bins(items.len()).is_none() {
        items = shared.curve.sort(items);
    }
    let top = split_top(&mut items, whole, 0, 0, &shared);
    let ids = items.par_iter().map(|item| item.id).collect();
    drop(items);
    let mut treelets = vec![];
    let mut binary = vec![];
    flatten(top, &mut binary, &mut treelets);
    let (blocks, root) = join::<L>(&binary, treelets);
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
    root: u32,
}

/// What all parts of a build share.
struct Shared<'a, L> {
    leaves: &'a L,
    curve: Curve,
    idle: Mutex<Vec<Scratch>>,
}

impl<L: Leaves> Shared<'_, L> {
    fn method(&self, items: usize) -> Method<'_> {
        let bins = self.leaves.bins(items);
        bins.map_or(Method::Curve(&self.curve), Method::Bins)
    }
}

fn split_top<L: Leaves>(
    items: &mut [Item],
    range: Range,
    first: usize,
    depth: usize,
    shared: &Shared<L>,
) -> Top {
    if items.len() <= TREELET {
        // A thread that panicked has left nothing half done in what is idle.
        let lock = || shared.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = lock().pop().unwrap_or_default();
        let (blocks, root) = collapse::treelet(items, range, first, depth, shared, &mut scratch);
        lock().push(scratch);
        return Top::Treelet(Treelet {
            range,
            blocks,
            root,
        });
    }
    let (middle, left, right) = binned::split(items, &range, depth, shared.method(items.len()));
    let (a, b) = items.split_at_mut(middle);
    let (a, b) = rayon::join(
        || split_top(a, left, first, depth + 1, shared),
        || split_top(b, right, first + middle, depth + 1, shared),
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
                binary[at] = Binary::inner(range, child as u32);
                let [a, b] = *children;
                open.push((b, child + 1));
                open.push((a, child));
            }
            Top::Treelet(treelet) => {
                binary[at] = Binary::leaf(treelet.range, treelets.len() as u32, 1);
                treelets.push(treelet);
            }
        }
    }
}

/// Folds the top of the tree and appends the treelets, whose references move along.
fn join<L: Leaves>(binary: &[Binary], treelets: Vec<Treelet>) -> (Pages<Block>, u32) {
    let mut top = vec![];
    let mut roots: Vec<u32> = vec![];
    let unit = |_: &Binary| false;
    let mut decisions = binary.to_vec();
    collapse(&mut decisions, unit);
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
    let mut parts = vec![Part {
        blocks: top.into(),
        nodes: None,
    }];
    parts.extend(treelets.into_iter().map(|treelet| Part {
        nodes: (treelet.root & LEAF == 0).then_some(treelet.root),
        blocks: treelet.blocks,
    }));
    // Treelets go as they are copied: never is everything there twice.
    let blocks = Pages::collect(base, parts, |part, base| {
        if let Some(root) = part.nodes {
            relocate::<L>(&mut part.blocks, root, base as u32);
        }
    });
    (blocks, root)
}

/// A part of the blocks, and the root of the nodes in it whose references are still to be moved.
struct Part {
    blocks: Box<[Block]>,
    nodes: Option<u32>,
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

/// Moves every reference at and below a node.
fn relocate<L: Leaves>(blocks: &mut [Block], node: u32, base: u32) {
    let mut open = vec![node];
    while let Some(at) = open.pop() {
        // SAFETY: only references without `LEAF` are opened, and these lead to nodes.
        let node: &mut Node = unsafe { &mut blocks[at as usize].node };
        for child in &mut node.child[..node.children as usize] {
            if *child & LEAF == 0 {
                open.push(*child);
            }
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
        fn fit(&self, items: &[Item]) -> bool {
            items.len() == 1
        }
        fn emit(&self, items: &[Item], _first: usize, _blocks: &mut Vec<Block>) -> u32 {
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
        let point = |x: f32| ([x; 3], [x; 3]);
        let same = vec![point(1.0); 50_000];
        let spread: Vec<_> = (0..50_000u32)
            .map(|i| point((i.wrapping_mul(2_654_435_761) >> 8) as f32))
            .collect();
        // Each box half the size of the last: the heuristic alone would make a list.
        let shrinking: Vec<_> = (0..140)
            .map(|i| ([0.0; 3], [0.5f32.powi(i - 30); 3]))
            .collect();
        let nested: Vec<_> = (0..40_000)
            .map(|i| ([-1.0 - i as f32; 3], [1.0 + i as f32; 3]))
            .collect();
        for boxes in [same, spread, shrinking, nested, vec![point(0.0)]] {
            check(&built(&boxes, true), &boxes);
            check(&built(&boxes, false), &boxes);
        }
    }

    #[test]
    fn the_tree_does_not_depend_on_the_number_of_threads() {
        let boxes: Vec<_> = (0..60_000u32)
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
