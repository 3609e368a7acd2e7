//! Triangle ranges of the instances in a flattened BLAS.

use crate::ray::INVALID_ID;

/// The triangle range of each instance in a flattened BLAS.
#[derive(Debug)]
pub(crate) struct InstanceRanges {
    /// Index of the first triangle of each mesh, in the BLAS.
    pub first_prims: Vec<u32>,
}

impl InstanceRanges {
    /// The mesh of a triangle of the BLAS, and the triangle's index in that mesh.
    pub fn locate(&self, triangle: u32) -> (u32, u32) {
        // An empty mesh begins at the same triangle as the next mesh.
        let mesh = self.first_prims.partition_point(|first| *first <= triangle) - 1;
        (mesh as u32, triangle - self.first_prims[mesh])
    }

    /// Converts hits from (0, triangle of the BLAS) to (instance, triangle of its mesh).
    pub fn remap_hits<'h>(&self, hits: impl Iterator<Item = (&'h mut u32, &'h mut u32)>) {
        for (instance, triangle) in hits.filter(|(instance, _)| **instance != INVALID_ID) {
            (*instance, *triangle) = self.locate(*triangle);
        }
    }
}
