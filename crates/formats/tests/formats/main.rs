//! One file for each concept of the crate, in folders with the same names.

mod budget;
mod bundle;
mod codec;
mod corpus;
mod encode;
mod gltf;
mod image;
mod io;
mod obj;
mod off;
mod ply;
mod registry;
mod stl;
mod support;
mod world_file;
