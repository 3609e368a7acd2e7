//! One table of everything that can be loaded.

use std::fs::File;
use std::io;
use std::path::Path;

use glam::DAffine3;
use raycam_scene::{Model, Object, World};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::io::asset_root::{Folder, Source};
use crate::{gltf, obj, off, ply, stl, world_file};

/// A kind of file that can be loaded.
struct Loader {
    /// In small letters, without the dot.
    extension: &'static str,
    read: Reader,
    /// How many bytes from the beginning of a large file it wants in memory, where that is not all of them.
    head: fn(&File, u64) -> Option<u64>,
}

enum Reader {
    World(fn(&Source, &mut Folder) -> Result<World, FormatError>),
    /// A world of its own that can be an object of another, too.
    Scene(fn(&Source, &mut Folder) -> Result<World, FormatError>),
    Model(fn(&Source, &mut Folder) -> Result<Model, FormatError>),
}

/// Every kind.
const LOADERS: &[Loader] = &[
    Loader {
        extension: "toml",
        read: Reader::World(world_file::read),
        head: whole,
    },
    Loader {
        extension: "gltf",
        read: Reader::Scene(gltf::read),
        head: whole,
    },
    Loader {
        extension: "glb",
        read: Reader::Scene(gltf::read),
        head: gltf::head,
    },
    Loader {
        extension: "obj",
        read: Reader::Model(obj::read),
        head: whole,
    },
    Loader {
        extension: "ply",
        read: Reader::Model(ply::read),
        head: ply::head,
    },
    Loader {
        extension: "stl",
        read: Reader::Model(stl::read),
        head: stl::head,
    },
    Loader {
        extension: "off",
        read: Reader::Model(off::read),
        head: whole,
    },
];

/// The extensions of the files that [`load`] reads, in small letters and without the dot.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    LOADERS.iter().map(|loader| loader.extension)
}

/// The world in a file: `.toml`, `.gltf`, `.glb`, `.obj`, `.ply`, `.stl`, `.off`, in capitals or not.
///
/// A mesh file (glTF apart, which holds worlds) becomes a world of its parts, each an object, without lights and cameras, z up.
///
/// # Errors
/// See [`FormatError`]; an unknown extension lists the known ones.
pub fn load(path: &Path, budget: &Budget) -> Result<World, FormatError> {
    let mut folder = Folder::around(path, budget);
    let source = source(path, &mut folder)?;
    whole_world(source, &mut folder)
}

/// The world in a file that has been read.
fn whole_world(source: Source, folder: &mut Folder) -> Result<World, FormatError> {
    let mut world = match find(&source.path)?.read {
        Reader::World(read) | Reader::Scene(read) => read(&source, folder)?,
        Reader::Model(_) => {
            let path = source.path.clone();
            world(model(source, folder)?, &path)?
        }
    };
    folder.finish(&mut world)?;
    Ok(world)
}

/// The model in a mesh file: `.obj` and `.gltf` with their materials and textures, `.glb`, `.ply`, `.stl`, `.off`.
///
/// # Errors
/// See [`FormatError`].
pub fn read_model(path: &Path, budget: &Budget) -> Result<Model, FormatError> {
    let mut folder = Folder::around(path, budget);
    model(source(path, &mut folder)?, &mut folder)
}

/// The bytes of a file of a known kind, as far as its reader wants them in memory.
fn source(path: &Path, folder: &mut Folder) -> Result<Source, FormatError> {
    folder.begin(path, find(path)?.head)
}

/// All of a file.
fn whole(_: &File, _: u64) -> Option<u64> {
    None
}

/// The world in the bytes of a file, which `path` names as [`load`] takes it.
///
/// # Errors
/// See [`FormatError`].
pub fn decode(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<World, FormatError> {
    whole_world(Source::new(path, bytes), &mut Folder::around(path, budget))
}

/// The model in the bytes of a mesh file. `path` says of which kind it is, names it in errors, and its folder is where
/// the files it names are read from.
///
/// # Errors
/// See [`FormatError`].
pub fn decode_model(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<Model, FormatError> {
    model(Source::new(path, bytes), &mut Folder::around(path, budget))
}

/// The model in a mesh file that has been read: everything in it fits together.
pub(crate) fn model(source: Source, folder: &mut Folder) -> Result<Model, FormatError> {
    let model = match find(&source.path)?.read {
        Reader::Model(read) => read(&source, folder)?,
        Reader::Scene(read) => flat(read(&source, folder)?, &source.path, folder)?,
        Reader::World(_) => {
            let message = "a world file, expected a mesh file";
            return Err(FormatError::unsupported(&source.path, message));
        }
    };
    for part in &model.parts {
        let valid = part.mesh.validate();
        valid.map_err(|error| FormatError::Scene {
            path: Some(source.path.clone()),
            source: error,
        })?;
    }
    Ok(model)
}

/// The model of a world whose objects are all one; each copy of a mesh counts.
fn flat(world: World, path: &Path, folder: &mut Folder) -> Result<Model, FormatError> {
    let (lights, cameras) = (world.lights.len(), world.cameras.len());
    let left_out = (lights + cameras > 0).then(|| {
        format!(
            "{}: as an object it has no lights and cameras: {lights} and {cameras} are left out",
            path.display()
        )
    });
    for object in &world.objects {
        let mesh = &world.meshes[object.mesh];
        let amount = mesh.vertices.len() + 3 * mesh.triangles.len();
        folder.budget.take_elements(path, amount as u64)?;
    }
    let mut model = Model::of_world(world);
    model.notices.extend(left_out);
    Ok(model)
}

fn find(path: &Path) -> Result<&'static Loader, FormatError> {
    let extension = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    if let Some(loader) = LOADERS.iter().find(|loader| loader.extension == extension) {
        return Ok(loader);
    }
    // What is not there has no kind.
    if let Err(source) = std::fs::metadata(path)
        && source.kind() == io::ErrorKind::NotFound
    {
        return Err(FormatError::Io {
            path: path.into(),
            source,
        });
    }
    let known: Vec<_> = extensions()
        .map(|extension| format!(".{extension}"))
        .collect();
    let known = known.join(", ");
    Err(FormatError::unsupported(
        path,
        format!("unknown kind of file; known are {known}"),
    ))
}

/// The world of a mesh file: each part an object, named after the file where it has no name.
fn world(model: Model, path: &Path) -> Result<World, FormatError> {
    let scene = |source| FormatError::Scene {
        path: Some(path.into()),
        source,
    };
    let mut world = World {
        notices: model.notices,
        ..World::default()
    };
    for texture in model.textures {
        world.add_texture(texture);
    }
    for material in model.materials {
        world.add_material(material).map_err(scene)?;
    }
    for part in model.parts {
        let name = match &part.name[..] {
            "" => path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            name => name.to_owned(),
        };
        let mesh = world.add_mesh(part.mesh);
        let object = Object::new(name, mesh, part.materials, DAffine3::IDENTITY);
        world.add_object(object).map_err(scene)?;
    }
    Ok(world)
}
