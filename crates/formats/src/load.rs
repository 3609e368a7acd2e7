//! One table of everything that can be loaded.

use std::io;
use std::path::Path;

use glam::DAffine3;
use raycam_scene::{Model, Object, World};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::folder::{Folder, Source};
use crate::{obj, off, ply, stl, world_file};

/// A kind of file that can be loaded.
struct Loader {
    /// In small letters, without the dot.
    extension: &'static str,
    read: Reader,
}

type ModelReader = fn(&Source, &mut Folder) -> Result<Model, FormatError>;

enum Reader {
    World(fn(&Source, &mut Folder) -> Result<World, FormatError>),
    Model(ModelReader),
}

/// Every kind.
const LOADERS: &[Loader] = &[
    Loader { extension: "toml", read: Reader::World(world_file::read) },
    Loader { extension: "obj", read: Reader::Model(obj::read) },
    Loader { extension: "ply", read: Reader::Model(ply::read) },
    Loader { extension: "stl", read: Reader::Model(stl::read) },
    Loader { extension: "off", read: Reader::Model(off::read) },
];

/// The extensions of the files that [`load`] reads, in small letters and without the dot.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    LOADERS.iter().map(|loader| loader.extension)
}

/// The world in a file: `.toml`, `.obj`, `.ply`, `.stl`, `.off`, in capitals or not.
///
/// A mesh file becomes a world of its parts, each an object, without lights and cameras, z up.
///
/// # Errors
/// See [`FormatError`]; an unknown extension lists the known ones.
pub fn load(path: &Path, budget: &Budget) -> Result<World, FormatError> {
    let mut folder = Folder::around(path, budget);
    match find(path)? {
        Reader::World(read) => read(&folder.read(path)?, &mut folder),
        Reader::Model(read) => {
            let source = folder.read(path)?;
            world(read(&source, &mut folder)?, path)
        }
    }
}

/// The model in a mesh file: `.obj` with its materials and textures, `.ply`, `.stl`, `.off`.
///
/// # Errors
/// See [`FormatError`].
pub fn read_model(path: &Path, budget: &Budget) -> Result<Model, FormatError> {
    let mut folder = Folder::around(path, budget);
    let read = model_reader(path)?;
    let source = folder.read(path)?;
    read(&source, &mut folder)
}

/// The reader of a mesh file of this name.
pub(crate) fn model_reader(path: &Path) -> Result<ModelReader, FormatError> {
    match find(path)? {
        Reader::Model(read) => Ok(*read),
        Reader::World(_) => Err(FormatError::unsupported(path, "a world file, expected a mesh file")),
    }
}

fn find(path: &Path) -> Result<&'static Reader, FormatError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if let Some(loader) = LOADERS.iter().find(|loader| loader.extension == extension) {
        return Ok(&loader.read);
    }
    // What is not there has no kind.
    if let Err(source) = std::fs::metadata(path)
        && source.kind() == io::ErrorKind::NotFound
    {
        return Err(FormatError::Io { path: path.into(), source });
    }
    let known: Vec<_> = extensions().map(|extension| format!(".{extension}")).collect();
    let known = known.join(", ");
    Err(FormatError::unsupported(path, format!("unknown kind of file; known are {known}")))
}

/// The world of a mesh file: each part an object, named after the file where it has no name.
fn world(model: Model, path: &Path) -> Result<World, FormatError> {
    let scene = |source| FormatError::Scene { path: Some(path.into()), source };
    let mut world = World { materials: model.materials, notices: model.notices, ..World::default() };
    world.textures = model.textures.into_iter().map(Into::into).collect();
    for part in model.parts {
        part.mesh.validate().map_err(scene)?;
        let name = match &part.name[..] {
            "" => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            name => name.to_owned(),
        };
        let mesh = world.add_mesh(part.mesh);
        let object = Object::new(name, mesh, part.materials, DAffine3::IDENTITY);
        world.add_object(object).map_err(scene)?;
    }
    Ok(world)
}
