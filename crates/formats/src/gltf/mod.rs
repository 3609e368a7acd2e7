//! glTF 2.0 (Khronos, version 2.0.1), as JSON and as GLB, with its extensions.
//!
//! The whole document becomes a world: nodes with meshes become objects, cameras and lights what they are. Up is y.
//! Errors and notices name the place in the document and, where it has one, the code of Khronos' glTF-Validator.

mod accessor;
pub(crate) mod accessor_view;
mod animation;
pub(crate) mod animation_pointer;
mod attributes;
pub(crate) mod buffers;
mod camera;
mod container;
pub(crate) mod diagnostics;
mod extensions;
mod json;
mod light;
mod material;
mod mesh;
mod node;
mod primitive;
mod skin;
pub(crate) mod skin_morph;
mod specular_glossiness;
mod tangent;
mod texture;
mod writer;

use std::io;
use std::path::Path;

use raycam_scene::{SceneError, Up, World};

use self::container::Container;
use self::json::Root;
use self::mesh::Meshes;
use self::texture::Textures;
use crate::error::FormatError;
use crate::gltf::buffers::Resources;
use crate::gltf::diagnostics::Ledger;
use crate::io::asset_root::{Folder, Source};

pub(crate) use container::head;
pub use writer::write;

/// A document and the bytes it refers to.
pub(super) struct Document<'a> {
    path: &'a Path,
    source: &'a Source,
    root: Root,
    resources: Resources<'a>,
}

impl Document<'_> {
    /// An error of this file; the message begins with the place in the document.
    fn fault(&self, message: impl Into<String>) -> FormatError {
        FormatError::whole(self.path, message)
    }

    /// The error of bytes that cannot be read any more.
    fn unread(&self, error: io::Error) -> FormatError {
        buffers::unread(self.path, error)
    }

    /// The error of an index that leads nowhere.
    fn unresolved(&self, place: &str, index: usize, count: usize) -> FormatError {
        self.fault(format!(
            "{place}: {index}, but there are {count} (UNRESOLVED_REFERENCE)"
        ))
    }

    /// What an index written at `place` refers to.
    fn get<'b, T>(&self, all: &'b [T], index: usize, place: &str) -> Result<&'b T, FormatError> {
        all.get(index)
            .ok_or_else(|| self.unresolved(place, index, all.len()))
    }

    fn scene(&self, place: &str, source: SceneError) -> FormatError {
        self.fault(format!("{place}: {source}"))
    }
}

/// A world on its way in.
struct Builder<'a, 'b> {
    document: &'a Document<'a>,
    folder: &'b mut Folder,
    ledger: Ledger,
    world: World,
    textures: Textures,
    meshes: Meshes,
}

/// The world in a glTF file.
pub(crate) fn read(source: &Source, folder: &mut Folder) -> Result<World, FormatError> {
    let path = &source.path;
    let mut ledger = Ledger::new();
    let container = Container::open(source, &mut ledger)?;
    ledger.grant(source.len());
    // Each object of the document takes memory, however short it is.
    let json = &source.bytes[container.json.clone()];
    let objects = json.iter().filter(|&&byte| byte == b'{').count();
    ledger.take(path, "the JSON", objects as u64, 700)?;
    let root = container.document(&source.bytes, path)?;
    ledger.take(path, "materials", root.materials.len() as u64, 1536)?;
    extensions::check(&root, path, &mut ledger)?;
    let resources = Resources::read(source, &container, &root, folder, &mut ledger)?;
    let document = Document {
        path,
        source,
        root,
        resources,
    };
    let mut builder = Builder {
        document: &document,
        folder,
        ledger,
        world: World {
            up: Up::Y,
            glow_is_decoration: true,
            ..World::default()
        },
        textures: Textures::default(),
        meshes: Meshes::default(),
    };
    builder.materials()?;
    builder.nodes()?;
    let Builder {
        mut world, ledger, ..
    } = builder;
    let notices = ledger.into_notices(path, folder);
    world.notices.extend(notices);
    Ok(world)
}
