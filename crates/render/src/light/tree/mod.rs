//! Light tree: selects lights by importance at a point, from bounds on position, direction and power.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, with
//! nodes of up to sixteen children. The descent ends early if the lights below are far away and face one direction;
//! they are then selected by power.

pub(crate) mod build;
pub(crate) mod importance;
pub(crate) mod node;
mod power_table;
mod recent_nodes;

use crate::interaction::LightSampleContext;
use crate::light::bounds::{LightBounds, PreparedLightBounds};
use crate::light::tree::build::{build_node, union_of};
use crate::light::tree::importance::LightTreeContext;
use crate::light::tree::node::{Child, LightTreeNode, ParentLink};
use crate::light::tree::power_table::PowerTable;
pub(crate) use crate::light::tree::recent_nodes::RecentNodes;

/// Tree over the bounds of lights; the light indices refer to the input.
#[derive(Debug, Default)]
pub(crate) struct LightTree {
    /// Nodes of the tree; the root is the first.
    nodes: Vec<LightTreeNode>,
    /// Parent link of each light; none for lights without power.
    parents: Vec<Option<ParentLink>>,
    /// Lights in the order of the leaves.
    powers: PowerTable,
    /// Common bounds of all lights; `None` for a tree without lights.
    bounds: Option<PreparedLightBounds>,
    /// Number of lights with power.
    count: usize,
}

/// Maximum number of lights that [`LightTree::sample_split`] selects.
pub(crate) const MAX_SPLIT_LIGHTS: usize = 4;

impl LightTree {
    pub fn new(lights: &[LightBounds]) -> Self {
        let mut emitting: Vec<u32> = (0..lights.len() as u32).filter(|&i| lights[i as usize].phi > 0.0).collect();
        let nodes = match emitting.is_empty() {
            true => vec![],
            false => build_node(lights, &mut emitting, 0),
        };
        let mut tree = Self {
            nodes,
            parents: vec![None; lights.len()],
            powers: PowerTable::new(lights.len()),
            bounds: (!emitting.is_empty()).then(|| union_of(lights, emitting.iter().copied()).prepare()),
            count: emitting.len(),
        };
        for node in 0..tree.nodes.len() {
            for child in 0..tree.nodes[node].children().len() {
                let link = Some(ParentLink { node: node as u32, child: child as u32 });
                match tree.nodes[node].children()[child] {
                    Child::Light(light) => tree.parents[light as usize] = link,
                    Child::Node(below) => tree.nodes[below as usize].parent = link,
                }
            }
        }
        if !tree.nodes.is_empty() {
            tree.fill_powers(0, lights);
        }
        tree
    }

    /// Appends the lights below a node to the power table.
    fn fill_powers(&mut self, node: usize, lights: &[LightBounds]) {
        for child in 0..self.nodes[node].children().len() {
            let start = self.powers.len();
            match self.nodes[node].children()[child] {
                Child::Light(light) => self.powers.push(light, lights[light as usize].phi),
                Child::Node(below) => self.fill_powers(below as usize, lights),
            }
            self.nodes[node].lights[child] = [start, self.powers.len()];
        }
    }

    /// True if the lights below a child are sampled only by power, because they are far from the point.
    fn is_far(&self, from: &LightTreeContext, node: u32, child: usize) -> bool {
        let node = &self.nodes[node as usize];
        let is_node = matches!(node.children()[child], Child::Node(_));
        is_node && node.child_bounds(child).is_far(from.from.position.as_vec3())
    }

    /// True if no light has power.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of lights with power.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Maximum intensity of each light, summed over all lights and colour channels, in W/sr.
    pub fn phi(&self) -> f64 {
        self.bounds.map_or(0.0, |all| f64::from(all.phi))
    }

    /// The root of a tree that consists of one node.
    pub fn only_node(&self) -> Option<&LightTreeNode> {
        match &*self.nodes {
            [node] => Some(node),
            _ => None,
        }
    }

    /// Importance of all lights together at a point.
    pub fn importance(&self, from: &LightSampleContext) -> f64 {
        let position = from.position.as_vec3();
        self.bounds.map_or(0.0, |all| f64::from(all.importance(position, from.normal)))
    }

    /// Samples a light by a number in 0..1; returns the light and its probability. For several numbers at the same
    /// point, `recent` contains the nodes of the previous descent.
    pub fn sample(
        &self,
        from: &LightTreeContext,
        number: f64,
        recent: Option<&mut RecentNodes>,
    ) -> Option<(usize, f64)> {
        let compute = |node: u32| from.child_probabilities(&self.nodes[node as usize]);
        match recent {
            None => self.descend(from, number, |_, node, number| compute(node).sample(number)),
            Some(recent) => self.descend(from, number, |level, node, number| {
                recent.get_or_compute(level, node, compute).sample(number)
            }),
        }
    }

    /// Descends from the root to a light. `sample_child` receives a node's level and index and a number in 0..1, and
    /// returns the same as [`node::ChildProbabilities::sample`].
    #[inline(always)]
    fn descend(
        &self,
        from: &LightTreeContext,
        mut number: f64,
        mut sample_child: impl FnMut(usize, u32, f64) -> Option<(usize, f64, f64)>,
    ) -> Option<(usize, f64)> {
        if self.is_empty() {
            return None;
        }
        let (mut at, mut level, mut probability) = (0, 0, 1.0);
        loop {
            let (child, child_probability);
            (child, child_probability, number) = sample_child(level, at, number)?;
            probability *= child_probability;
            match self.nodes[at as usize].children()[child] {
                Child::Light(light) => return Some((light as usize, probability)),
                Child::Node(_) if self.is_far(from, at, child) => {
                    let (light, share) = self.powers.sample(self.nodes[at as usize].lights[child], number);
                    return Some((light, probability * share));
                }
                Child::Node(next) => at = next,
            }
            level += 1;
        }
    }

    /// Selects several lights: all lights if there are at most [`MAX_SPLIT_LIGHTS`]; otherwise this number of
    /// lights, by stratified random numbers. Reports each light with its index and expected count.
    pub fn sample_split(&self, from: &LightTreeContext, number: f64, mut report: impl FnMut(usize, usize, f64)) {
        if self.is_empty() {
            return;
        }
        if self.count > MAX_SPLIT_LIGHTS {
            let mut recent = RecentNodes::default();
            for index in 0..MAX_SPLIT_LIGHTS {
                let number = (number + index as f64) / MAX_SPLIT_LIGHTS as f64;
                if let Some((light, probability)) = self.sample(from, number, Some(&mut recent)) {
                    report(index, light, probability * MAX_SPLIT_LIGHTS as f64);
                }
            }
            return;
        }
        for index in 0..self.count {
            if let Some(light) = self.light_of_index(index) {
                report(index, light, 1.0);
            }
        }
    }

    /// Light that [`LightTree::sample_split`] reports with this index at every point; `None` if the light depends on
    /// the point.
    pub fn light_of_index(&self, index: usize) -> Option<usize> {
        if self.count > MAX_SPLIT_LIGHTS {
            return None;
        }
        match self.nodes.first()?.children().get(index)? {
            Child::Light(light) => Some(*light as usize),
            Child::Node(_) => None,
        }
    }

    /// Probability with which [`LightTree::sample`] selects a light.
    pub fn pmf(&self, from: &LightTreeContext, light: usize) -> f64 {
        let mut probability = f64::from(u8::from(self.parents[light].is_some()));
        let mut start = self.parents[light];
        let mut link = start;
        while let Some(ParentLink { node, child }) = link {
            if self.is_far(from, node, child as usize) {
                start = link;
                probability = self.powers.share(self.nodes[node as usize].lights[child as usize], light);
            }
            link = self.nodes[node as usize].parent;
        }
        let mut link = start;
        while let Some(ParentLink { node, child }) = link {
            probability *= from.child_probabilities(&self.nodes[node as usize]).probability(child as usize);
            link = self.nodes[node as usize].parent;
        }
        probability
    }

    /// Expected number of times that [`LightTree::sample_split`] selects a light.
    pub fn expected_count(&self, from: &LightTreeContext, light: usize) -> f64 {
        match self.count > MAX_SPLIT_LIGHTS {
            true => self.pmf(from, light) * MAX_SPLIT_LIGHTS as f64,
            false => f64::from(u8::from(self.parents[light].is_some())),
        }
    }
}
