//! Ray tracing kernels: closest hits and occlusion of batches of rays against triangles, on the CPU.
//!
//! [`Bvh`] is a bottom-level BVH (BLAS) over one mesh. [`Scene`] is a top-level BVH (TLAS) over instances. A query
//! traces a slice of rays on the calling thread. Hits depend neither on the batch, nor on threads, nor on the
//! instruction set. This is the only crate with `unsafe` and SIMD. It does not depend on worlds, cameras or materials.
//!
//! ```text
//! src/
//! ├── error  ray  limits  aabb   errors, rays and hits, limits, the AABB
//! ├── exact/                     error-free arithmetic, exact signs of rays and triangles, closest points
//! ├── node                       wide nodes and leaves in 256-byte blocks
//! ├── platform/                  instruction set dispatch, huge pages
//! ├── simd/                      vectors of 8 and 16 floats: portable, AVX2, AVX-512, NEON
//! ├── build/                     binned SAH over triangle pairs, in treelets, collapsed to eight children
//! ├── blas/                      Bvh: build, refit, bounding boxes
//! ├── scene/                     Scene: instances, re-braided TLAS, flattened scenes, queries
//! └── traverse/                  ray streams, frustum packets, interleaved single rays, float64 hits, crossings,
//! points
//! ```
//!
//! A folder imports only folders above it in this list; `scene/query` is on top of all.
//!
//! # Checks
//!
//! - `cargo test -p raycam-bvh`: trees of the same bytes and hits of the same bits for every instruction set, number of
//!   threads and kernel; a hundred meshes against float64 brute force; ten million rays aimed at edges and vertices.
//!   `benchmarks/brute_force.py` and `make leak` run the last two tests with more rays.
//! - AddressSanitizer, over the kernels of every instruction set:
//!   `RUSTFLAGS=-Zsanitizer=address cargo +nightly test -p raycam-bvh --target x86_64-unknown-linux-gnu`.
//! - The same tests with NEON, if the target is installed and QEMU runs its programs:
//!   `CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
//!   CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
//!   cargo test -p raycam-bvh --target aarch64-unknown-linux-gnu`.
//! - Miri, over the partition of the builder, whose writes are not bounds-checked: `MIRIFLAGS="-Zmiri-tree-borrows
//!   -Zmiri-ignore-leaks" cargo +nightly miri test -p raycam-bvh --lib partition`. Without the test filter `partition`,
//!   Miri runs whole builds of smaller meshes, for many minutes. rayon's queues break stacked borrows, and its threads
//!   are never joined; both flags are therefore required.

// The lint is disabled because loops over axes and lanes read several arrays with one index.
#![allow(clippy::needless_range_loop)]
// The lint is disabled because rays are larger than a cache line, so their `to_` methods take references.
#![allow(clippy::wrong_self_convention)]

mod aabb;
mod blas;
mod build;
mod error;
mod exact;
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
pub use error::BuildError;
pub use ray::{ClosestPoint, Coherence, ExactHit, ExactRay, Hit, HitDetail, HitFilter, INVALID_ID, Ray, Tie};
pub use scene::build::TlasLeaves;
pub use scene::query::squared_distance_to_triangle;
pub use scene::{ExactTriangles, Instance, Scene};
pub use simd::prefetch;
