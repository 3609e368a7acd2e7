//! What a ray meets: triangles in, nearest or any hit out, in batches.
//!
//! The only room with `unsafe` and SIMD; it knows nothing of worlds, cameras or materials. [`Bvh`] holds one mesh,
//! [`Scene`] places meshes; a query answers a slice of rays on the calling thread, and its answers depend neither on
//! the batch it came in, nor on threads, nor on the instruction set.
//!
//! # What is run against it
//!
//! - `cargo test -p raycam-bvh`: trees of the same bytes and answers of the same bits for every instruction set, number
//!   of threads and kernel; a hundred meshes against float64 brute force; ten million rays aimed at edges and vertices.
//!   `benchmarks/brute_force.py` and `make leak` do the last two at length.
//! - AddressSanitizer, over the kernels of every instruction set:
//!   `RUSTFLAGS=-Zsanitizer=address cargo +nightly test -p raycam-bvh --target x86_64-unknown-linux-gnu`.
//! - The same tests with NEON, where the target is installed and QEMU runs its programs:
//!   `CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
//!   CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
//!   cargo test -p raycam-bvh --target aarch64-unknown-linux-gnu`.
//! - Miri, over the partition of the builder, whose ends are written without bounds being checked:
//!   `MIRIFLAGS="-Zmiri-tree-borrows -Zmiri-ignore-leaks" cargo +nightly miri test -p raycam-bvh --lib partition`.
//!   Without the last word it takes whole builds as well, of smaller parts, and many minutes. rayon's queues
//!   break stacked borrows, and its threads are never joined; hence the flags.

// Loops over axes and lanes read several arrays by one index.
#![allow(clippy::needless_range_loop)]

mod aabb;
mod blas;
mod build;
mod error;
mod limits;
mod node;
mod platform;
mod ray;
mod scene;
mod simd;
mod traverse;

pub use crate::blas::Bvh;
pub use crate::limits::MAX_TRIANGLES;
pub use crate::platform::dispatch::{InstructionSet, WithSimd, dispatch_simd};
pub use crate::platform::huge_page_vec::zeroed_huge;
pub use crate::platform::streaming_store::{Pod, StreamingWriter, with_streaming_stores};
pub use error::BuildError;
pub use ray::{Coherence, ExactHit, ExactRay, Hit, INVALID_ID, Ray};
pub use scene::{ExactTriangles, Instance, Scene};
pub use simd::prefetch;
