//! Folds a binary tree into nodes of eight at the least expected cost: the dynamic programme of Ylitie, Karras and
//! Laine 2017, section 3.1, which also merges binary leaves into leaves of sixteen triangles.

use super::item::{NOTHING, Octet, corners, half_area};
use super::{LEAF, NO_CHILD};
use crate::block::{Block, Node};
use crate::simd::{Isa, Vector};

/// A node of the binary tree and what it costs as 1 to 8 children of a wide node.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Binary {
    pub bounds: Octet,
    /// `cost[k - 1]`: the least cost as at most k children.
    cost: Octet,
    /// Index of the left child, which the right one follows.
    left: u32,
    /// Where the items below start, and how many there are.
    pub first: u32,
    pub count: u32,
    pub leaf: bool,
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

/// Fills in the costs, children before parents. A leaf costs `of_leaf` for its area as 1 to 8 children; a test costs as
/// much whether it is of a node or of a leaf.
#[inline(always)]
pub fn collapse<I: Isa>(
    tree: &mut [Binary],
    of_leaf: impl Fn(&Binary) -> Octet,
    mut fits: impl FnMut(&Binary) -> bool,
) {
    for at in (0..tree.len()).rev() {
        let node = tree[at];
        // SAFETY: a box has eight floats.
        let area = half_area::<I>(unsafe { I::F8::load(node.bounds.as_ptr()) });
        if node.leaf {
            tree[at].cost = of_leaf(&node).map(|cost| cost * area);
            continue;
        }
        let [left, right] = [0, 1].map(|k| &tree[node.left as usize + k]);
        // What does not fit into a leaf does not fit with more besides.
        let small = left.leaf && right.leaf;
        let mut cost = apart::<I>(&left.cost, &right.cost);
        let (as_node, as_leaf) = (cost[7] + area, area);
        let here = &mut tree[at];
        here.leaf = small && as_leaf <= as_node && fits(&node);
        if here.leaf {
            here.cost = [as_leaf; 8];
            continue;
        }
        cost[0] = as_node;
        for k in 1..8 {
            cost[k] = cost[k].min(cost[k - 1]);
        }
        here.cost = cost;
    }
}

/// The least cost of two nodes as k children, k from 1 to 8, each node taking one at least.
#[inline(always)]
pub fn apart<I: Isa>(left: &Octet, right: &Octet) -> Octet {
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
    let mut below = [(NOTHING, NO_CHILD); 8];
    let mut n = 0;
    for (child, _) in children(tree, at, 8, true) {
        below[n] = (tree[child].bounds, emit(tree, child, blocks, leaf));
        debug_assert_ne!(below[n].1, NO_CHILD);
        n += 1;
    }
    let wide = wide(&below[..n]);
    blocks[index] = Block { node: wide };
    debug_assert_eq!(index as u32 & LEAF, 0);
    index as u32
}

/// The node above some children: leaves come last, for of several children the last is where a packet of shadow rays goes
/// first, and what stops it there is not asked for further down.
pub fn wide(children: &[(Octet, u32)]) -> Node {
    let mut node = Node::EMPTY;
    for leaf in [0, LEAF] {
        for (bounds, reference) in children {
            if reference & LEAF == leaf {
                let (lower, upper) = corners(bounds);
                node.push(lower, upper, *reference);
            }
        }
    }
    node
}

/// The binary nodes that `at` becomes in `places` places, and how many of them each takes; `opened`: not `at` itself.
pub fn children(
    tree: &[Binary],
    at: usize,
    places: usize,
    opened: bool,
) -> impl Iterator<Item = (usize, usize)> + use<> {
    let mut found = [(0, 0); 8];
    let mut n = 0;
    gather(tree, at, places, opened, &mut found, &mut n);
    found.into_iter().take(n)
}

fn gather(
    tree: &[Binary],
    at: usize,
    mut places: usize,
    opened: bool,
    found: &mut [(usize, usize); 8],
    n: &mut usize,
) {
    let node = &tree[at];
    if !opened {
        // No more places than are of use.
        while places > 1 && node.cost[places - 1] == node.cost[places - 2] {
            places -= 1;
        }
        if places == 1 || node.left == 0 {
            found[*n] = (at, places);
            *n += 1;
            return;
        }
    }
    let [left, right] = [0, 1].map(|side| &tree[node.left as usize + side].cost);
    let (mut take, mut least) = (1, f32::INFINITY);
    for left_takes in 1..places {
        let cost = left[left_takes - 1] + right[places - left_takes - 1];
        if cost < least {
            (take, least) = (left_takes, cost);
        }
    }
    gather(tree, node.left as usize, take, false, found, n);
    gather(tree, node.left as usize + 1, places - take, false, found, n);
}
