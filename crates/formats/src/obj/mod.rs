//! Wavefront OBJ (Alias Wavefront, 1995, appendix "Object Files"), polygons only.
//!
//! Parts are made by `o`, or by `g` in a file without any `o`. Where a corner has no normal, smoothing groups give it one.
//! Vertex colours after the coordinates are read as sRGB, as Blender and MeshLab write them. Texture coordinates have
//! their origin at the bottom left in the file and at the top left here.

pub(crate) mod build;
pub(crate) mod chunk;
pub(crate) mod ignored;
pub(crate) mod library;
pub(crate) mod materials;
pub(crate) mod mtl;
pub(crate) mod mtl_map;
pub(crate) mod parse;
pub(crate) mod vertex_colors;
use raycam_scene::MeshFile;

use crate::error::Result;
use crate::io::{AssetRoot, InputFile};

/// Bytes that are read at a time; the same for any number of threads, though nothing depends on it.
const CHUNK_BYTES: usize = 1 << 18;

/// The model in an OBJ file, with the materials and textures it names.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let obj = parse::parse(&source.path, &source.bytes, CHUNK_BYTES)?;
    build::build(obj, &source.path, assets)
}
