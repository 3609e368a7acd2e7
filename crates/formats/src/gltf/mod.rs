//! glTF 2.0 (Khronos, version 2.0.1), as JSON and as GLB, with its extensions.
//!
//! The whole document becomes a world: nodes with meshes become objects; cameras and lights are converted. Up is y.
//!
//! ```text
//! json ← document ← mesh ← world ← read
//!                            world ← writer
//! ```

pub(crate) mod document;
pub(crate) mod json;
pub(crate) mod mesh;
pub(crate) mod world;
mod writer;
use raycam_scene::{Up, World};

use crate::error::Result;
use crate::gltf::document::Document;
use crate::gltf::document::buffers::Resources;
use crate::gltf::document::container::Container;
use crate::gltf::document::memory_allowance::MemoryAllowance;
use crate::gltf::world::builder::{Builder, ImportedMeshes, ImportedTextures};
use crate::io::{AssetRoot, Diagnostics, InputFile};

pub(crate) use crate::gltf::document::container::head;
pub use writer::write;

/// Reads the world in a glTF file.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<World> {
    let path = &source.path;
    let (mut diagnostics, allowance) = (Diagnostics::default(), MemoryAllowance::default());
    let container = Container::open(source, &mut diagnostics)?;
    allowance.grant(source.len());
    // Each JSON object takes memory, even if its text is short, so objects are charged separately.
    let json = &source.bytes[container.json.clone()];
    let objects = json.iter().filter(|&&byte| byte == b'{').count();
    allowance.charge(path, "the JSON", objects as u64, 700)?;
    let root = container.document(&source.bytes, path, &mut diagnostics, &allowance)?;
    allowance.charge(path, "materials", root.materials.len() as u64, 1536)?;
    document::extensions::check(&root, path, &mut diagnostics)?;
    let resources = Resources::read(source, &container, &root, assets, &mut diagnostics, &allowance)?;
    let document = Document { path, source, root, resources, allowance };
    let mut builder = Builder {
        document: &document,
        assets,
        diagnostics,
        world: World { up: Up::Y, emission_keeps_default_lights: true, ..World::default() },
        textures: ImportedTextures::default(),
        meshes: ImportedMeshes::default(),
    };
    builder.materials()?;
    builder.nodes()?;
    let Builder { mut world, diagnostics, .. } = builder;
    world.notices.extend(assets.drain_notices());
    world.notices.extend(diagnostics.into_notices(path));
    Ok(world)
}
