//! What comes and goes: every reader of outside bytes, and every writer.
//!
//! This room is the trust boundary. A reader takes bytes and a [`Budget`] and gives plain data of `raycam_scene` or a
//! [`FormatError`] that says where in which file; it never panics, never allocates what a file merely declares, and opens
//! nothing outside the folder of the file it was asked for. What it skips or repairs it says in the world's notices.
//!
//! Writers give bytes; who puts them on a disk is not their concern.
#![forbid(unsafe_code)]

mod budget;
mod bump;
pub mod bundle;
mod bytes;
pub mod calibration;
pub mod codec;
mod companion;
mod corners;
mod error;
pub mod exr;
mod folder;
mod gltf;
mod guard;
pub mod hdr;
mod ies;
mod image;
mod load;
pub mod mask;
mod mtl;
mod mtl_map;
mod obj;
mod obj_chunk;
mod obj_materials;
mod obj_model;
mod obj_skipped;
mod off;
mod opacity;
mod parallel;
mod ply;
mod ply_body;
mod ply_header;
mod ply_kind;
mod ply_rows;
mod ply_table;
mod ply_triangles;
mod ply_vertices;
pub mod png;
mod polygon;
mod polygon_tree;
mod polygons;
mod single;
mod stl;
mod text;
mod texture;
mod weld;
pub mod world_file;

pub use budget::Budget;
pub use error::{FormatError, Place};
pub use folder::Folder;
pub use gltf::write as write_gltf;
pub use image::{ColorUse, decode_image, read_image};
pub use load::{decode, decode_model, extensions, load, read_model};
pub use texture::{decode_texture, read_texture};
