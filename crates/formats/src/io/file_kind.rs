//! Format of a file by its first bytes: a file with the wrong extension, or a compressed file, is reported as such.

use raycam_scene::ErrorCode;
use std::path::Path;

use crate::error::{FormatError, Result};

/// File format that is recognised by its first bytes.
struct FileKind {
    /// Offset of the format's signature in the file.
    at: usize,
    mark: &'static [u8],
    /// Name of the format with an article, for messages.
    name: &'static str,
    /// Extensions of models that begin with this signature.
    endings: &'static [&'static str],
    way: &'static str,
}

const UNPACK: &str = "decompress it first";
const RENAME: &str = "rename it with the extension of its format";
const CONVERT: &str = "convert it (raycam.from_trimesh(trimesh.load(...)), or to .glb)";
const PICTURE: &str = "convert it to PNG";

const fn kind(at: usize, mark: &'static [u8], name: &'static str, way: &'static str) -> FileKind {
    FileKind { at, mark, name, endings: &[], way }
}

const fn model(mark: &'static [u8], name: &'static str, endings: &'static [&'static str]) -> FileKind {
    FileKind { at: 0, mark, name, endings, way: RENAME }
}

const KINDS: &[FileKind] = &[
    kind(0, b"\x1f\x8b\x08", "a gzip file", UNPACK),
    kind(0, b"PK\x03\x04", "a ZIP archive", UNPACK),
    kind(0, b"\x28\xb5\x2f\xfd", "a Zstandard file", UNPACK),
    kind(0, b"BZh", "a bzip2 file", UNPACK),
    kind(0, b"\xfd7zXZ\0", "an XZ file", UNPACK),
    kind(0, b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", UNPACK),
    kind(0, b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    kind(257, b"ustar", "a tar archive", UNPACK),
    model(b"glTF", "a GLB file", &["glb", "gltf"]),
    model(b"ply\n", "a PLY file", &["ply"]),
    model(b"ply\r", "a PLY file", &["ply"]),
    model(b"#usda ", "a USD file", &[]),
    model(b"PXR-USDC", "a USD file", &[]),
    kind(0, b"Kaydara FBX", "an FBX file", CONVERT),
    kind(0, b"BLENDER", "a Blender file", "export it as .glb"),
    kind(0, b"\x89HDF", "an HDF5 file", CONVERT),
    kind(0, b"\x93NUMPY", "a NumPy array", "pass its numbers to World.add_mesh"),
    kind(0, b"%PDF", "a PDF document", CONVERT),
    kind(0, b"\x89PNG", "a PNG image", "open the mesh that uses it"),
    kind(0, b"\xff\xd8\xff", "a JPEG image", "open the mesh that uses it"),
    kind(4, b"ftypavif", "an AVIF image", PICTURE),
    kind(4, b"ftyphei", "an HEIC image", PICTURE),
    kind(4, b"ftypmif1", "an HEIF image", PICTURE),
    kind(0, b"8BPS", "a Photoshop image", PICTURE),
    kind(0, b"DDS ", "a DDS image", PICTURE),
    kind(4, b"jP  \r\n", "a JPEG 2000 image", PICTURE),
    kind(0, b"\xff\x0a", "a JPEG XL image", PICTURE),
    kind(4, b"JXL \r\n", "a JPEG XL image", PICTURE),
    kind(0, b"\0\0\x01\0", "a Windows icon", PICTURE),
    kind(0, b"<svg", "an SVG drawing", PICTURE),
    kind(0, b"\xabKTX 11", "a KTX image, version 1", "convert it to KTX2 or PNG"),
    kind(0, b"P6", "a PPM image", PICTURE),
    kind(0, b"sB", "a Basis image", "convert it to KTX2"),
];

/// Format of a file and a remedy, in words for messages; `None` for formats that are not in the list.
pub(crate) fn described(bytes: &[u8]) -> Option<String> {
    found(bytes).map(|kind| format!("{}: {}", kind.name, kind.way))
}

/// Extension of the model format to which a file's first bytes belong, for any file name; `None` for other files.
pub(crate) fn model_extension(bytes: &[u8]) -> Option<&'static str> {
    found(bytes)?.endings.first().copied()
}

/// Rejects a model if its first bytes belong to another format than its extension (in lower case).
pub(crate) fn check_model(path: &Path, bytes: &[u8], ending: &str) -> Result<()> {
    // A binary STL file begins with 80 arbitrary bytes.
    let facets = bytes.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]));
    if ending == "stl" && facets.is_some_and(|facets| facets > 0 && bytes.len() as u64 >= 84 + 50 * u64::from(facets)) {
        return Ok(());
    }
    match found(bytes).filter(|kind| kind.mark.len() > 2 && !kind.endings.contains(&ending)) {
        None => Ok(()),
        Some(FileKind { name, way, .. }) => {
            let message = format!("the file is {name}, not a .{ending} file; {way}");
            Err(FormatError::whole(path, ErrorCode::WrongFormat.message(message)))
        }
    }
}

fn found(bytes: &[u8]) -> Option<&'static FileKind> {
    KINDS.iter().find(|kind| bytes.get(kind.at..).is_some_and(|rest| rest.starts_with(kind.mark)))
}
