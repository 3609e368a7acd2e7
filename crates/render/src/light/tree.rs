//! Which of many lights matters to a point: a tree over their places, directions and powers.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018: one light at
//! a time, or one of each of the branches that matter most.

use glam::Vec3;

use super::Reference;
use super::bounds::Bounds;

/// Who says what nodes may matter to a point.
pub(crate) trait Weigh {
    /// The importance of a node: 0 only where none of its lights has any. Of two lights it is 0 wherever neither has any.
    fn importance_of(&self, tree: &Tree, node: usize) -> f32;
}

/// A node: of two children, the first is the next node; or of one light.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Where the second child is.
    Inner(u32),
    Leaf(u32),
}

/// Which light to choose for a point. Lights keep their numbers.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// The way from the root to each light, from the lowest bit up: 0 for the first child. Dark lights have none.
    ways: Vec<Option<u64>>,
}

/// Branches of a [`Tree`] that together hold all lights that matter to a point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Branches {
    nodes: [u32; MOST_BRANCHES],
    count: usize,
}

impl Branches {
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }
}

/// A tree is split into no more branches.
pub(crate) const MOST_BRANCHES: usize = 4;

/// Deeper nodes are halved by number, so that a way fits into 64 bits.
const DEEP: u32 = 30;

impl Tree {
    pub fn new(lights: &[Bounds]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * lights.len()),
            ways: vec![None; lights.len()],
        };
        let mut shining: Vec<u32> = (0..lights.len() as u32)
            .filter(|&i| lights[i as usize].intensity > 0.0)
            .collect();
        if !shining.is_empty() {
            tree.build(lights, &mut shining, 0, 0);
        }
        tree
    }

    fn build(&mut self, lights: &[Bounds], group: &mut [u32], depth: u32, way: u64) {
        let bounds = group
            .iter()
            .map(|&i| lights[i as usize])
            .reduce(|a, b| a.union(&b))
            .unwrap_or_default();
        let at = self.nodes.len();
        if let [only] = *group {
            self.ways[only as usize] = Some(way);
            self.nodes.push(Node {
                bounds,
                kind: Kind::Leaf(only),
            });
            return;
        }
        let middle = split(lights, group, depth);
        self.nodes.push(Node {
            bounds,
            kind: Kind::Inner(0),
        });
        let (first, second) = group.split_at_mut(middle);
        self.build(lights, first, depth + 1, way);
        self.nodes[at].kind = Kind::Inner(self.nodes.len() as u32);
        self.build(lights, second, depth + 1, way | 1 << depth);
    }

    /// Whether no light shines.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// How many nodes it has, the root first and every parent before its children.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Of all lights below a node.
    #[inline(always)]
    pub fn bounds(&self, node: usize) -> Bounds {
        self.nodes[node].bounds
    }

    /// The lights of a node that has two.
    #[inline(always)]
    pub fn pair(&self, node: usize) -> Option<[usize; 2]> {
        let Kind::Inner(second) = self.nodes[node].kind else {
            return None;
        };
        let pair = [node + 1, second as usize];
        let is_light = |node: usize| matches!(self.nodes[node].kind, Kind::Leaf(_));
        pair.into_iter().all(is_light).then_some(pair)
    }

    /// Whether it has so few nodes that all of them are weighed for many points at a time.
    pub fn is_small(&self) -> bool {
        self.nodes.len() < FEW
    }

    /// How many lights shine.
    pub fn count(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// How much all of it may matter to a point.
    pub fn importance(&self, from: &Reference) -> f64 {
        let position = from.position.as_vec3();
        self.nodes.first().map_or(0.0, |root| {
            f64::from(root.bounds.importance(position, from.normal))
        })
    }

    /// What the tree is split into for a point: again and again the branch that may matter most, until there are enough.
    pub fn branches(&self, from: &impl Weigh) -> Branches {
        let importance = |node| (node, from.importance_of(self, node));
        let mut found = [(0, 0.0); MOST_BRANCHES];
        let mut count = 0;
        if !self.is_empty() {
            found[0] = importance(0);
            count = usize::from(found[0].1 > 0.0);
        }
        while count < MOST_BRANCHES {
            let inner = |&i: &usize| matches!(self.nodes[found[i].0].kind, Kind::Inner(_));
            let most = (0..count)
                .filter(inner)
                .max_by(|&a, &b| found[a].1.total_cmp(&found[b].1));
            let Some(most) = most else { break };
            let (node, _) = found[most];
            let Kind::Inner(second) = self.nodes[node].kind else {
                break;
            };
            count -= 1;
            found[most] = found[count];
            for child in [node + 1, second as usize].map(importance) {
                if child.1 > 0.0 {
                    found[count] = child;
                    count += 1;
                }
            }
        }
        Branches {
            nodes: found.map(|(node, _)| node as u32),
            count,
        }
    }

    /// A light of the whole tree by a number in 0..1, and its probability.
    pub fn choose(&self, from: &impl Weigh, number: f64) -> Option<(usize, f64)> {
        self.choose_in(0, from, number)
    }

    /// The same in the branch below a node.
    pub fn choose_in(&self, node: u32, from: &impl Weigh, mut number: f64) -> Option<(usize, f64)> {
        let mut at = node as usize;
        let mut probability = 1.0;
        loop {
            match self.nodes.get(at)?.kind {
                Kind::Leaf(light) => return Some((light as usize, probability)),
                Kind::Inner(second) => {
                    let share = self.share(at, second as usize, from)?;
                    if number < share {
                        number /= share;
                        probability *= share;
                        at += 1;
                    } else {
                        number = (number - share) / (1.0 - share);
                        probability *= 1.0 - share;
                        at = second as usize;
                    }
                }
            }
        }
    }

    /// The probability with which [`Tree::choose`] gives this light.
    pub fn probability(&self, from: &Reference, light: usize) -> f64 {
        self.probability_in(&[0], from, light)
    }

    /// The probability with which [`Tree::choose_in`] gives this light in that of some branches that holds it.
    pub fn probability_in(&self, branches: &[u32], from: &Reference, light: usize) -> f64 {
        let Some(mut way) = self.ways[light] else {
            return 0.0;
        };
        let mut at = 0;
        let mut probability = branches.contains(&0).then_some(1.0);
        while let Kind::Inner(second) = self.nodes[at].kind {
            let first = way & 1 == 0;
            if let Some(probability) = &mut probability {
                let Some(share) = self.share(at, second as usize, from) else {
                    return 0.0;
                };
                *probability *= if first { share } else { 1.0 - share };
            }
            at = if first { at + 1 } else { second as usize };
            way >>= 1;
            if branches.contains(&(at as u32)) {
                probability = Some(1.0);
            }
        }
        probability.unwrap_or(0.0)
    }

    /// The first child's share of a node; `None` where neither matters.
    fn share(&self, at: usize, second: usize, from: &impl Weigh) -> Option<f64> {
        let [a, b] = [at + 1, second].map(|node| f64::from(from.importance_of(self, node)));
        (a + b > 0.0).then(|| a / (a + b))
    }
}

impl Weigh for Reference {
    fn importance_of(&self, tree: &Tree, node: usize) -> f32 {
        let of = |node: usize| {
            let bounds = &tree.nodes[node].bounds;
            bounds.importance(self.position.as_vec3(), self.normal)
        };
        let importance = of(node);
        match tree.pair(node) {
            Some([a, b]) if importance > 0.0 && of(a) == 0.0 && of(b) == 0.0 => 0.0,
            _ => importance,
        }
    }
}

/// Trees of fewer nodes are weighed whole for many points at a time.
const FEW: usize = 32;

/// Parts a group in two by the cheapest of twelve planes along each axis, and says where the second part begins.
fn split(lights: &[Bounds], group: &mut [u32], depth: u32) -> usize {
    const BINS: usize = 12;
    let half = group.len() / 2;
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = group
        .iter()
        .map(|&i| center(i))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), c| {
            (low.min(c), high.max(c))
        });
    let size = high - low;
    if depth >= DEEP || size.max_element() <= 0.0 {
        return half;
    }
    let bin = |i: u32, axis: usize| {
        let place = (center(i)[axis] - low[axis]) / size[axis];
        ((place * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        let mut bins: [Option<Bounds>; BINS] = [None; BINS];
        for &i in &*group {
            let light = &lights[i as usize];
            let bin = &mut bins[bin(i, axis)];
            *bin = Some(bin.map_or(*light, |bounds| bounds.union(light)));
        }
        // Thin boxes are cheap to cut along their length alone.
        let stretch = size.max_element() / size[axis];
        let merge = |a: Option<Bounds>, b: &Option<Bounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(b)),
            (a, b) => a.or(*b),
        };
        for plane in 1..BINS {
            let [left, right] =
                [&bins[..plane], &bins[plane..]].map(|part| part.iter().fold(None, merge));
            let (Some(left), Some(right)) = (left, right) else {
                continue;
            };
            let cost = stretch * (left.cost() + right.cost());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, plane));
            }
        }
    }
    let Some((_, axis, plane)) = best else {
        return half;
    };
    // Stable: the tree depends on the order of the lights alone.
    group.sort_by_key(|&i| bin(i, axis) >= plane);
    group.partition_point(|&i| bin(i, axis) < plane)
}
