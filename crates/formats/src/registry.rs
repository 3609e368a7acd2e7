//! Table of file formats, and loading of files according to this table.

use std::fs::File;
use std::path::Path;

use glam::DAffine3;
use raycam_scene::{ErrorCode, MeshFile, Notice, NoticeCode, Object, World, counted};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::geometry::finite::{self, NonFinite};
use crate::io::memory_files::MemoryFiles;
use crate::io::{AssetRoot, InputFile, file_kind, lexer, stand_in};
use crate::{gltf, obj, off, ply, stl, world_file};

/// File format: its extension and its reader.
struct FileFormat {
    /// Extension in lower case, without the dot.
    extension: &'static str,
    read: Reader,
    /// Function that returns the number of bytes of a large file that the reader requires in memory; `None` for all
    /// bytes.
    head: fn(&File, u64) -> Option<u64>,
}

enum Reader {
    World(fn(&InputFile, &mut AssetRoot) -> Result<World>),
    /// Format whose files are complete worlds and can also be used as objects of other worlds.
    Scene(fn(&InputFile, &mut AssetRoot) -> Result<World>),
    Model(fn(&InputFile, &mut AssetRoot) -> Result<MeshFile>),
}

/// All formats.
const FORMATS: &[FileFormat] = &[
    FileFormat { extension: "toml", read: Reader::World(world_file::read), head: read_whole },
    FileFormat { extension: "gltf", read: Reader::Scene(gltf::read), head: read_whole },
    FileFormat { extension: "glb", read: Reader::Scene(gltf::read), head: gltf::head },
    FileFormat { extension: "obj", read: Reader::Model(obj::read), head: read_whole },
    FileFormat { extension: "ply", read: Reader::Model(ply::read), head: ply::head },
    FileFormat { extension: "stl", read: Reader::Model(stl::read), head: stl::head },
    FileFormat { extension: "off", read: Reader::Model(off::read), head: read_whole },
];

/// Extensions of the files that [`load`] reads, in lower case and without the dot.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|format| format.extension)
}

/// Extensions of the files that worlds and models refer to: materials, buffers, images and light profiles.
pub const COMPANION_EXTENSIONS: &[&str] =
    &["mtl", "bin", "png", "jpg", "jpeg", "hdr", "exr", "tga", "bmp", "gif", "webp", "ktx2", "tif", "tiff", "ies"];

/// Reads the world in a file: `.toml`, `.gltf`, `.glb`, `.obj`, `.ply`, `.stl`, `.off`, in upper or lower case.
///
/// A mesh file (except glTF, which contains worlds) becomes a world in which each part is an object, without lights and
/// cameras, z up.
///
/// # Errors
/// See [`FormatError`]; for an unknown extension, the message lists the known ones.
pub fn load(path: &Path, budget: &Budget) -> Result<World> {
    load_within(path, None, budget)
}

/// Reads the world in a file, like [`load`]; the files of the world are in `folder` (default: the folder of the file).
///
/// # Errors
/// Same as [`load`].
pub fn load_within(path: &Path, folder: Option<&Path>, budget: &Budget) -> Result<World> {
    let mut assets = AssetRoot::of_file(path, folder, budget);
    let source = open_input(path, &mut assets)?;
    read_world(source, &mut assets)
}

/// Reads the world in one of the files in memory, like [`load`]; names in the file refer only to the other files in
/// memory.
///
/// # Errors
/// Same as [`load`].
pub fn load_from_memory(path: &Path, files: MemoryFiles, budget: &Budget) -> Result<World> {
    let mut assets = AssetRoot::of_memory(path, files, budget);
    let source = open_input(path, &mut assets)?;
    read_world(source, &mut assets)
}

/// World in a file that has been read.
fn read_world(source: InputFile, assets: &mut AssetRoot) -> Result<World> {
    let (source, read) = checked(source)?;
    let mut world = match read {
        Reader::World(read) | Reader::Scene(read) => read(&source, assets)?,
        Reader::Model(_) => {
            let path = source.path.clone();
            world_of_parts(read_mesh_file(source, assets)?, &path)?
        }
    };
    assets.finish_world(&mut world)?;
    Ok(world)
}

/// Reads the model in a mesh file: `.obj` and `.gltf` with their materials and textures, `.glb`, `.ply`, `.stl`,
/// `.off`.
///
/// # Errors
/// See [`FormatError`].
pub fn read_model(path: &Path, budget: &Budget) -> Result<MeshFile> {
    let mut assets = AssetRoot::containing(path, budget);
    read_mesh_file(open_input(path, &mut assets)?, &mut assets)
}

/// Reads a file: if its format is known, the bytes that the format's reader requires in memory, otherwise all bytes.
fn open_input(path: &Path, assets: &mut AssetRoot) -> Result<InputFile> {
    match named_format(path) {
        Some(format) => assets.read_head(path, format.head),
        // The extension is unknown, so the complete file is read: its contents may determine the format.
        None => assets.read(path),
    }
}

/// Format determined by a file's contents, or otherwise by its extension.
fn format_of_content(path: &Path, bytes: &[u8]) -> Result<&'static FileFormat> {
    let named = named_format(path);
    let sniffed = file_kind::model_extension(bytes);
    // Some texts match several formats, so a known extension decides.
    let sniffed = sniffed.or_else(|| named.is_none().then(|| text_extension(bytes)).flatten());
    match (named, sniffed) {
        (Some(format), Some("glb")) if format.extension == "gltf" => Ok(format),
        // A binary STL file begins with 80 arbitrary bytes.
        (Some(format), Some(_)) if format.extension == "stl" && stl::has_binary_length(bytes) => Ok(format),
        (named, found) => {
            let found = found.and_then(|found| FORMATS.iter().find(|format| format.extension == found));
            found.or(named).map_or_else(|| format_of(path), Ok)
        }
    }
}

/// Extension of the format whose markers a text, or a binary STL file, contains.
fn text_extension(bytes: &[u8]) -> Option<&'static str> {
    const HEAD: usize = 1 << 16;
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
    let text = head.trim_start_matches('\u{feff}').trim_start();
    let begins = |words: &[&str]| words.iter().any(|word| text.starts_with(word));
    let has_line =
        |key: &[u8]| bytes.starts_with(key) || bytes.windows(key.len() + 1).any(|w| w[0] == b'\n' && w[1..] == *key);
    if text.starts_with('{') && text.contains("\"asset\"") {
        Some("gltf")
    } else if stl::has_binary_length(bytes) || (begins(&["solid", "SOLID"]) && text.to_lowercase().contains("facet")) {
        Some("stl")
    } else if begins(&["OFF", "COFF", "NOFF", "CNOFF", "STOFF"]) {
        Some("off")
    } else if has_line(b"v ") && has_line(b"f ") {
        Some("obj")
    } else {
        None
    }
}

/// Function `head` of a format whose reader requires the complete file.
fn read_whole(_: &File, _: u64) -> Option<u64> {
    None
}

/// Reads the world in the bytes of a file; `path` is its name as for [`load`].
///
/// # Errors
/// See [`FormatError`].
pub fn decode(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<World> {
    stand_in::check(path, &bytes)?;
    read_world(InputFile::new(path, bytes), &mut AssetRoot::containing(path, budget))
}

/// Reads the model in the bytes of a mesh file. `path` determines the format, is used in errors, and its folder
/// contains the files to which the mesh file refers.
///
/// # Errors
/// See [`FormatError`].
pub fn decode_model(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<MeshFile> {
    stand_in::check(path, &bytes)?;
    read_mesh_file(InputFile::new(path, bytes), &mut AssetRoot::containing(path, budget))
}

/// Model in a mesh file that has been read; all its parts are consistent.
pub(crate) fn read_mesh_file(source: InputFile, assets: &mut AssetRoot) -> Result<MeshFile> {
    let (source, read) = checked(source)?;
    let mut model = match read {
        Reader::Model(read) => read(&source, assets)?,
        Reader::Scene(read) => flatten_world(read(&source, assets)?, &source.path, assets)?,
        Reader::World(_) => {
            return Err(FormatError::unsupported(&source.path, "a world file; expected a mesh file"));
        }
    };
    check_parts(&mut model, &source.path)?;
    Ok(model)
}

/// Converts a file from UTF-16 to UTF-8 if it is marked as UTF-16, and finds its format. Returns the file, and the
/// reader of the format; contents that contradict the extension are an error.
fn checked(mut source: InputFile) -> Result<(InputFile, &'static Reader)> {
    source.bytes = lexer::without_utf16(source.bytes);
    // The format of a file that is read in parts is certain, because its length has been checked.
    let format = match source.rest {
        Some(_) => format_of(&source.path)?,
        None => format_of_content(&source.path, &source.bytes)?,
    };
    // A byte order mark does not belong to a PLY file; the other readers support it.
    if format.extension == "ply" && source.bytes.starts_with(b"\xef\xbb\xbfply") {
        source.bytes.drain(..3);
    }
    file_kind::check_model(&source.path, &source.bytes, format.extension)?;
    Ok((source, &format.read))
}

/// Validates the parts of a model, after omitting faces with vertices that are not finite, with a notice.
fn check_parts(model: &mut MeshFile, path: &Path) -> Result<()> {
    let mut found = NonFinite::default();
    for part in &mut model.parts {
        // Only invalid parts are searched for vertices that are not finite, because the search takes time.
        if let Err(source) = part.mesh.validate() {
            let dropped = finite::drop_non_finite(&mut part.mesh);
            if dropped.vertices == 0 {
                return Err(FormatError::Scene { path: Some(path.into()), source });
            }
            found.vertices += dropped.vertices;
            found.triangles += dropped.triangles;
        }
    }
    if let Some(message) = found.message() {
        model.notices.push(Notice::new(NoticeCode::DroppedGeometry, format!("{}: {message}", path.display())));
        model.parts.retain(|part| !part.mesh.triangles.is_empty());
        if model.parts.is_empty() {
            return Err(FormatError::whole(
                path,
                ErrorCode::NothingVisible.message(
                    "all faces have vertices that are not finite; there is nothing to \
                    render",
                ),
            ));
        }
    }
    for part in model.parts.iter().filter(|_| found.vertices > 0) {
        part.mesh.validate().map_err(|error| FormatError::Scene { path: Some(path.into()), source: error })?;
    }
    Ok(())
}

/// Model of a world whose objects are joined into one. Every copy of a mesh is charged to the budget.
fn flatten_world(world: World, path: &Path, assets: &mut AssetRoot) -> Result<MeshFile> {
    let [lights, cameras] = [counted(world.lights.len(), "light"), counted(world.cameras.len(), "camera")];
    let left_out = (!world.lights.is_empty() || !world.cameras.is_empty()).then(|| {
        let file = path.display();
        let message = format!("{file} is used as an object: its {lights} and {cameras} are omitted");
        Notice::new(NoticeCode::IgnoredElement, message)
    });
    for object in &world.objects {
        let mesh = &world.meshes[object.mesh];
        let amount = mesh.vertices.len() + 3 * mesh.triangles.len();
        assets.budget.take_elements(path, amount as u64)?;
    }
    let mut model = MeshFile::from_world(world);
    model.notices.extend(left_out);
    Ok(model)
}

/// Extensions of USD files, which the Python package reads.
const USD_EXTENSIONS: [&str; 4] = ["usd", "usda", "usdc", "usdz"];

/// Format determined by the extension of a file's name.
fn named_format(path: &Path) -> Option<&'static FileFormat> {
    let extension = extension_of(path);
    FORMATS.iter().find(|format| format.extension == extension)
}

fn extension_of(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn format_of(path: &Path) -> Result<&'static FileFormat> {
    if let Some(format) = named_format(path) {
        return Ok(format);
    }
    let extension = extension_of(path);
    if USD_EXTENSIONS.contains(&extension.as_str()) {
        let message = ErrorCode::UnknownFormat.message(
            "USD files can only be read by raycam.load and World.add_object in Python; for other uses, such as world \
             files, convert the file once with raycam.load(\"x.usd\").to_gltf(\"x.glb\")",
        );
        return Err(FormatError::unsupported(path, message));
    }
    let known: Vec<_> = extensions().map(|extension| format!(".{extension}")).collect();
    let known = known.join(", ");
    let message = ErrorCode::UnknownFormat.message(format!(
        "unknown file format; supported: {known}, and .usd, .usda, .usdc, .usdz from Python (raycam[usd]); convert \
         other files to .glb, or load them with raycam.from_trimesh(trimesh.load(...))"
    ));
    Err(FormatError::unsupported(path, message))
}

/// World of a mesh file: each part becomes an object, named after the file if the part has no name.
fn world_of_parts(model: MeshFile, path: &Path) -> Result<World> {
    let scene = |source| FormatError::Scene { path: Some(path.into()), source };
    let mut world = World { notices: model.notices, ..World::default() };
    for texture in model.textures {
        world.add_texture(texture);
    }
    for material in model.materials {
        world.add_material(material).map_err(scene)?;
    }
    for part in model.parts {
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
