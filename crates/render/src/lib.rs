//! What a camera sees: a [`World`](raycam_scene::World) is prepared once, then any camera renders it into a [`Frame`].
//!
//! ```text
//! World ──prepare──> PreparedWorld ──render(Camera, Settings)──> tiles ──> truth + integrator ──> Frame
//! ```
//!
//! The unit of work is a tile: a batch of rays that one thread traces, shades, lights and writes. No answer depends on
//! the tile it came in, on the number of threads or on their order.

#![forbid(unsafe_code)]

mod bodies;
mod channel;
#[cfg(test)]
mod chi_squared;
mod control;
mod cover;
pub mod display;
mod error;
mod estimate;
mod film;
mod filter;
pub mod flow;
mod frame;
mod integrator;
pub mod keypoints;
mod lanes;
mod light;
mod merge;
mod mirrors;
mod moments;
mod page;
mod pass_through;
mod picture;
mod place;
mod prepare;
mod prepared_material;
mod prepared_mesh;
pub mod queries;
mod render;
mod sampler;
mod scatter;
mod settings;
pub mod silhouette;
mod surface;
mod tally;
mod tangent;
mod target;
pub mod texture;
mod threads;
mod thrown;
mod tile;
mod told;
mod truth;

pub use channel::{Channel, Kind};
pub use control::Control;
pub use error::RenderError;
pub use filter::Filter;
pub use frame::{Frame, Plane};
pub use prepare::PreparedWorld;
pub use queries::RayHits;
pub use raycam_bvh::{InstructionSet, zeros};
pub use render::{render, render_into, render_moving, room};
pub use settings::{Integrator, MAX_SAMPLES, Settings, TruthSurface};
pub use target::{MAX_FRAME_BYTES, Target, Values};
