//! Triangle ranges of the instances in a flattened BLAS.

use crate::ray::INVALID_ID;

/// The triangle range of each instance in a flattened BLAS.
#[derive(Debug)]
pub(crate) struct InstanceRanges {
    /// The first triangle of each mesh.
    pub first_prims: Vec<u32>,
}

impl InstanceRanges {
    /// The mesh of a triangle of the BLAS, and the triangle's index there.
    pub fn locate(&self, triangle: u32) -> (u32, u32) {
        // An empty mesh begins at the same triangle as the next mesh.
        let mesh = self.first_prims.partition_point(|first| *first <= triangle) - 1;
        (mesh as u32, triangle - self.first_prims[mesh])
    }

    /// Replaces triangles of the BLAS by instances and their triangles.
    pub fn remap_hits<'h>(&self, hits: impl Iterator<Item = (&'h mut u32, &'h mut u32)>) {
        for (instance, triangle) in hits.filter(|(instance, _)| **instance != INVALID_ID) {
            (*instance, *triangle) = self.locate(*triangle);
        }
    }
}
