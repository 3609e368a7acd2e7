//! One file for each concept of the crate, of the same name.

mod budget;
mod bump;
mod bundle;
mod calibration;
mod common;
mod corpus;
mod draco;
mod exr;
mod folder;
mod gltf;
mod hdr;
mod image;
mod load;
mod mask;
mod meshopt;
mod mtl;
mod obj;
mod off;
mod ply;
mod png;
mod stl;
mod texture;
mod world_file;
