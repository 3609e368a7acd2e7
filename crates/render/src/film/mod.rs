//! Film: output channels, planes of pixels, tiles and their writers, per-pixel estimators, display encoding.
//!
//! Uses the thread pool and the settings' error type; does not depend on scenes or lights.

pub(crate) mod channel;
pub mod display;
pub(crate) mod estimator;
#[allow(clippy::module_inception)]
pub(crate) mod film;
pub(crate) mod frame;
pub(crate) mod image_plane;
pub(crate) mod light_name;
pub(crate) mod output_plane;
pub(crate) mod tile;
pub(crate) mod tile_writer;
