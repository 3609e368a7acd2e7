//! What a camera sees: a [`World`](raycam_scene::World) is prepared once, then any camera renders it into a [`Frame`].
//!
//! ```text
//! World ──prepare──> PreparedWorld ──render(Camera, Settings)──> tiles ──> truth + integrator ──> Frame
//! ```
//!
//! The unit of work is a tile: a batch of rays that one thread traces, shades, lights and writes. No answer depends on
//! the tile it came in, on the number of threads or on their order.

#![forbid(unsafe_code)]

pub mod annotations;
mod bsdf;
mod control;
mod error;
pub mod film;
mod ground_truth;
mod guiding;
mod integrator;
mod interaction;
mod light;
mod lobes;
mod motion;
mod prepare;
mod render;
mod sampling;
mod settings;
mod soa;
mod thread_pool;
mod tile_renderer;

pub use crate::annotations::ray_queries::RayHits;
pub use crate::film::channel::{Channel, PixelType};
pub use crate::film::frame::Frame;
pub use crate::film::image_plane::ImagePlane;
pub use crate::film::output_plane::{MAX_FRAME_BYTES, OutputPlane, PlaneData};
pub use crate::sampling::filter::Filter;
pub use control::Control;
pub use error::RenderError;
pub use prepare::world::PreparedWorld;
pub use raycam_bvh::{InstructionSet, zeroed_huge};
pub use render::{checked_region, render, render_into, render_moving};
pub use settings::{Integrator, MAX_SAMPLES, Settings, TruthSurface};
