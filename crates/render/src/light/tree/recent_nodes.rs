//! Nodes that the previous descent through a light tree visited.
//!
//! The random numbers of several light samples at a point are stratified and increase, so that consecutive descents
//! visit mostly the same nodes.

use crate::light::tree::node::ChildProbabilities;

/// Number of levels whose nodes are kept; all deeper levels share the last place.
const LEVELS: usize = 4;

/// Node of each level that the previous descent visited, and the probabilities of its children.
pub(crate) struct RecentNodes {
    /// Index of each node; `u32::MAX` if no node is known.
    nodes: [u32; LEVELS],
    probabilities: [ChildProbabilities; LEVELS],
}

impl Default for RecentNodes {
    fn default() -> Self {
        Self { nodes: [u32::MAX; LEVELS], probabilities: [ChildProbabilities::default(); LEVELS] }
    }
}

impl RecentNodes {
    /// Returns the probabilities of a node's children, and computes them unless the node is known.
    #[inline]
    pub fn get_or_compute(
        &mut self,
        level: usize,
        node: u32,
        compute: impl FnOnce(u32) -> ChildProbabilities,
    ) -> &ChildProbabilities {
        let place = level.min(LEVELS - 1);
        if self.nodes[place] != node {
            self.nodes[place] = node;
            self.probabilities[place] = compute(node);
        }
        &self.probabilities[place]
    }
}
