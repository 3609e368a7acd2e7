//! Bodies of the fuzz targets. No reader may panic, hang or exceed its memory budget.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use raycam_calibration::{CameraRecord, PoseHints, ReadHints};
use raycam_formats::codec::{draco, meshopt};
use raycam_formats::{Budget, ColorUse, AssetRoot, decode_image, decode_model, world_file};
use raycam_scene::{AssetLoader, PixelCenter, World};

/// Separator between the files of an input that contains several files.
pub const BETWEEN: &[u8] = b"\n\0\n";

/// Folder for files that a reader opens by itself, one for each process. It is in memory if the system has such a
/// folder, because the disk would limit the speed.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let place = if memory.is_dir() {
        memory.into()
    } else {
        std::env::temp_dir()
    };
    let folder = place.join(format!("raycam-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
});

/// Writes the files of an input under these names. If the input has fewer, the remaining files do not exist.
fn write_files(names: &[&str], bytes: &[u8]) {
    let mut rest = Some(bytes);
    for name in names {
        let path = FOLDER.join(name);
        let Some(bytes) = rest else {
            let _ = fs::remove_file(path);
            continue;
        };
        let end = bytes.windows(BETWEEN.len()).position(|w| w == BETWEEN);
        rest = end.map(|end| &bytes[end + BETWEEN.len()..]);
        fs::write(path, &bytes[..end.unwrap_or(bytes.len())]).expect("room for a file");
    }
}

/// The limits are small, so that cases often reach them and take only microseconds.
fn budget() -> Budget {
    Budget {
        bytes: 1 << 20,
        elements: 1 << 16,
        pixels: 1 << 14,
        steps: 1 << 16,
        ..Budget::default()
    }
}

/// Reads a mesh file; the extension of `name` selects its format. Files that it names do not exist.
pub fn model(name: &str, bytes: &[u8]) {
    let path = Path::new("/nonexistent").join(name);
    if let Ok(model) = decode_model(bytes.to_vec(), &path, &budget()) {
        for part in &model.parts {
            part.mesh.validate().expect("what is read fits together");
        }
    }
}

/// Reads an image whose first bytes are `magic`. The image is read as colours if its length is even, otherwise as data.
pub fn image(magic: &[u8], bytes: &[u8]) {
    let file = [magic, bytes.strip_prefix(magic).unwrap_or(bytes)].concat();
    let color_use = match file.len() % 2 {
        0 => ColorUse::Color,
        _ => ColorUse::Data,
    };
    let path = Path::new("image");
    // The budget has fewer pixels than for the textures of a mesh, because more pixels of the same kind would find no
    // further faults.
    let mut budget = Budget {
        pixels: 1 << 9,
        ..budget()
    };
    if let Ok(image) = decode_image(&file, path, color_use, &mut budget, &mut Vec::new()) {
        let [columns, rows] = image.size.map(u64::from);
        assert_eq!(image.texels.len() as u64, columns * rows);
    }
}

/// Reads a world file. Files that it names do not exist.
pub fn world(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let folder = Path::new("/nonexistent");
        let _ = world_file::parse(text, folder, &folder.join("world.toml"), &budget());
    }
}

/// Reads a Draco stream.
pub fn draco(bytes: &[u8]) {
    if let Ok(mesh) = draco::decode(bytes, Path::new("mesh"), &mut budget()) {
        let corners = mesh.triangles.as_flattened();
        assert!(corners.iter().all(|&corner| (corner as usize) < mesh.count));
    }
}

/// Reads a meshoptimizer stream, whose layout is given by its first four bytes.
pub fn meshopt(bytes: &[u8]) {
    let Some(([kind, stride, low, high], bytes)) = bytes.split_first_chunk() else {
        return;
    };
    let filters = [
        meshopt::Filter::None,
        meshopt::Filter::Octahedral,
        meshopt::Filter::Quaternion,
        meshopt::Filter::Exponential,
        meshopt::Filter::Color,
    ];
    let mode = match kind % 7 {
        5 => meshopt::Mode::Triangles,
        6 => meshopt::Mode::Indices,
        filter => meshopt::Mode::Attributes(filters[usize::from(filter)]),
    };
    let shape = meshopt::ViewHeader {
        mode,
        count: u16::from_le_bytes([*low, *high]).into(),
        stride: 1 + usize::from(*stride),
    };
    if let Ok(decoded) = meshopt::decode(bytes, shape, Path::new("view"), &mut budget()) {
        assert_eq!(decoded.len(), shape.count * shape.stride);
    }
}

/// Reads a glTF document and its binary chunk of any lengths, as found inside a GLB container.
pub fn gltf(bytes: &[u8]) {
    let end = bytes.windows(BETWEEN.len()).position(|w| w == BETWEEN);
    let (json, binary) = match end {
        Some(end) => (&bytes[..end], &bytes[end + BETWEEN.len()..]),
        None => return model("a.gltf", bytes),
    };
    model("a.glb", &container(json, binary));
}

/// Builds a GLB file from a document and a binary chunk.
pub fn container(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut chunks = Vec::new();
    for (kind, bytes, pad) in [(b"JSON", json, b' '), (b"BIN\0", binary, 0)] {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), pad);
        chunks.extend((bytes.len() as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(bytes);
    }
    let length = 12 + chunks.len() as u32;
    let head = [*b"glTF", 2_u32.to_le_bytes(), length.to_le_bytes()].concat();
    [head, chunks].concat()
}

/// Reads a material library through an OBJ file that uses three of its materials.
pub fn materials(bytes: &[u8]) {
    write_files(&["a.mtl"], bytes);
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1 2 3\n\
        usemtl\nf 1 2 3\n";
    if let Ok(model) = decode_model(obj.to_vec(), &FOLDER.join("a.obj"), &budget()) {
        for material in &model.materials {
            material.validate().expect("what is read can be shown");
        }
    }
}

/// Reads a light profile.
pub fn profile(bytes: &[u8]) {
    write_files(&["a.ies"], bytes);
    if let Ok(profile) = AssetRoot::new(&FOLDER, &budget()).profile("a.ies") {
        profile.validate().expect("what is read can be shown");
    }
}

/// Reads a packed world, after its header line.
pub fn bundle(bytes: &[u8]) {
    static LINE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let empty = raycam_formats::bundle::write(&World::default()).expect("an empty world");
        empty
            .split_inclusive(|&b| b == b'\n')
            .next()
            .expect("a line")
            .to_vec()
    });
    let file = [&LINE, bytes].concat();
    let _ = raycam_formats::bundle::read(&file, Path::new("world"), budget());
}

/// Reads cameras in a calibration format; for COLMAP, the files of its folder.
pub fn cameras(format: &str, bytes: &[u8]) {
    let mut intrinsics = CameraRecord::new("known", PixelCenter::Integer);
    intrinsics.k = Some(glam::DMat3::from_diagonal(glam::DVec3::new(
        100.0, 100.0, 1.0,
    )));
    let known = ReadHints {
        size: Some([64, 48]),
        intrinsics: Some(intrinsics),
        lens: None,
        poses: PoseHints::default(),
    };
    let path = match format {
        "colmap" => {
            write_files(
                &["cameras.txt", "images.txt", "rigs.txt", "frames.txt"],
                bytes,
            );
            FOLDER.join("cameras.txt")
        }
        "colmap-binary" => {
            write_files(
                &["cameras.bin", "images.bin", "rigs.bin", "frames.bin"],
                bytes,
            );
            FOLDER.join("cameras.bin")
        }
        _ => PathBuf::from("/nonexistent/calibration"),
    };
    let read = match format {
        "colmap" | "colmap-binary" => raycam_calibration::read(&path, Some(format), &known, &budget()),
        _ => raycam_calibration::decode(bytes.to_vec(), &path, Some(format), &known, &budget()),
    };
    if let Ok(calibration) = read {
        for record in &calibration.records {
            let _ = record.camera();
        }
        let _ = raycam_calibration::write(&calibration.records, Path::new("out"), format);
    }
}

/// Reads cameras from a file whose format is detected from its contents: text, XML, JSON, NumPy arrays, packed files.
pub fn any_cameras(bytes: &[u8]) {
    let known = ReadHints {
        size: Some([64, 48]),
        ..ReadHints::default()
    };
    let path = Path::new("/nonexistent/calibration");
    if let Ok(calibration) = raycam_calibration::decode(bytes.to_vec(), path, None, &known, &budget()) {
        for record in &calibration.records {
            let _ = record.camera();
        }
        for format in raycam_calibration::written_formats() {
            let _ = raycam_calibration::write(&calibration.records, Path::new("out"), format);
        }
    }
}

/// Reads cameras in the format selected by the first byte, so that readers without a recognisable header are tested as
/// often as the others.
pub fn named_cameras(bytes: &[u8]) {
    let Some((pick, bytes)) = bytes.split_first() else {
        return;
    };
    let names: Vec<&str> = raycam_calibration::formats().collect();
    let format = names[usize::from(*pick) % names.len()];
    let known = ReadHints {
        size: Some([64, 48]),
        ..ReadHints::default()
    };
    let path = Path::new("/nonexistent/calibration");
    if let Ok(calibration) =
        raycam_calibration::decode(bytes.to_vec(), path, Some(format), &known, &budget())
    {
        for record in &calibration.records {
            let _ = record.camera();
        }
    }
}
