//! What a ray meets: triangles in, nearest or any hit out, in batches.
//!
//! The only room with `unsafe` and SIMD; it knows nothing of worlds, cameras or materials. [`Bvh`] holds one mesh,
//! [`Scene`] places meshes; a query answers a slice of rays on the calling thread, and its answers depend neither on
//! the batch it came in, nor on threads, nor on the instruction set.

// Loops over axes and lanes read several arrays by one index.
#![allow(clippy::needless_range_loop)]

mod block;
mod boxes;
mod build;
mod dispatch;
mod error;
mod leaves;
mod memory;
mod mesh;
mod ray;
mod refit;
mod scene;
mod simd;
mod traverse;

pub use dispatch::{InstructionSet, Loops, vectorized};
pub use error::BuildError;
pub use mesh::{BuildOptions, Bvh, Quality, TRIANGLE_LIMIT};
pub use ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
pub use scene::{ExactTriangles, Instance, Scene};
