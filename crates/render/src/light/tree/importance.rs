//! Importances of a node's children: for one node at many points, or for any node at one point.

use raycam_bvh::{WithSimd, dispatch_simd};

use crate::interaction::LightSampleContext;
use crate::light::tree::node::{ChildProbabilities, ComputeImportance, LightTreeNode};
use crate::soa::{LANES, Vec3xN, get_lane};

/// Importances of each child of a node at each point of a batch.
#[derive(Debug, Default)]
pub(crate) struct NodeImportances {
    per_child: [[f32; LANES]; LANES],
}

/// Point at which a light tree is sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightTreeContext<'a> {
    pub from: &'a LightSampleContext,
    /// Precomputed importances of the tree's only node, and the point's lane.
    pub importances: Option<(&'a NodeImportances, usize)>,
}

impl<'a> From<&'a LightSampleContext> for LightTreeContext<'a> {
    fn from(from: &'a LightSampleContext) -> Self {
        Self { from, importances: None }
    }
}

impl LightTreeContext<'_> {
    /// Distribution over a node's children at the point.
    pub(crate) fn child_probabilities(&self, node: &LightTreeNode) -> ChildProbabilities {
        let mut weights = [0.0; LANES];
        match self.importances {
            Some((known, lane)) => {
                for (weight, of_child) in weights.iter_mut().zip(&known.per_child) {
                    *weight = of_child[lane];
                }
            }
            None => {
                let (position, normal) = (self.from.position.as_vec3(), self.from.normal);
                match node.children() {
                    [_] => weights[0] = node.child_bounds(0).importance(position, normal),
                    _ => dispatch_simd(ComputeImportance { node, position, normal, out: &mut weights }),
                }
            }
        }
        ChildProbabilities::new(weights)
    }
}

/// Loop that computes the importances of a tree's only node at a batch of points.
pub(crate) struct ComputeNodeImportances<'a> {
    pub node: &'a LightTreeNode,
    pub points: &'a Vec3xN<f64, LANES>,
    pub normals: &'a Vec3xN<f32, LANES>,
    pub out: &'a mut NodeImportances,
}

impl WithSimd for ComputeNodeImportances<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { node, points, normals, out: NodeImportances { per_child: of_children } } = self;
        let (points, normals) = (*points, *normals);
        for (child, out) in of_children.iter_mut().enumerate() {
            let mut weights = [0.0; LANES];
            if child < node.children().len() {
                let reach = node.child_bounds(child);
                for (lane, weight) in weights.iter_mut().enumerate() {
                    let position = get_lane(&points, lane).map(|x| x as f32);
                    *weight = reach.importance(position.into(), get_lane(&normals, lane).into());
                }
            }
            *out = weights;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::light::bounds::LightBounds;
    use crate::light::tree::LightTree;
    use crate::soa::{lane_dvec3, set_lane};

    #[test]
    fn batched_importances_equal_single_importances() {
        let place = |i: usize| {
            let angle = i as f64;
            DVec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin())
        };
        let lights: Vec<LightBounds> = (0..7)
            .map(|i| {
                let (at, normal) = (place(i) * 2.0, place(5 * i + 1).normalize());
                let corners = [at, at + 0.3 * normal.any_orthonormal_vector()];
                match i % 3 {
                    0 => LightBounds::isotropic(at, at, Vec3::ONE),
                    1 => LightBounds::planar(&corners, normal, Vec3::X, false),
                    _ => LightBounds::planar(&corners, normal, Vec3::splat(5.0), true),
                }
            })
            .collect();
        let tree = LightTree::new(&lights);
        let (mut none, mut some) = (0, 0);
        for first in (0..640).step_by(LANES) {
            let (mut points, mut normals) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            for lane in 0..LANES {
                let i = first + lane;
                set_lane(&mut points, lane, (place(7 * i) * 3.0).to_array());
                let normal = place(3 * i).normalize() * f64::from(i % 5 != 0);
                set_lane(&mut normals, lane, normal.as_vec3().to_array());
            }
            let mut weights = NodeImportances::default();
            dispatch_simd(ComputeNodeImportances {
                node: tree.only_node().unwrap(),
                points: &points,
                normals: &normals,
                out: &mut weights,
            });
            for lane in 0..LANES {
                let from =
                    LightSampleContext { position: lane_dvec3(&points, lane), normal: get_lane(&normals, lane).into() };
                let node = tree.only_node().unwrap();
                let alone = LightTreeContext::from(&from);
                let known = LightTreeContext { importances: Some((&weights, lane)), ..alone };
                let [alone, known] = [alone, known].map(|asker| asker.child_probabilities(node));
                for child in 0..LANES {
                    assert_eq!(known.probability(child).to_bits(), alone.probability(child).to_bits());
                    *(if known.is_possible(child) { &mut some } else { &mut none }) += 1;
                }
            }
        }
        assert!(none > 500 && some > 500, "{none} {some}");
    }
}
