//! Which of many lights matters to a point: a tree over their places, directions and powers.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, with nodes
//! of up to sixteen children, of which one is chosen at a time.

pub(crate) mod build;
pub(crate) mod importance;
pub(crate) mod node;

use super::Reference;
use super::bounds::{Bounds, Reach};
use crate::light::tree::build::{around, grow};
use crate::light::tree::importance::Asker;
use crate::light::tree::node::{Below, Node, Place, Shares};

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

/// More than one light is chosen by so many numbers.
pub(crate) const MOST_AT_A_POINT: usize = 4;

impl Tree {
    pub fn new(lights: &[Bounds]) -> Self {
        let mut shining: Vec<u32> = (0..lights.len() as u32)
            .filter(|&i| lights[i as usize].intensity > 0.0)
            .collect();
        let nodes = match shining.is_empty() {
            true => vec![],
            false => grow(lights, &mut shining, 0),
        };
        let mut tree = Self {
            nodes,
            places: vec![None; lights.len()],
            all: (!shining.is_empty()).then(|| around(lights, shining.iter().copied()).reach()),
            count: shining.len(),
        };
        for node in 0..tree.nodes.len() {
            for child in 0..tree.nodes[node].below().len() {
                let place = Some(Place {
                    node: node as u32,
                    child: child as u32,
                });
                match tree.nodes[node].below()[child] {
                    Below::Light(light) => tree.places[light as usize] = place,
                    Below::Node(below) => tree.nodes[below as usize].above = place,
                }
            }
        }
        tree
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
