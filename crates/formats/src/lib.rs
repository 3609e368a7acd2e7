//! What comes and goes: every reader of outside bytes, and every writer.
//!
//! This room is the trust boundary. A reader takes bytes and a [`Budget`] and gives plain data of `raycam_scene` or a
//! [`FormatError`] that says where in which file; it never panics, never allocates what a file merely declares, and opens
//! nothing outside the folder of the file it was asked for. What it skips or repairs it says in the world's notices.
//!
//! Writers give bytes; who puts them on a disk is not their concern.
#![forbid(unsafe_code)]

mod asset_loader;
mod budget;
pub mod bundle;
pub mod calibration;
pub mod codec;
pub mod encode;
mod error;
mod geometry;
mod gltf;
mod ies;
mod image;
mod io;
mod obj;
mod off;
mod ply;
mod registry;
mod stl;
pub mod world_file;

pub use crate::image::texture::{decode_texture, read_texture};
pub use crate::io::asset_root::AssetRoot;
pub use crate::registry::{decode, decode_model, extensions, load, read_model};
pub use budget::Budget;
pub use error::{FormatError, Location};
pub use gltf::write as write_gltf;
pub use image::{ColorUse, decode_image, read_image};
