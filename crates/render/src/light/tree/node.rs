//! Node of the light tree: up to sixteen children, structure of arrays, whose importances are computed together.

use glam::Vec3;
use raycam_bvh::WithSimd;

use crate::light::bounds::{Angle, LightBounds, PreparedLightBounds};
use crate::soa::{LANES, Vec3xN, get_lane, set_lane};

/// Node with up to [`LANES`] children; unused slots have no power.
#[derive(Debug)]
pub(crate) struct LightTreeNode {
    /// Fields of the children's [`PreparedLightBounds`], one value per child.
    center: Vec3xN<f32, LANES>,
    half: Vec3xN<f32, LANES>,
    radius: [f32; LANES],
    axis: Vec3xN<f32, LANES>,
    /// Sine and cosine of the half angle of the cone of normals.
    theta_o: [[f32; LANES]; 2],
    cos_theta_e: [f32; LANES],
    two_sided: [bool; LANES],
    phi: [f32; LANES],
    /// Lights below each child: a range of the tree's power table.
    pub lights: [[u32; 2]; LANES],
    children: [Child; LANES],
    /// Number of used slots.
    child_count: usize,
    /// Link to the parent; none for the root.
    pub parent: Option<ParentLink>,
}

/// Parent of a node or light, and the slot in the parent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParentLink {
    pub node: u32,
    pub child: u32,
}

/// Child of a node, given by an index.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Child {
    Node(u32),
    Light(u32),
}

impl LightTreeNode {
    pub fn new() -> Self {
        Self {
            center: [[0.0; LANES]; 3],
            half: [[0.0; LANES]; 3],
            radius: [0.0; LANES],
            axis: [[0.0; LANES]; 3],
            theta_o: [[0.0; LANES]; 2],
            cos_theta_e: [0.0; LANES],
            two_sided: [false; LANES],
            phi: [0.0; LANES],
            lights: [[0; 2]; LANES],
            children: [Child::Light(0); LANES],
            child_count: 0,
            parent: None,
        }
    }

    /// Appends a child.
    pub fn push_child(&mut self, bounds: &LightBounds, below: Child) {
        let child = self.child_count;
        let reach = bounds.prepare();
        set_lane(&mut self.center, child, reach.center.to_array());
        set_lane(&mut self.half, child, reach.half.to_array());
        self.radius[child] = reach.radius;
        set_lane(&mut self.axis, child, reach.axis.to_array());
        self.theta_o[0][child] = reach.theta_o.sin;
        self.theta_o[1][child] = reach.theta_o.cos;
        self.cos_theta_e[child] = reach.cos_theta_e;
        self.two_sided[child] = reach.two_sided;
        self.phi[child] = reach.phi;
        self.children[child] = below;
        self.child_count += 1;
    }

    pub fn children(&self) -> &[Child] {
        &self.children[..self.child_count]
    }

    /// Adds an offset to the indices of child nodes.
    pub fn offset_children(&mut self, by: usize) {
        for below in &mut self.children[..self.child_count] {
            if let Child::Node(node) = below {
                *node += by as u32;
            }
        }
    }

    /// Prepared bounds of a child.
    #[inline(always)]
    pub fn child_bounds(&self, child: usize) -> PreparedLightBounds {
        PreparedLightBounds {
            center: get_lane(&self.center, child).into(),
            half: get_lane(&self.half, child).into(),
            radius: self.radius[child],
            axis: get_lane(&self.axis, child).into(),
            theta_o: Angle { sin: self.theta_o[0][child], cos: self.theta_o[1][child] },
            cos_theta_e: self.cos_theta_e[child],
            two_sided: self.two_sided[child],
            phi: self.phi[child],
        }
    }
}

/// Discrete distribution over a node's children.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ChildProbabilities {
    weights: [f32; LANES],
    /// Running sums of the children's weights.
    sums: [f64; LANES],
}

impl ChildProbabilities {
    /// Creates the distribution in proportion to weights.
    pub fn new(weights: [f32; LANES]) -> Self {
        // The running sums of four groups are computed independently and then combined, because the additions
        // of a single running sum would wait for each other.
        let mut sums = [0.0; LANES];
        for (sums, weights) in sums.chunks_mut(4).zip(weights.chunks(4)) {
            let mut sum = 0.0;
            for (out, &weight) in sums.iter_mut().zip(weights) {
                sum += f64::from(weight);
                *out = sum;
            }
        }
        let mut before = 0.0;
        for sums in sums.chunks_mut(4) {
            sums.iter_mut().for_each(|sum| *sum += before);
            before = sums[3];
        }
        Self { weights, sums }
    }

    /// True if a child has a positive probability.
    pub fn is_possible(&self, child: usize) -> bool {
        self.weights[child] > 0.0
    }

    /// Probability with which a child is selected.
    pub fn probability(&self, child: usize) -> f64 {
        if self.is_possible(child) { f64::from(self.weights[child]) / self.sums[LANES - 1] } else { 0.0 }
    }

    /// Samples a child by a number in 0..1; returns the child, its probability, and the number rescaled to 0..1. `None`
    /// if no child can be selected.
    pub fn sample(&self, number: f64) -> Option<(usize, f64, f64)> {
        let target = number * self.sums[LANES - 1];
        let passed = |&end: &f64| usize::from(end <= target);
        let quads: usize = [3, 7, 11].map(|end: usize| passed(&self.sums[end])).iter().sum();
        let before = 4 * quads + self.sums[4 * quads..][..4].iter().map(passed).sum::<usize>();
        // If rounding leads past the last child, the last possible child is selected.
        let child = match before {
            LANES => (0..LANES).rfind(|&child| self.is_possible(child))?,
            _ => before,
        };
        let weight = f64::from(self.weights[child]);
        let rest = (target - (self.sums[child] - weight)) / weight;
        let found = (child, self.probability(child), rest.clamp(0.0, 1.0));
        (weight > 0.0).then_some(found)
    }
}

/// Loop over a node's children that computes their importances at one point.
pub(crate) struct ComputeImportance<'a> {
    pub node: &'a LightTreeNode,
    pub position: Vec3,
    pub normal: Vec3,
    pub out: &'a mut [f32; LANES],
}

impl WithSimd for ComputeImportance<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { node, position, normal, out } = self;
        let mut weights = [0.0; LANES];
        for (child, weight) in weights.iter_mut().enumerate() {
            *weight = node.child_bounds(child).importance(position, normal);
        }
        *out = weights;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use raycam_bvh::dispatch_simd;

    use super::*;

    #[test]
    fn children_are_drawn_in_proportion_to_their_weights() {
        let weights = std::array::from_fn(|i| [0.0, 1e-6, 3.0, 1e7, 0.25][i % 5]);
        let shares = ChildProbabilities::new(weights);
        let total: f64 = weights.iter().copied().map(f64::from).sum();
        let (mut sum, mut at) = (0.0, 0.0);
        for (child, &weight) in weights.iter().enumerate() {
            let share = f64::from(weight) / total;
            assert!((shares.probability(child) - share).abs() <= 1e-14 * share);
            sum += share;
            // The random numbers are in the middle of the child's interval and near both of its ends.
            for part in [0.1, 0.5, 0.9].iter().filter(|_| weight > 0.0) {
                let (found, probability, rest) = shares.sample(at + part * share).unwrap();
                assert_eq!((found, probability), (child, shares.probability(child)));
                assert!((rest - part).abs() < 1e-15 / share + 1e-9, "{rest} {part}");
            }
            at = sum;
        }
        assert!(shares.sample(0.0).is_some() && shares.sample(1.0).is_some());
        assert!(ChildProbabilities::default().sample(0.5).is_none());
    }

    #[test]
    fn importances_of_children_match_their_bounds() {
        let mut node = LightTreeNode::new();
        let at = |i: usize| DVec3::new(i as f64, (i as f64).sin(), 2.0);
        for i in 0..11 {
            let light = match i % 2 {
                0 => LightBounds::isotropic(at(i), at(i), Vec3::ONE),
                _ => LightBounds::planar(&[at(i), at(i + 1)], -DVec3::Z, Vec3::ONE, i == 3),
            };
            node.push_child(&light, Child::Light(i as u32));
        }
        let (position, normal) = (Vec3::new(4.0, 0.0, 0.5), Vec3::Z);
        let mut weights = [0.0; LANES];
        dispatch_simd(ComputeImportance { node: &node, position, normal, out: &mut weights });
        assert_eq!(node.children().len(), 11);
        for (child, weight) in weights.into_iter().enumerate() {
            let alone = node.child_bounds(child).importance(position, normal);
            assert_eq!(weight.to_bits(), alone.to_bits());
            assert_eq!(alone > 0.0, child < 11);
        }
    }
}
