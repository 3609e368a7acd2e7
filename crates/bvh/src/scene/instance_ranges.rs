//! Triangle ranges of the instances in a flattened BLAS.

use crate::ray::INVALID_ID;

/// Which triangles of a tree are whose.
#[derive(Debug)]
pub(crate) struct InstanceRanges {
    /// Of each mesh, its first triangle in the tree.
    pub first_prims: Vec<u32>,
}

impl InstanceRanges {
    /// The mesh that a triangle of the tree belongs to, and its number there.
    pub fn locate(&self, triangle: u32) -> (u32, u32) {
        // Meshes without triangles begin where the next one does.
        let mesh = self.first_prims.partition_point(|first| *first <= triangle) - 1;
        (mesh as u32, triangle - self.first_prims[mesh])
    }

    /// Makes the instances and triangles of hits those of the meshes.
    pub fn remap_hits<'h>(&self, hits: impl Iterator<Item = (&'h mut u32, &'h mut u32)>) {
        for (instance, triangle) in hits.filter(|(instance, _)| **instance != INVALID_ID) {
            (*instance, *triangle) = self.locate(*triangle);
        }
    }
}
