//! Which of many lights matters to a point: a tree over their places, directions and powers.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, with nodes
//! of up to sixteen children, of which one is chosen at a time.

pub(crate) mod build;
pub(crate) mod importance;
pub(crate) mod node;

use crate::interaction::LightSampleContext;
use crate::light::bounds::{LightBounds, PreparedLightBounds};
use crate::light::tree::build::{build_node, union_of};
use crate::light::tree::importance::LightTreeContext;
use crate::light::tree::node::{Child, ChildProbabilities, LightTreeNode, SurfaceInteraction};

/// Which light to choose for a point. Lights keep their numbers.
#[derive(Debug, Default)]
pub(crate) struct LightTree {
    /// The root first.
    nodes: Vec<LightTreeNode>,
    /// Of each light; dark ones have none.
    parents: Vec<Option<SurfaceInteraction>>,
    /// Around all of them.
    bounds: Option<PreparedLightBounds>,
    /// How many shine.
    count: usize,
}

/// More than one light is chosen by so many numbers.
pub(crate) const MAX_SPLIT_LIGHTS: usize = 4;

impl LightTree {
    pub fn new(lights: &[LightBounds]) -> Self {
        let mut shining: Vec<u32> = (0..lights.len() as u32)
            .filter(|&i| lights[i as usize].phi > 0.0)
            .collect();
        let nodes = match shining.is_empty() {
            true => vec![],
            false => build_node(lights, &mut shining, 0),
        };
        let mut tree = Self {
            nodes,
            parents: vec![None; lights.len()],
            bounds: (!shining.is_empty())
                .then(|| union_of(lights, shining.iter().copied()).prepare()),
            count: shining.len(),
        };
        for node in 0..tree.nodes.len() {
            for child in 0..tree.nodes[node].children().len() {
                let place = Some(SurfaceInteraction {
                    node: node as u32,
                    child: child as u32,
                });
                match tree.nodes[node].children()[child] {
                    Child::Light(light) => tree.parents[light as usize] = place,
                    Child::Node(below) => tree.nodes[below as usize].parent = place,
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
    pub fn only_node(&self) -> Option<&LightTreeNode> {
        match &*self.nodes {
            [node] => Some(node),
            _ => None,
        }
    }

    /// How much all of it may matter to a point.
    pub fn importance(&self, from: &LightSampleContext) -> f64 {
        let position = from.position.as_vec3();
        self.bounds
            .map_or(0.0, |all| f64::from(all.importance(position, from.normal)))
    }

    /// One of the lights by a number in 0..1, and its probability.
    pub fn sample(&self, from: &LightTreeContext, number: f64) -> Option<(usize, f64)> {
        if self.is_empty() {
            return None;
        }
        let root = from.child_probabilities(&self.nodes[0]);
        self.sample_below(&root, from, number)
    }

    /// The same, where the shares of the root's children are known.
    fn sample_below(
        &self,
        root: &ChildProbabilities,
        from: &LightTreeContext,
        number: f64,
    ) -> Option<(usize, f64)> {
        let (mut child, mut probability, mut number) = root.sample(number)?;
        let mut at = 0;
        loop {
            match self.nodes[at as usize].children()[child] {
                Child::Light(light) => return Some((light as usize, probability)),
                Child::Node(next) => at = next,
            }
            let shares = from.child_probabilities(&self.nodes[at as usize]);
            let share;
            (child, share, number) = shares.sample(number)?;
            probability *= share;
        }
    }

    /// Several lights: all of them where they are at most [`MAX_SPLIT_LIGHTS`], else so many by numbers that are spread evenly
    /// from one. Tells of each with its number and how many of it are expected.
    pub fn sample_split(
        &self,
        from: &LightTreeContext,
        number: f64,
        mut tell: impl FnMut(usize, usize, f64),
    ) {
        if self.is_empty() {
            return;
        }
        let root = from.child_probabilities(&self.nodes[0]);
        for index in 0..self.count.min(MAX_SPLIT_LIGHTS) {
            if self.count > MAX_SPLIT_LIGHTS {
                let number = (number + index as f64) / MAX_SPLIT_LIGHTS as f64;
                let chosen = self.sample_below(&root, from, number);
                if let Some((light, probability)) = chosen {
                    tell(index, light, probability * MAX_SPLIT_LIGHTS as f64);
                }
            } else if let Child::Light(light) = self.nodes[0].children()[index]
                && root.is_possible(index)
            {
                tell(index, light as usize, 1.0);
            }
        }
    }

    /// The probability with which [`LightTree::sample`] gives this light.
    pub fn pmf(&self, from: &LightTreeContext, light: usize) -> f64 {
        let mut place = self.parents[light];
        let mut probability = f64::from(u8::from(place.is_some()));
        while let Some(SurfaceInteraction { node, child }) = place {
            probability *= from
                .child_probabilities(&self.nodes[node as usize])
                .probability(child as usize);
            place = self.nodes[node as usize].parent;
        }
        probability
    }

    /// How many of this light are expected of [`LightTree::sample_split`].
    pub fn expected_count(&self, from: &LightTreeContext, light: usize) -> f64 {
        let probability = self.pmf(from, light);
        match self.count > MAX_SPLIT_LIGHTS {
            true => probability * MAX_SPLIT_LIGHTS as f64,
            false => f64::from(u8::from(probability > 0.0)),
        }
    }
}
