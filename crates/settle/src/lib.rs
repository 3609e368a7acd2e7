//! Piles: objects of a world that fall and come to rest.
//!
//! rapier simulates convex parts of the meshes. Afterwards, the real meshes are checked: they do not penetrate each
//! other, are supported from below, and do not move. A call uses one thread, and equal input gives equal bytes
//! (rapier's `enhanced-determinism`).
//!
//! ```text
//! error         why objects do not settle
//! convert       vectors and transforms of the scene and of rapier
//! random        deterministic draws
//! surface       exact queries of a real mesh
//! parts         convex parts of a mesh, cached
//! hull          convex shapes with fast queries
//! request       what falls, where and how
//! bodies        the objects as parts, surfaces and bounds
//! start         poses from which objects are dropped
//! simulation    rapier's world
//! judge         penetration, support, place
//! overlap       objects of a world that overlap as they are
//! settle        attempts until the judge agrees
//! ```
//!
//! A file imports only files above it in this list.

#![forbid(unsafe_code)]

mod bodies;
mod convert;
mod error;
mod hull;
mod judge;
mod overlap;
mod parts;
mod random;
mod request;
mod settle;
mod simulation;
mod start;
mod surface;

pub use error::{Result, SettleError};
pub use overlap::{Overlap, overlaps};
pub use request::{Physics, Place, Request, Target};
pub use settle::{Report, Settled, settle};
