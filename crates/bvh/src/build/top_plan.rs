//! Wide nodes above the treelets, planned before the treelets are built, so that the number of children which each
//! treelet may give to the node above is known.

use crate::build::collapse::{BinaryNode, collapse, distribute_cost, make_wide_node, select_children};
use crate::build::concat::{ConcatenatedTree, build_and_concat};
use crate::build::prim_ref::{EMPTY_BOUNDS, PackedBounds, PrimRef, unpack_bounds};
use crate::build::traits::{BuildContext, BuiltBvh, LeafBuilder};
use crate::build::treelet::{PrimGenerator, SubtreeRoot, TreeletDesc, TreeletJob, TreeletPrims};
use crate::node::{NodeBlock, NodeRef};
use crate::simd::Portable;

/// Expected surface area of each half of a split box, as a fraction of the whole box's area: the value for slanted
/// surfaces.
const HALVING_AREA_RATIO: f32 = 0.6;

/// The binary tree above the treelets.
pub enum TopNode {
    Split([f32; 8], Box<[TopNode; 2]>),
    Treelet(TreeletDesc),
}

/// Input of one or several treelets, in their order.
pub enum TreeletInput<'a> {
    /// Primitives of several treelets, one after the other.
    Prims(Vec<PrimRef>),
    /// Primitives of one treelet, generated when it is built.
    Deferred(Box<PrimGenerator<'a>>),
}

/// A child of a planned wide node.
#[derive(Clone, Copy)]
enum Child {
    /// Index of another planned node.
    Node(usize),
    /// Index of a treelet, whose roots become children of the node.
    Treelet(usize),
}

/// The plan of the wide nodes above the treelets.
pub struct TopPlan {
    binary: Vec<BinaryNode>,
    treelets: Vec<TreeletDesc>,
    /// Number of children that each treelet may give to the node above it.
    child_slots: Vec<usize>,
    /// Wide nodes, parents before children.
    nodes: Vec<Vec<Child>>,
}

impl TopPlan {
    /// Plans the wide nodes with the least expected cost; `usual` is the typical number of primitives in a leaf.
    pub fn new(top: TopNode, usual: usize) -> TopPlan {
        let mut plan = TopPlan { binary: vec![], treelets: vec![], child_slots: vec![], nodes: vec![] };
        plan.flatten(top);
        let TopPlan { binary, treelets, .. } = &mut plan;
        let costs = expected_costs(usual);
        collapse::<Portable>(binary, |node| costs(treelets[node.first as usize].count), |_| false);
        plan.child_slots = vec![1; plan.treelets.len()];
        if plan.treelets.len() > 1 {
            plan.plan_node(0);
        }
        plan
    }

    /// Lists the binary nodes, parents before children, and the treelets in the order of their primitives.
    fn flatten(&mut self, top: TopNode) {
        let mut open = vec![(top, 0)];
        self.binary.push(BinaryNode::default());
        while let Some((top, at)) = open.pop() {
            match top {
                TopNode::Split(bounds, halves) => {
                    let child = self.binary.len();
                    self.binary.push(BinaryNode::default());
                    self.binary.push(BinaryNode::default());
                    self.binary[at] = BinaryNode::inner(bounds, child as u32);
                    let [a, b] = *halves;
                    open.push((b, child + 1));
                    open.push((a, child));
                }
                TopNode::Treelet(part) => {
                    let number = self.treelets.len() as u32;
                    self.binary[at] = BinaryNode::leaf(part.bounds, number, 1);
                    self.treelets.push(part);
                }
            }
        }
    }

    /// Plans the wide node of a binary node and all wide nodes below; returns the index of that wide node.
    fn plan_node(&mut self, at: usize) -> usize {
        let index = self.nodes.len();
        self.nodes.push(vec![]);
        let (found, n) = select_children(&self.binary, at, 8, true);
        for (binary, child_slots) in found.into_iter().take(n) {
            let child = if self.binary[binary].leaf {
                let treelet = self.binary[binary].first as usize;
                self.child_slots[treelet] = child_slots;
                Child::Treelet(treelet)
            } else {
                Child::Node(self.plan_node(binary))
            };
            self.nodes[index].push(child);
        }
        index
    }

    /// Builds the treelets, and joins them into the tree.
    pub fn build_tree<L: LeafBuilder>(&self, mut inputs: Vec<TreeletInput>, shared: &BuildContext<L>) -> BuiltBvh {
        let mut jobs = Vec::with_capacity(self.treelets.len());
        let mut next = self.treelets.iter().zip(self.child_slots.iter().copied());
        for input in &mut inputs {
            match input {
                TreeletInput::Deferred(make) => {
                    let made = next.next();
                    jobs.extend(made.map(|(desc, child_slots)| TreeletJob {
                        prims: TreeletPrims::Deferred(make),
                        desc,
                        child_slots,
                    }));
                }
                TreeletInput::Prims(prims) => {
                    let mut prims = prims.as_mut_slice();
                    while !prims.is_empty()
                        && let Some((desc, child_slots)) = next.next()
                    {
                        let (here, rest) = prims.split_at_mut(desc.count);
                        jobs.push(TreeletJob { prims: TreeletPrims::Refs(here), desc, child_slots });
                        prims = rest;
                    }
                }
            }
        }
        let ConcatenatedTree { mut blocks, ids, roots } = build_and_concat(jobs, self.nodes.len(), shared);
        // A plan without nodes consists of a single treelet with a single root.
        let root = match self.nodes.is_empty() {
            true => roots[0][0],
            false => self.write_nodes(&roots, &mut blocks),
        };
        let bounds = unpack_bounds(&root.bounds);
        BuiltBvh { blocks, root: root.reference, ids, bounds }
    }

    /// Writes the planned nodes above the roots of the treelets; returns the root.
    fn write_nodes(&self, roots: &[Vec<SubtreeRoot>], blocks: &mut [NodeBlock]) -> SubtreeRoot {
        let mut wholes = vec![EMPTY_BOUNDS; self.nodes.len()];
        let mut below = vec![];
        for (index, children) in self.nodes.iter().enumerate().rev() {
            below.clear();
            for child in children {
                match *child {
                    Child::Node(child) => below.push((wholes[child], NodeRef::node(child))),
                    Child::Treelet(treelet) => {
                        let roots = roots[treelet].iter();
                        below.extend(roots.map(|root| (root.bounds, root.reference)));
                    }
                }
            }
            let node = make_wide_node(&below);
            let whole =
                below.iter().fold(EMPTY_BOUNDS, |whole, (bounds, _)| std::array::from_fn(|i| whole[i].min(bounds[i])));
            (blocks[index], wholes[index]) = (NodeBlock { node }, whole);
        }
        SubtreeRoot { bounds: wholes[0], reference: NodeRef::node(0) }
    }
}

/// Expected cost per area of a treelet as 1 to 8 children, by its number of primitives. The treelet is assumed to be
/// halved until its leaves contain `usual` primitives.
fn expected_costs(usual: usize) -> impl Fn(usize) -> PackedBounds {
    let mut halved = vec![[1.0; 8]];
    for _ in 0..usize::BITS {
        let half = halved[halved.len() - 1].map(|cost| cost * HALVING_AREA_RATIO);
        let mut cost = distribute_cost::<Portable>(&half, &half);
        cost[0] = cost[7] + 1.0;
        for k in 1..8 {
            cost[k] = cost[k].min(cost[k - 1]);
        }
        halved.push(cost);
    }
    move |prims| {
        let levels = (prims as f32 / usual as f32).log2().round();
        halved[levels.max(0.0) as usize]
    }
}
