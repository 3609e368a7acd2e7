//! What each fuzz target does with its bytes: nothing may panic, hang or take more memory than its budget.

use std::path::Path;

use raycam_formats::codec::{draco, meshopt};
use raycam_formats::{Budget, ColorUse, decode_image, decode_model, world_file};

/// Small, so that what a file may ask for is reached often.
fn budget() -> Budget {
    Budget {
        bytes: 1 << 22,
        elements: 1 << 20,
        pixels: 1 << 20,
        steps: 1 << 20,
    }
}

/// A mesh file, whose kind the extension of `name` says. Nothing is there for it to name.
pub fn model(name: &str, bytes: &[u8]) {
    let path = Path::new("/nonexistent").join(name);
    if let Ok(model) = decode_model(bytes.to_vec(), &path, &budget()) {
        for part in &model.parts {
            part.mesh.validate().expect("what is read fits together");
        }
    }
}

/// An image whose first bytes are `magic`.
pub fn image(magic: &[u8], bytes: &[u8]) {
    let file = [magic, bytes.strip_prefix(magic).unwrap_or(bytes)].concat();
    for color_use in [ColorUse::Color, ColorUse::Data] {
        let path = Path::new("image");
        let image = decode_image(&file, path, color_use, &mut budget(), &mut Vec::new());
        if let Ok(image) = image {
            let [columns, rows] = image.size.map(u64::from);
            assert_eq!(image.texels.len() as u64, columns * rows);
        }
    }
}

/// A world file; nothing is there for it to name.
pub fn world(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let folder = Path::new("/nonexistent");
        let _ = world_file::parse(text, folder, &folder.join("world.toml"), &budget());
    }
}

/// A stream of Draco.
pub fn draco(bytes: &[u8]) {
    if let Ok(mesh) = draco::decode(bytes, Path::new("mesh"), &mut budget()) {
        let corners = mesh.triangles.as_flattened();
        assert!(corners.iter().all(|&corner| (corner as usize) < mesh.count));
    }
}

/// A stream of meshoptimizer, whose shape its first four bytes tell.
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
    let shape = meshopt::Shape {
        mode,
        count: u16::from_le_bytes([*low, *high]).into(),
        stride: 1 + usize::from(*stride),
    };
    if let Ok(decoded) = meshopt::decode(bytes, shape, Path::new("view"), &mut budget()) {
        assert_eq!(decoded.len(), shape.count * shape.stride);
    }
}
