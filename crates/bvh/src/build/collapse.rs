//! Folds a binary tree into nodes of eight at the least expected cost: the dynamic programme of Ylitie, Karras and
//! Laine 2017, section 3.1, which also merges binary leaves into leaves of sixteen triangles.

use super::binned::split;
use super::item::{Item, NOTHING, Octet, Range, corners, half_area};
use super::{LEAF, Leaves, NO_CHILD, Shared};
use crate::block::{Block, Node};
use crate::simd::{Isa, Vector};

/// Of a leaf test, in node tests.
const LEAF_COST: f32 = 1.0;

/// A node of the binary tree and what it costs as 1 to 8 children of a wide node.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Binary {
    bounds: Octet,
    /// `cost[k - 1]`: the least cost as at most k children.
    cost: Octet,
    /// Index of the left child, which the right one follows.
    left: u32,
    /// Where the items below start, and how many there are.
    pub first: u32,
    count: u32,
    leaf: bool,
}

impl Default for Binary {
    fn default() -> Self {
        Self::leaf(NOTHING, 0, 0)
    }
}

impl Binary {
    /// A node with children at `left` and `left + 1`.
    pub fn inner(bounds: Octet, left: u32) -> Self {
        Self {
            left,
            leaf: false,
            ..Self::leaf(bounds, 0, 0)
        }
    }

    /// A node that is not split further.
    pub fn leaf(bounds: Octet, first: u32, count: u32) -> Self {
        Self {
            bounds,
            cost: [0.0; 8],
            left: 0,
            first,
            count,
            leaf: true,
        }
    }
}

/// What a thread needs to build a treelet; kept from treelet to treelet, or most of the time would go into new pages.
#[derive(Default)]
pub struct Scratch<N> {
    tree: Vec<Binary>,
    /// Nodes to be split, their ranges and depths.
    open: Vec<(u32, u32, Range)>,
    notes: N,
    /// What was built: nodes and leaves,
    pub blocks: Vec<Block>,
    /// and the ids in the order of the leaves.
    pub ids: Vec<u32>,
}

/// Builds a treelet into `scratch`; the reference of its root counts from the start of its blocks.
#[inline(always)]
pub fn treelet<I: Isa, L: Leaves>(
    items: &mut [Item],
    (range, depth): (&Range, usize),
    shared: &Shared<L>,
    scratch: &mut Scratch<L::Notes>,
    root: &mut u32,
) {
    let leaves = shared.leaves;
    let Scratch {
        tree,
        open,
        notes,
        blocks,
        ids,
    } = scratch;
    tree.clear();
    blocks.clear();
    ids.clear();
    let n = leaves.enter(items, notes);
    let range = if n == items.len() {
        *range
    } else {
        Range::of::<I>(&items[..n])
    };
    let items = &mut items[..n];
    tree.push(Binary::leaf(range.bounds, 0, n as u32));
    open.push((0, depth as u32, range));
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
    collapse::<I>(tree, |node| leaves.fit(below(node), notes));
    *root = emit(tree, 0, blocks, &mut |node, blocks| {
        leaves.emit(below(node), notes, ids, blocks)
    });
}

/// Fills in the costs, children before parents.
#[inline(always)]
pub fn collapse<I: Isa>(tree: &mut [Binary], mut fits: impl FnMut(&Binary) -> bool) {
    for at in (0..tree.len()).rev() {
        let node = tree[at];
        // SAFETY: a box has eight floats.
        let area = half_area::<I>(unsafe { I::F8::load(node.bounds.as_ptr()) });
        if node.leaf {
            tree[at].cost = [area * LEAF_COST; 8];
            continue;
        }
        let [left, right] = [0, 1].map(|k| &tree[node.left as usize + k]);
        // What does not fit into a leaf does not fit with more besides.
        let small = left.leaf && right.leaf;
        let mut cost = apart::<I>(&left.cost, &right.cost);
        let (as_node, as_leaf) = (cost[7] + area, area * LEAF_COST);
        let here = &mut tree[at];
        here.leaf = small && as_leaf <= as_node && fits(&node);
        cost[0] = if here.leaf { as_leaf } else { as_node };
        for k in 1..8 {
            cost[k] = cost[k].min(cost[k - 1]);
        }
        here.cost = cost;
    }
}

/// The least cost of two nodes as k children, k from 1 to 8, each node taking one at least.
#[inline(always)]
fn apart<I: Isa>(left: &Octet, right: &Octet) -> Octet {
    // As many children as are left over, or none at all.
    let mut later = [f32::INFINITY; 16];
    later[8..].copy_from_slice(right);
    let mut best = I::F8::splat(f32::INFINITY);
    for take in 1..8 {
        // SAFETY: `take` is at most 7, and eight floats follow.
        let rest = unsafe { I::F8::load(later[8 - take..].as_ptr()) };
        best = best.min(I::F8::splat(left[take - 1]).add(rest));
    }
    let mut cost = [0.0; 8];
    // SAFETY: room for eight floats.
    unsafe { best.store(cost.as_mut_ptr()) };
    cost
}

/// Writes the wide nodes below a binary node; returns the reference of the root.
pub fn emit(
    tree: &[Binary],
    at: usize,
    blocks: &mut Vec<Block>,
    leaf: &mut impl FnMut(&Binary, &mut Vec<Block>) -> u32,
) -> u32 {
    let node = &tree[at];
    if node.leaf {
        return leaf(node, blocks);
    }
    let index = blocks.len();
    blocks.push(Block { node: Node::EMPTY });
    let mut children = [0u32; 8];
    let mut n = 0;
    gather(tree, at, 8, true, &mut children, &mut n);
    let mut wide = Node::EMPTY;
    for &child in &children[..n] {
        let reference = emit(tree, child as usize, blocks, leaf);
        debug_assert_ne!(reference, NO_CHILD);
        let (lower, upper) = corners(&tree[child as usize].bounds);
        wide.push(lower, upper, reference);
    }
    blocks[index] = Block { node: wide };
    debug_assert_eq!(index as u32 & LEAF, 0);
    index as u32
}

/// The binary nodes that become the children: those of `at` when it takes `k` places.
fn gather(
    tree: &[Binary],
    at: usize,
    mut k: usize,
    opened: bool,
    out: &mut [u32; 8],
    n: &mut usize,
) {
    let node = &tree[at];
    if !opened {
        // No more places than are of use.
        while k > 1 && (node.leaf || node.cost[k - 1] == node.cost[k - 2]) {
            k -= 1;
        }
        if k == 1 {
            out[*n] = at as u32;
            *n += 1;
            return;
        }
    }
    let [left, right] = [0, 1].map(|side| &tree[node.left as usize + side].cost);
    let (mut take, mut least) = (1, f32::INFINITY);
    for left_takes in 1..k {
        let cost = left[left_takes - 1] + right[k - left_takes - 1];
        if cost < least {
            (take, least) = (left_takes, cost);
        }
    }
    gather(tree, node.left as usize, take, false, out, n);
    gather(tree, node.left as usize + 1, k - take, false, out, n);
}
