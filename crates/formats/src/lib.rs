//! Readers of all external files, and writers: conversion between bytes and worlds.
//!
//! The crate is the trust boundary. A reader takes bytes and a [`Budget`] and returns plain data of `raycam_scene`, or
//! a [`FormatError`] with the position in the file. It never panics, never allocates memory just because a file
//! declares it, and opens nothing outside the folder of the file that the caller names. Skipped and repaired data cause
//! notices of the world. Writers return bytes.
//!
//! ```text
//! error, budget        errors with positions; limits
//! io                   folders, bytes, text, threads
//! geometry             triangulation, welding
//! image, codec         images and textures; Draco, meshoptimizer
//! obj ply stl off ies  one format each
//! gltf                 json ← document ← mesh ← world; writer
//! world_file, bundle   TOML; exact copies for other processes
//! polygon_arrays       meshes and objects from another process
//! registry             the table of loadable formats
//! asset_loader         files that a description names
//! encode               PNG, EXR, HDR, masks
//! ```
//!
//! A line imports the lines above it; `encode` is independent of the other modules.
#![forbid(unsafe_code)]

mod asset_loader;
mod budget;
pub mod bundle;
pub mod codec;
pub mod encode;
mod error;
mod geometry;
mod gltf;
mod ies;
mod image;
pub mod io;
mod obj;
mod off;
mod ply;
pub mod polygon_arrays;
mod registry;
mod stl;
pub mod world_file;

pub use crate::image::texture::{decode_texture, read_texture};
pub use crate::io::asset_root::AssetRoot;
pub use crate::io::memory_files::MemoryFiles;
pub use crate::registry::{
    COMPANION_EXTENSIONS, decode, decode_model, extensions, load, load_from_memory, load_within, read_model,
};
pub use budget::Budget;
pub use error::{FormatError, Location, Result, broken_link};
pub use gltf::write as write_gltf;
pub use image::{ColorUse, ExrChannel, decode_image, read_exr, read_image, read_photo};
pub use io::stand_in::check as check_stand_in;
