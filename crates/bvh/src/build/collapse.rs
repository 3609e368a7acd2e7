//! Folds a binary tree into nodes of eight at the least expected cost: the dynamic programme of Ylitie, Karras and
//! Laine 2017, section 3.1, which also merges binary leaves into leaves of sixteen triangles.

use super::binned::{Item, Range, split};
use super::{LEAF, Leaves, NO_CHILD, Shared};
use crate::block::{Block, Node};

/// Of a leaf test, in node tests.
const LEAF_COST: f32 = 1.0;

/// A node of the binary tree and what it costs as 1 to 8 children of a wide node.
#[derive(Clone, Copy, Debug)]
pub struct Binary {
    range: Range,
    /// Index of the left child, which the right one follows; 0 for a binary leaf.
    left: u32,
    /// Where the items below start, and how many there are.
    pub first: u32,
    count: u32,
    /// `cost[k - 1]`: the least cost as at most k children.
    cost: [f32; 8],
    /// How many of k children the left child takes; 0: no more than with k - 1.
    share: [u8; 8],
    leaf: bool,
}

impl Default for Binary {
    fn default() -> Self {
        Self {
            range: Range::empty(),
            left: 0,
            first: 0,
            count: 0,
            cost: [0.0; 8],
            share: [0; 8],
            leaf: false,
        }
    }
}

impl Binary {
    /// A node with children at `left` and `left + 1`.
    pub fn inner(range: Range, left: u32) -> Self {
        Self {
            range,
            left,
            ..Self::default()
        }
    }

    /// A node that is not split further.
    pub fn leaf(range: Range, first: u32, count: u32) -> Self {
        Self {
            range,
            first,
            count,
            leaf: true,
            ..Self::default()
        }
    }
}

/// What a thread needs to build a treelet; kept from treelet to treelet, or most of the time would go into new pages.
#[derive(Default)]
pub struct Scratch {
    tree: Vec<Binary>,
    open: Vec<(usize, usize)>,
    blocks: Vec<Block>,
}

/// Builds a treelet; returns its blocks and the reference of its root, which counts from their start.
pub fn treelet<L: Leaves>(
    items: &mut [Item],
    range: Range,
    first: usize,
    depth: usize,
    shared: &Shared<L>,
    scratch: &mut Scratch,
) -> (Box<[Block]>, u32) {
    let leaves = shared.leaves;
    let Scratch { tree, open, blocks } = scratch;
    tree.clear();
    blocks.clear();
    tree.push(Binary {
        count: items.len() as u32,
        range,
        ..Binary::default()
    });
    open.push((0, depth));
    while let Some((at, depth)) = open.pop() {
        let Binary {
            first: begin,
            count,
            range,
            ..
        } = tree[at];
        if count as usize <= leaves.binary_leaf() {
            tree[at].leaf = true;
            continue;
        }
        let here = &mut items[begin as usize..(begin + count) as usize];
        let (middle, left, right) = split(here, &range, depth, shared.method(count as usize));
        let child = tree.len() as u32;
        tree[at].left = child;
        let middle = middle as u32;
        tree.push(Binary {
            range: left,
            first: begin,
            count: middle,
            ..Binary::default()
        });
        tree.push(Binary {
            range: right,
            first: begin + middle,
            count: count - middle,
            ..Binary::default()
        });
        open.push((child as usize + 1, depth + 1));
        open.push((child as usize, depth + 1));
    }
    let items = &*items;
    let below = |node: &Binary| &items[node.first as usize..(node.first + node.count) as usize];
    collapse(tree, |node| leaves.fit(below(node)));
    let root = emit(tree, 0, blocks, &mut |node, blocks| {
        leaves.emit(below(node), first + node.first as usize, blocks)
    });
    (blocks.as_slice().into(), root)
}

/// Fills in the costs, children before parents.
pub fn collapse(tree: &mut [Binary], fits: impl Fn(&Binary) -> bool) {
    for at in (0..tree.len()).rev() {
        let node = tree[at];
        let area = node.range.half_area();
        if node.leaf {
            tree[at].cost = [area * LEAF_COST; 8];
            continue;
        }
        let [left, right] = [0, 1].map(|k| &tree[node.left as usize + k]);
        // What does not fit into a leaf does not fit with more besides.
        let small = left.leaf && right.leaf;
        let (left, right) = (left.cost, right.cost);
        let mut cost = [f32::INFINITY; 8];
        let mut share = [0u8; 8];
        for k in 2..=8usize {
            for take in 1..k {
                let c = left[take - 1] + right[k - take - 1];
                if c < cost[k - 1] {
                    cost[k - 1] = c;
                    share[k - 1] = take as u8;
                }
            }
        }
        let as_node = cost[7] + area;
        let as_leaf = area * LEAF_COST;
        let here = &mut tree[at];
        here.share = share;
        here.leaf = small && as_leaf <= as_node && fits(&node);
        cost[0] = if here.leaf { as_leaf } else { as_node };
        for k in 1..8 {
            if cost[k - 1] <= cost[k] {
                cost[k] = cost[k - 1];
                // The shares of a whole node (8) stay: it is asked for them as a node, not as children.
                if k < 7 {
                    here.share[k] = 0;
                }
            }
        }
        here.cost = cost;
    }
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
        let range = &tree[child as usize].range;
        wide.push(range.lower(), range.upper(), reference);
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
        while k > 1 && (node.leaf || node.share[k - 1] == 0) {
            k -= 1;
        }
        if k == 1 {
            out[*n] = at as u32;
            *n += 1;
            return;
        }
    }
    let take = node.share[k - 1] as usize;
    gather(tree, node.left as usize, take, false, out, n);
    gather(tree, node.left as usize + 1, k - take, false, out, n);
}
