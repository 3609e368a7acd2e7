//! Refitting of a BLAS to moved vertices: the topology is kept, bounds and leaves are updated.

use crate::aabb::Aabb;
use crate::blas::Bvh;
use crate::blas::build::{power_of_two_scale, validate_mesh};
use crate::error::BuildError;
use crate::node::{LeafNode, NodeBlock, NodeRef};

impl Bvh {
    /// Moves the tree to new vertex positions of the same triangles. Hits equal the hits of a newly built tree, but
    /// rays become slower as the mesh deforms more: see [`Bvh::sah_cost`].
    ///
    /// # Errors
    ///
    /// Errors of [`Bvh::build`], and [`BuildError::TopologyMismatch`] if the number of triangles differs or if the
    /// mesh's size requires another scale. After an error, the tree is unchanged.
    pub fn refit(&mut self, vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<(), BuildError> {
        let reach = validate_mesh(vertices, triangles)?;
        if triangles.len() != self.triangle_count() || power_of_two_scale(reach) != self.scale() {
            return Err(BuildError::TopologyMismatch { given: triangles.len(), built: self.triangle_count() });
        }
        if self.root() == NodeRef::EMPTY {
            return Ok(());
        }
        let scale = self.scale();
        let (root, ids, blocks) = self.split_mut();
        let vertex = |index: u32| vertices[index as usize].map(|x| x * scale);
        let moved = |leaf: &mut LeafNode| {
            let ids = &ids[leaf.first_prim as usize..][..leaf.count as usize];
            leaf.refit(ids.iter().map(|&id| triangles[id as usize].map(vertex)))
        };
        let bounds = refit(blocks, root, &moved);
        self.set_bounds(bounds);
        Ok(())
    }

    /// Expected number of nodes and leaves visited by a ray through the mesh's bounds: the SAH cost of Goldsmith and
    /// Salmon 1987. Compare it before and after a [`Bvh::refit`].
    pub fn sah_cost(&self) -> f64 {
        if self.root() == NodeRef::EMPTY {
            return 0.0;
        }
        let area = |Aabb { lower, upper }: Aabb| {
            let [x, y, z] = [0, 1, 2].map(|a| f64::from(upper[a]) - f64::from(lower[a]));
            x * y + y * z + z * x
        };
        let mut sum = area(*self.bounds());
        let whole = sum;
        let mut open = vec![self.root()];
        while let Some(at) = open.pop() {
            if at.is_leaf() {
                continue;
            }
            let node = crate::node::node(self.blocks(), at);
            for k in 0..node.child_count as usize {
                sum += area(node.child_bounds(k));
                open.push(node.children[k]);
            }
        }
        if whole > 0.0 { sum / whole } else { 1.0 }
    }
}

/// Refits the subtree at `at`; returns its bounds. The recursion is at most [`crate::limits::MAX_DEPTH`] deep.
fn refit(blocks: &mut [NodeBlock], at: NodeRef, moved: &impl Fn(&mut LeafNode) -> Aabb) -> Aabb {
    let index = at.index();
    if at.is_leaf() {
        // SAFETY: a leaf reference refers to a leaf.
        return moved(unsafe { &mut blocks[index].leaf });
    }
    // SAFETY: a node reference refers to a node.
    let node = unsafe { blocks[index].node };
    let mut whole = Aabb::EMPTY;
    for k in 0..node.child_count as usize {
        let bounds = refit(blocks, node.children[k], moved);
        for a in 0..3 {
            whole.lower[a] = whole.lower[a].min(bounds.lower[a]);
            whole.upper[a] = whole.upper[a].max(bounds.upper[a]);
        }
        // SAFETY: as above.
        unsafe { blocks[index].node.set_child_bounds(k, bounds) };
    }
    whole
}
