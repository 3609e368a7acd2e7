//! TODO: what is here.

pub(crate) mod channel;
pub mod display;
pub(crate) mod estimator;
pub(crate) mod film;
pub(crate) mod frame;
pub(crate) mod image_plane;
pub(crate) mod output_plane;
pub(crate) mod tile;
pub(crate) mod tile_writer;
