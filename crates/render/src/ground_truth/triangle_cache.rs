//! Cache of per-triangle values: neighbouring pixels usually hit the same triangles.

use raycam_bvh::{ExactHit, INVALID_ID};

/// Direct-mapped cache of one value per triangle.
pub(crate) struct TriangleCache<T> {
    keys: [(u32, u32); CACHE_SIZE],
    values: [T; CACHE_SIZE],
}

/// Number of entries, a power of two: about the number of triangles in a few rows.
const CACHE_SIZE: usize = 16;

impl<T: Copy> TriangleCache<T> {
    pub fn new(nothing: T) -> Self {
        Self { keys: [(INVALID_ID, INVALID_ID); CACHE_SIZE], values: [nothing; CACHE_SIZE] }
    }

    /// Value of the triangle that was hit; computed on a cache miss.
    #[inline]
    pub fn get_or_insert(&mut self, hit: &ExactHit, find: impl FnOnce() -> T) -> &mut T {
        let of = (hit.instance, hit.triangle);
        let at = (hit.instance.wrapping_mul(7) ^ hit.triangle) as usize % CACHE_SIZE;
        if self.keys[at] != of {
            self.keys[at] = of;
            self.values[at] = find();
        }
        &mut self.values[at]
    }
}
