//! What a ray meets: triangles in, nearest or any hit out, in batches.
//!
//! The only room with `unsafe` and SIMD; it knows nothing of worlds, cameras or materials. [`Bvh`] holds one mesh,
//! [`Scene`] places meshes; a query answers a slice of rays on the calling thread, and its answers depend neither on
//! the batch it came in, nor on threads, nor on the instruction set.

mod ray;
mod scene;

pub use ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
pub use scene::{BuildError, BuildOptions, Bvh, ExactTriangles, Instance, Quality, Scene};
