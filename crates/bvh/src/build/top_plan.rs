//! The nodes above the treelets, planned before those are built: how many children each of them gives the node above.

use crate::build::collapse::{Binary, apart, children, collapse, wide};
use crate::build::concat::{Joined, join};
use crate::build::prim_ref::{Item, NOTHING, Octet, corners};
use crate::build::treelet::{Batch, Make, Part, Root};
use crate::build::{Leaves, Shared, Tree};
use crate::node::NodeBlock;
use crate::simd::Portable;

/// The box of each half of what is halved, beside the box of the whole: of surfaces at an angle.
const HALF: f32 = 0.6;

/// The tree above the treelets, halved anew at each step.
pub enum Top {
    Split([f32; 8], Box<[Top; 2]>),
    Part(Part),
}

/// What the treelets are made of, in their order.
pub enum Stock<'a> {
    /// The items of some, those of each together.
    Items(Vec<Item>),
    /// The items of one are made when they are needed.
    Made(Box<Make<'a>>),
}

/// What a wide node is made of.
#[derive(Clone, Copy)]
enum Child {
    /// Another.
    Node(usize),
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
                    self.binary[at] = Binary::leaf(part.bounds, number, 1);
                    self.parts.push(part);
                }
            }
        }
    }

    /// Makes a binary node a wide one, with those below; its index.
    fn node(&mut self, at: usize) -> usize {
        let index = self.nodes.len();
        self.nodes.push(vec![]);
        let (found, n) = children(&self.binary, at, 8, true);
        for (binary, places) in found.into_iter().take(n) {
            let child = if self.binary[binary].leaf {
                let treelet = self.binary[binary].first as usize;
                self.places[treelet] = places;
                Child::Treelet(treelet)
            } else {
                Child::Node(self.node(binary))
            };
            self.nodes[index].push(child);
        }
        index
    }

    /// Builds the treelets; the tree.
    pub fn tree<L: Leaves>(&self, mut stocks: Vec<Stock>, shared: &Shared<L>) -> Tree {
        let mut jobs = Vec::with_capacity(self.parts.len());
        let mut next = self.parts.iter().zip(self.places.iter().copied());
        for stock in &mut stocks {
            match stock {
                Stock::Made(make) => {
                    let made = next.next();
                    jobs.extend(made.map(|(part, places)| (Batch::Made(make), part, places)));
                }
                Stock::Items(items) => {
                    let mut items = items.as_mut_slice();
                    while !items.is_empty()
                        && let Some((part, places)) = next.next()
                    {
                        let (here, rest) = items.split_at_mut(part.count);
                        jobs.push((Batch::Items(here), part, places));
                        items = rest;
                    }
                }
            }
        }
        let Joined {
            mut blocks,
            ids,
            roots,
        } = join(jobs, self.nodes.len(), shared);
        // A plan without nodes has one treelet, which takes one place.
        let root = match self.nodes.is_empty() {
            true => roots[0][0],
            false => self.top(&roots, &mut blocks),
        };
        let (lower, upper) = corners(&root.bounds);
        Tree {
            blocks,
            root: root.reference,
            ids,
            lower,
            upper,
        }
    }

    /// Writes the nodes above the treelets, whose roots are given; the first.
    fn top(&self, roots: &[Vec<Root>], blocks: &mut [NodeBlock]) -> Root {
        let mut wholes = vec![NOTHING; self.nodes.len()];
        let mut below = vec![];
        for (index, children) in self.nodes.iter().enumerate().rev() {
            below.clear();
            for child in children {
                match *child {
                    Child::Node(child) => below.push((wholes[child], child as u32)),
                    Child::Treelet(treelet) => {
                        let roots = roots[treelet].iter();
                        below.extend(roots.map(|root| (root.bounds, root.reference)));
                    }
                }
            }
            let node = wide(&below);
            let whole = below.iter().fold(NOTHING, |whole, (bounds, _)| {
                std::array::from_fn(|i| whole[i].min(bounds[i]))
            });
            (blocks[index], wholes[index]) = (NodeBlock { node }, whole);
        }
        Root {
            bounds: wholes[0],
            reference: 0,
        }
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
