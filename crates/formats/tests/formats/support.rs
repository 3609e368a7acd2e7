//! Files for tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use raycam_formats::{Budget, FormatError, decode_model};
use raycam_scene::{Mesh, MeshFile, Notice, NoticeCode, Texels, Texture};

/// Creates a new empty folder.
pub fn folder() -> PathBuf {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{number}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Creates a file in a new folder.
pub fn file(name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// Path of a file in `tests/data`.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn decode(name: &str, bytes: impl AsRef<[u8]>) -> Result<MeshFile, FormatError> {
    decode_model(bytes.as_ref().to_vec(), Path::new(name), &Budget::default())
}

/// Model in a file of these bytes.
pub fn model(name: &str, bytes: impl AsRef<[u8]>) -> MeshFile {
    decode(name, bytes).unwrap_or_else(|error| panic!("{error}"))
}

/// Mesh of the only part of a model in a file of these bytes.
pub fn mesh(name: &str, bytes: impl AsRef<[u8]>) -> Mesh {
    let mut model = model(name, bytes);
    assert_eq!(model.parts.len(), 1);
    model.parts.remove(0).mesh
}

/// Error of a file of these bytes, without its folder.
pub fn error(name: &str, bytes: impl AsRef<[u8]>) -> String {
    decode(name, bytes).unwrap_err().to_string()
}

/// Message of an error, without the folder of the file.
pub fn message(error: FormatError, path: &Path) -> String {
    error.to_string().replace(&format!("{}/", path.parent().unwrap().display()), "")
}

/// Surface area of a mesh.
pub fn area(mesh: &Mesh) -> f64 {
    let corner = |i: u32| mesh.vertices[i as usize];
    let triangle = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a));
    mesh.triangles.iter().map(|t| triangle(t).length() / 2.0).sum()
}

/// Vector area: zero if a surface is closed and consistently oriented.
pub fn vector_area(mesh: &Mesh) -> DVec3 {
    let corner = |i: u32| mesh.vertices[i as usize];
    let triangle = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a));
    mesh.triangles.iter().map(triangle).sum::<DVec3>() / 2.0
}

/// Asserts that every truncated file is an error, equals the complete file, or has a notice about missing data or
/// faces. `may_end` contains the lengths at which a text without counts may end unnoticed.
pub fn truncations(name: &str, bytes: &[u8], may_end: impl Fn(usize) -> bool) {
    let whole = decode(name, bytes).unwrap();
    for length in 0..bytes.len() {
        if let Ok(model) = decode(name, &bytes[..length]) {
            let codes = [NoticeCode::TruncatedData, NoticeCode::DroppedGeometry];
            let is_reported = model.notices.iter().any(|notice| codes.contains(&notice.code));
            assert!(is_reported || model == whole || may_end(length), "{name}: {length} bytes of {}", bytes.len());
        }
    }
}

/// Damages single bytes in many ways; nothing may panic, and all data that is read must be consistent.
pub fn mutations(name: &str, bytes: &[u8], count: usize) {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as usize) % below
    };
    for _ in 0..count {
        let mut damaged = bytes.to_vec();
        for _ in 0..1 + random(3) {
            let at = random(damaged.len());
            match random(4) {
                0 => damaged[at] = random(256) as u8,
                1 => damaged[at] = b"0123456789 -./\n\\#fvo"[random(20)],
                2 => drop(damaged.remove(at)),
                _ => damaged.insert(at, b"9 /-\n\0\xff"[random(7)]),
            }
        }
        if let Ok(model) = decode(name, damaged) {
            for part in &model.parts {
                part.mesh.validate().unwrap();
            }
        }
    }
}

/// Red, green and blue of an sRGB texture.
pub fn rgb(texture: &Texture) -> Vec<[u8; 3]> {
    match &texture.image.texels {
        Texels::Srgb8(texels) => texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        other => panic!("{other:?}"),
    }
}

/// Texts of notices.
pub fn texts(notices: &[Notice]) -> Vec<String> {
    notices.iter().map(Notice::to_string).collect()
}
