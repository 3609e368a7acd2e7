//! Which of many lights matters to a point: a tree over their places, directions and powers.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, with nodes
//! of up to sixteen children, of which one is chosen at a time.

use glam::Vec3;

use super::Reference;
use super::bounds::{Bounds, Reach};
use super::node::{Below, Node, Place, Shares};
use super::weights::Asker;
use crate::lanes::LANES;

/// Which light to choose for a point. Lights keep their numbers.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    /// The root first.
    nodes: Vec<Node>,
    /// Of each light; dark ones have none.
    places: Vec<Option<Place>>,
    /// Around all of them.
    all: Option<Reach>,
    /// How many shine.
    count: usize,
}

/// Lights of a node that is being built, up to an end, for one child.
struct Part {
    end: usize,
    bounds: Bounds,
    cost: f32,
}

/// More than one light is chosen by so many numbers.
pub(crate) const MOST_AT_A_POINT: usize = 4;

/// Below so many nodes, lights are halved by number: then trees are not deeper than lights are many.
const DEEP: u32 = 8;

impl Tree {
    pub fn new(lights: &[Bounds]) -> Self {
        let mut shining: Vec<u32> = (0..lights.len() as u32)
            .filter(|&i| lights[i as usize].intensity > 0.0)
            .collect();
        let mut tree = Self {
            nodes: vec![],
            places: vec![None; lights.len()],
            all: (!shining.is_empty()).then(|| around(lights, &shining).reach()),
            count: shining.len(),
        };
        if !shining.is_empty() {
            tree.build(lights, &mut shining, None, 0);
        }
        tree
    }

    /// Adds the node of a group and all below it.
    fn build(&mut self, lights: &[Bounds], group: &mut [u32], above: Option<Place>, depth: u32) {
        let at = self.nodes.len();
        self.nodes.push(Node::new(above));
        let part = |lights: &[Bounds], group: &[u32], end: usize| {
            let bounds = around(lights, group);
            let cost = if depth < DEEP { bounds.cost() } else { 0.0 };
            Part { end, bounds, cost }
        };
        let mut parts = vec![part(lights, group, group.len())];
        while parts.len() < LANES {
            let (mut most, mut start) = (None::<(f32, usize, usize, usize)>, 0);
            for (i, &Part { end, cost, .. }) in parts.iter().enumerate() {
                let count = end - start;
                if count > 1 && most.is_none_or(|(c, n, ..)| (cost, count) > (c, n)) {
                    most = Some((cost, count, i, start));
                }
                start = end;
            }
            let Some((_, count, i, start)) = most else {
                break;
            };
            let whole = &mut group[start..start + count];
            let middle = split(lights, whole, depth < DEEP);
            let (left, right) = whole.split_at(middle);
            parts[i] = part(lights, right, start + count);
            parts.insert(i, part(lights, left, start + middle));
        }
        let (mut rest, mut start) = (group, 0);
        for (child, Part { end, bounds, .. }) in parts.into_iter().enumerate() {
            let part;
            (part, rest) = rest.split_at_mut(end - start);
            start = end;
            let place = Place {
                node: at as u32,
                child: child as u32,
            };
            if let [only] = *part {
                self.places[only as usize] = Some(place);
                self.nodes[at].push(&bounds, Below::Light(only));
            } else {
                let below = Below::Node(self.nodes.len() as u32);
                self.nodes[at].push(&bounds, below);
                self.build(lights, part, Some(place), depth + 1);
            }
        }
    }

    /// Whether no light shines.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// How many lights shine.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Its only node, where it has no other.
    pub fn only_node(&self) -> Option<&Node> {
        match &*self.nodes {
            [node] => Some(node),
            _ => None,
        }
    }

    /// How much all of it may matter to a point.
    pub fn importance(&self, from: &Reference) -> f64 {
        let position = from.position.as_vec3();
        self.all
            .map_or(0.0, |all| f64::from(all.importance(position, from.normal)))
    }

    /// One of the lights by a number in 0..1, and its probability.
    pub fn choose(&self, from: &Asker, number: f64) -> Option<(usize, f64)> {
        if self.is_empty() {
            return None;
        }
        let root = from.shares(&self.nodes[0]);
        self.choose_below(&root, from, number)
    }

    /// The same, where the shares of the root's children are known.
    fn choose_below(&self, root: &Shares, from: &Asker, number: f64) -> Option<(usize, f64)> {
        let (mut child, mut probability, mut number) = root.choose(number)?;
        let mut at = 0;
        loop {
            match self.nodes[at as usize].below()[child] {
                Below::Light(light) => return Some((light as usize, probability)),
                Below::Node(next) => at = next,
            }
            let shares = from.shares(&self.nodes[at as usize]);
            let share;
            (child, share, number) = shares.choose(number)?;
            probability *= share;
        }
    }

    /// Several lights: all of them where they are at most [`MOST_AT_A_POINT`], else so many by numbers that are spread evenly
    /// from one. Tells of each with its number and how many of it are expected.
    pub fn choose_many(&self, from: &Asker, number: f64, mut tell: impl FnMut(usize, usize, f64)) {
        if self.is_empty() {
            return;
        }
        let root = from.shares(&self.nodes[0]);
        for index in 0..self.count.min(MOST_AT_A_POINT) {
            if self.count > MOST_AT_A_POINT {
                let number = (number + index as f64) / MOST_AT_A_POINT as f64;
                let chosen = self.choose_below(&root, from, number);
                if let Some((light, probability)) = chosen {
                    tell(index, light, probability * MOST_AT_A_POINT as f64);
                }
            } else if let Below::Light(light) = self.nodes[0].below()[index]
                && root.any(index)
            {
                tell(index, light as usize, 1.0);
            }
        }
    }

    /// The probability with which [`Tree::choose`] gives this light.
    pub fn probability(&self, from: &Asker, light: usize) -> f64 {
        let mut place = self.places[light];
        let mut probability = f64::from(u8::from(place.is_some()));
        while let Some(Place { node, child }) = place {
            probability *= from.shares(&self.nodes[node as usize]).of(child as usize);
            place = self.nodes[node as usize].above;
        }
        probability
    }

    /// How many of this light are expected of [`Tree::choose_many`].
    pub fn expected(&self, from: &Asker, light: usize) -> f64 {
        let probability = self.probability(from, light);
        match self.count > MOST_AT_A_POINT {
            true => probability * MOST_AT_A_POINT as f64,
            false => f64::from(u8::from(probability > 0.0)),
        }
    }
}

/// Around all lights of a group.
fn around(lights: &[Bounds], group: &[u32]) -> Bounds {
    let bounds = group.iter().map(|&i| lights[i as usize]);
    bounds.reduce(|a, b| a.union(&b)).unwrap_or_default()
}

/// Parts a group in two by the cheapest of twelve planes along each axis, or by number where it has no planes, and says
/// where the second part begins.
fn split(lights: &[Bounds], group: &mut [u32], planes: bool) -> usize {
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
    if !planes || size.max_element() <= 0.0 {
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
