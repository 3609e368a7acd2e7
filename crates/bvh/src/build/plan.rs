//! The nodes above the treelets, planned before those are built: how many children each of them gives the node above.

use rayon::prelude::*;

use super::collapse::{Binary, apart, children, collapse};
use super::item::{Item, Octet, corners};
use super::treelet::{Part, Treelet};
use super::{Leaves, Shared};
use crate::block::{Block, Node};
use crate::memory::Pages;
use crate::simd::Portable;

/// The box of each half of what is halved, beside the box of the whole: of surfaces at an angle.
const HALF: f32 = 0.6;

/// The tree above the treelets, halved anew at each step.
pub enum Top {
    Split([f32; 8], Box<[Top; 2]>),
    Part(Part),
}

/// What a wide node is made of.
#[derive(Clone, Copy)]
enum Child {
    /// Another, and the binary node that became it.
    Node { index: usize, binary: usize },
    /// Those that a treelet gives.
    Treelet(usize),
}

/// What stands above the treelets.
pub struct Plan {
    binary: Vec<Binary>,
    parts: Vec<Part>,
    /// How many places each treelet takes.
    places: Vec<usize>,
    /// The wide nodes, parents before children.
    nodes: Vec<Vec<Child>>,
}

impl Plan {
    /// Folds the top at the least expected cost, where leaves hold about `usual` items.
    pub fn of(top: Top, usual: usize) -> Plan {
        let mut plan = Plan {
            binary: vec![],
            parts: vec![],
            places: vec![],
            nodes: vec![],
        };
        plan.flatten(top);
        let Plan { binary, parts, .. } = &mut plan;
        let costs = expected_costs(usual);
        collapse::<Portable>(
            binary,
            |node| costs(parts[node.first as usize].count),
            |_| false,
        );
        plan.places = vec![1; plan.parts.len()];
        if plan.parts.len() > 1 {
            plan.node(0);
        }
        plan
    }

    /// Lists the binary nodes, parents before children, and the parts in the order of their items.
    fn flatten(&mut self, top: Top) {
        let mut open = vec![(top, 0)];
        self.binary.push(Binary::default());
        while let Some((top, at)) = open.pop() {
            match top {
                Top::Split(bounds, halves) => {
                    let child = self.binary.len();
                    self.binary.push(Binary::default());
                    self.binary.push(Binary::default());
                    self.binary[at] = Binary::inner(bounds, child as u32);
                    let [a, b] = *halves;
                    open.push((b, child + 1));
                    open.push((a, child));
                }
                Top::Part(part) => {
                    let number = self.parts.len() as u32;
                    self.binary[at] = Binary::leaf(part.range.bounds, number, 1);
                    self.parts.push(part);
                }
            }
        }
    }

    /// Makes a binary node a wide one, with those below; its index.
    fn node(&mut self, at: usize) -> usize {
        let index = self.nodes.len();
        self.nodes.push(vec![]);
        for (binary, places) in children(&self.binary, at, 8, true) {
            let child = if self.binary[binary].leaf {
                let treelet = self.binary[binary].first as usize;
                self.places[treelet] = places;
                Child::Treelet(treelet)
            } else {
                let index = self.node(binary);
                Child::Node { index, binary }
            };
            self.nodes[index].push(child);
        }
        index
    }

    /// Builds the treelets.
    pub fn treelets<L: Leaves>(&self, mut items: &mut [Item], shared: &Shared<L>) -> Vec<Treelet> {
        let mut parts = Vec::with_capacity(self.parts.len());
        for (part, places) in self.parts.iter().zip(&self.places) {
            let (here, rest) = items.split_at_mut(part.count);
            parts.push((here, part, *places));
            items = rest;
        }
        parts
            .into_par_iter()
            .map(|(items, part, places)| Treelet::build(items, part, places, shared))
            .collect()
    }

    /// All blocks, the reference of the root, and all ids.
    pub fn join<L: Leaves>(&self, mut treelets: Vec<Treelet>) -> (Pages<Block>, u32, Vec<u32>) {
        let mut blocks = self.nodes.len();
        let mut ids = Vec::with_capacity(treelets.iter().map(|treelet| treelet.ids.len()).sum());
        let mut starts = Vec::with_capacity(treelets.len());
        for treelet in &treelets {
            starts.push((blocks as u32, ids.len() as u32));
            blocks += treelet.blocks.len();
            ids.extend_from_slice(&treelet.ids);
        }
        let moved = treelets.par_iter_mut().zip(starts);
        moved.for_each(|(treelet, (base, first))| treelet.relocate::<L>(base, first));
        // A plan without nodes has one treelet, which takes one place.
        let root = match self.nodes.is_empty() {
            true => treelets[0].roots[0].reference,
            false => 0,
        };
        let top = self.nodes.iter().map(|node| self.block(node, &treelets));
        let mut parts = vec![top.collect()];
        parts.extend(treelets.into_iter().map(|treelet| treelet.blocks));
        // Treelets go as they are copied: never is everything there twice.
        (Pages::collect(blocks, parts), root, ids)
    }

    fn block(&self, children: &[Child], treelets: &[Treelet]) -> Block {
        let mut node = Node::EMPTY;
        let mut push = |bounds: &Octet, reference: u32| {
            let (lower, upper) = corners(bounds);
            node.push(lower, upper, reference);
        };
        for child in children {
            match *child {
                Child::Node { index, binary } => push(&self.binary[binary].bounds, index as u32),
                Child::Treelet(treelet) => {
                    for root in &treelets[treelet].roots {
                        push(&root.bounds, root.reference);
                    }
                }
            }
        }
        Block { node }
    }
}

/// By the number of items of a treelet: what it costs, for its box's area, as 1 to 8 children, if it is halved down to
/// leaves of `usual` items.
fn expected_costs(usual: usize) -> impl Fn(usize) -> Octet {
    let mut halved = vec![[1.0; 8]];
    for _ in 0..usize::BITS {
        let half = halved[halved.len() - 1].map(|cost| cost * HALF);
        let mut cost = apart::<Portable>(&half, &half);
        cost[0] = cost[7] + 1.0;
        for k in 1..8 {
            cost[k] = cost[k].min(cost[k - 1]);
        }
        halved.push(cost);
    }
    move |items| {
        let levels = (items as f32 / usual as f32).log2().round();
        halved[levels.max(0.0) as usize]
    }
}
