//! Limits of meshes, scenes and trees, and the precision of float32.

/// The largest number of triangles of a mesh: block indices have 31 bits, and a triangle takes at most two blocks.
pub const MAX_TRIANGLES: usize = 1 << 30;

/// The largest number of instances of a scene.
pub const MAX_INSTANCES: usize = (1 << 31) - 2;

/// Maximum number of nodes on a path from a root, in binary splits and therefore in wide nodes. If the SAH would create
/// a deeper tree, ranges of primitives are halved instead. This limits the stack of every traversal.
pub const MAX_DEPTH: usize = 56;

/// Maximum coordinate of a tree: meshes and scenes with larger coordinates are scaled by a power of two.
pub const MAX_COORD: f32 = (1 << 30) as f32;

/// Half an ulp of 1: the relative error of one rounding to float32.
pub const MACHINE_EPSILON: f32 = 1.0 / (1 << 24) as f32;
