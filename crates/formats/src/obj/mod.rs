//! Wavefront OBJ (Alias Wavefront, 1995, appendix "Object Files"), only polygons.
//!
//! Parts are defined by `o`, or by `g` in a file without any `o`. Corners without a normal get the normal of their
//! smoothing group. Vertex colours after the coordinates are read as sRGB, as written by Blender and MeshLab. Texture
//! coordinates have their origin at the bottom left in the file and at the top left here.

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

/// Number of bytes read at a time. The result does not depend on this number, and the number does not depend on the
/// threads.
const CHUNK_BYTES: usize = 1 << 18;

/// Reads the model in an OBJ file, with the materials and textures to which it refers.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let obj = parse::parse(&source.path, &source.bytes, CHUNK_BYTES)?;
    build::build(obj, &source.path, assets)
}
