//! Collapsing of a binary tree into nodes of eight children with the least expected cost: the dynamic programme of
//! Ylitie, Karras and Laine 2017, section 3.1, which also merges binary leaves into leaves of sixteen triangles.

use crate::build::prim_ref::{EMPTY_BOUNDS, PackedBounds, half_area, unpack_bounds};
use crate::node::{NodeBlock, NodeRef, WideNode};
use crate::simd::{Isa, Vector};

/// A node of the binary tree and its cost as 1 to 8 children of a wide node.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct BinaryNode {
    pub bounds: PackedBounds,
    /// `cost[k - 1]`: least cost of the subtree if it becomes at most k children of its parent.
    cost: PackedBounds,
    /// Index of the left child; the right child has the next index.
    left: u32,
    /// Range of the primitives below this node: index of the first, and their number.
    pub first: u32,
    pub count: u32,
    pub leaf: bool,
}

impl Default for BinaryNode {
    fn default() -> Self {
        Self::leaf(EMPTY_BOUNDS, 0, 0)
    }
}

impl BinaryNode {
    /// Creates an inner node with children at `left` and `left + 1`.
    pub fn inner(bounds: PackedBounds, left: u32) -> Self {
        Self { left, leaf: false, ..Self::leaf(bounds, 0, 0) }
    }

    /// Creates a leaf of the binary tree.
    pub fn leaf(bounds: PackedBounds, first: u32, count: u32) -> Self {
        Self { bounds, cost: [0.0; 8], left: 0, first, count, leaf: true }
    }
}

/// Computes the costs of all nodes, children before parents, and merges two leaves into one if this does not increase the
/// cost. `of_leaf` returns a leaf's costs per area if it becomes at most 1, 2, ... 8 children of its parent; `fits`
/// returns true if a node's primitives fit into one leaf. Testing a node costs as much as testing a leaf.
#[inline(always)]
pub fn collapse<I: Isa>(
    tree: &mut [BinaryNode],
    of_leaf: impl Fn(&BinaryNode) -> PackedBounds,
    mut fits: impl FnMut(&BinaryNode) -> bool,
) {
    for at in (0..tree.len()).rev() {
        let node = tree[at];
        // SAFETY: packed bounds consist of eight floats.
        let area = half_area::<I>(unsafe { I::F32x8::load(node.bounds.as_ptr()) });
        if node.leaf {
            tree[at].cost = of_leaf(&node).map(|cost| cost * area);
            continue;
        }
        let [left, right] = [0, 1].map(|k| &tree[node.left as usize + k]);
        // If the primitives of a child do not fit into a leaf, the primitives of both children do not fit either.
        let small = left.leaf && right.leaf;
        let mut cost = distribute_cost::<I>(&left.cost, &right.cost);
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

/// The least cost at which two nodes together become k children, for k from 1 to 8; each node becomes at least one
/// child.
#[inline(always)]
pub fn distribute_cost<I: Isa>(left: &PackedBounds, right: &PackedBounds) -> PackedBounds {
    // The right node's costs with padding in front, so that they can be read shifted by the left node's number of
    // children.
    let mut later = [f32::INFINITY; 16];
    later[8..].copy_from_slice(right);
    let mut best = I::F32x8::splat(f32::INFINITY);
    for take in 1..8 {
        // SAFETY: `take` is at most 7, so at least eight floats follow.
        let rest = unsafe { I::F32x8::load(later[8 - take..].as_ptr()) };
        best = best.min(I::F32x8::splat(left[take - 1]).add(rest));
    }
    let mut cost = [0.0; 8];
    // SAFETY: `cost` has room for eight floats.
    unsafe { best.store(cost.as_mut_ptr()) };
    cost
}

/// Writes the wide nodes below a binary node, parents before children; returns the reference of the root. This function
/// is iterative, because it is inlined into the kernel together with the leaf builder.
#[inline(always)]
pub fn emit_wide_nodes(
    tree: &[BinaryNode],
    root: usize,
    blocks: &mut Vec<NodeBlock>,
    mut leaf: impl FnMut(&BinaryNode, &mut Vec<NodeBlock>) -> NodeRef,
) -> NodeRef {
    // Nodes to write, each with the index of its parent (`usize::MAX` for the root) and its lane in the parent.
    let mut open = vec![(root, usize::MAX, 0)];
    let mut first = NodeRef::EMPTY;
    while let Some((at, above, lane)) = open.pop() {
        let reference = if tree[at].leaf {
            leaf(&tree[at], blocks)
        } else {
            let mut below = [(EMPTY_BOUNDS, NodeRef::EMPTY); 8];
            let (found, n) = select_children(tree, at, 8, true);
            for ((child, _), below) in found[..n].iter().zip(&mut below) {
                // Until the child is written, its slot contains the index of the binary node.
                let node = &tree[*child];
                let reference = match node.leaf {
                    true => NodeRef::leaf(*child),
                    false => NodeRef::node(*child),
                };
                *below = (node.bounds, reference);
            }
            let node = make_wide_node(&below[..n]);
            let index = blocks.len();
            for (child, _) in found[..n].iter().rev() {
                let is_it = |reference: &NodeRef| reference.index() == *child;
                open.push((*child, index, node.children.iter().position(is_it).unwrap_or(0)));
            }
            blocks.push(NodeBlock { node });
            NodeRef::node(index)
        };
        match blocks.get_mut(above) {
            // SAFETY: `above` is the index of an inner node that an earlier iteration has written.
            Some(above) => unsafe { above.node.children[lane] = reference },
            None => first = reference,
        }
    }
    first
}

/// Creates a wide node with these children. Leaves come last: packets of shadow rays visit the last child first, and
/// rays that end in a leaf skip the other subtrees.
pub fn make_wide_node(children: &[(PackedBounds, NodeRef)]) -> WideNode {
    let mut node = WideNode::EMPTY;
    for leaf in [false, true] {
        for (bounds, reference) in children {
            if reference.is_leaf() == leaf {
                node.push_child(unpack_bounds(bounds), *reference);
            }
        }
    }
    node
}

/// Selects the binary nodes that replace `at` in at most `slots` child slots. Returns the nodes, each with its number
/// of slots, and the number of nodes. If `opened` is true, `at` is always replaced by its children.
#[inline(always)]
pub fn select_children(tree: &[BinaryNode], at: usize, slots: usize, opened: bool) -> ([(usize, usize); 8], usize) {
    let mut found = [(0, 0); 8];
    let mut n = 0;
    // All entries together have at most eight slots, and each has at least one, so eight entries are sufficient.
    let mut open = [(at, slots); 8];
    let mut left = 1;
    let mut opened = opened;
    while left > 0 {
        left -= 1;
        let (at, mut slots) = open[left & 7];
        let node = &tree[at];
        if !std::mem::take(&mut opened) {
            // Slots that do not lower the cost are dropped.
            while slots > 1 && node.cost[slots - 1] == node.cost[slots - 2] {
                slots -= 1;
            }
            if slots == 1 || node.left == 0 {
                found[n & 7] = (at, slots);
                n += 1;
                continue;
            }
        }
        let child = node.left as usize;
        let [a, b] = [0, 1].map(|side| &tree[child + side].cost);
        let (mut take, mut least) = (1, f32::INFINITY);
        for left_takes in 1..slots {
            let cost = a[left_takes - 1] + b[slots - left_takes - 1];
            if cost < least {
                (take, least) = (left_takes, cost);
            }
        }
        open[left & 7] = (child + 1, slots - take);
        open[(left + 1) & 7] = (child, take);
        left += 2;
    }
    (found, n)
}
