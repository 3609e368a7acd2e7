//! Mesh files and images that the worlds of one recipe share.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use raycam_formats::{AssetRoot, FormatError};
use raycam_render::PreparedFamily;
use raycam_scene::{ColorUse, Image, Notice, SingleMesh, Texture, Up, Wrap};

/// Maximum total size of shared files in bytes; files beyond this size are read again for each world.
const MAX_BYTES: usize = 1 << 30;

/// A file's contents, and the notices of its reader.
type Read<T> = (T, Vec<Notice>);

/// The files of one folder that were read for a world, and the textures and meshes that were built from these files.
/// Files are assumed not to change.
#[pyclass(frozen, module = "raycam._core")]
#[derive(Default)]
pub(crate) struct SharedFiles {
    /// The lock is held only for look-ups. No file is read during a look-up, and a forked process finds the lock free.
    files: Mutex<Files>,
    /// The search trees and textures of the worlds.
    pub(crate) family: Arc<PreparedFamily>,
}

#[derive(Default)]
struct Files {
    meshes: HashMap<(String, Option<Up>), Read<SingleMesh>>,
    textures: HashMap<(String, [Wrap; 2], bool), Read<Texture>>,
    environments: HashMap<String, Read<Arc<Image>>>,
    bytes: usize,
}

#[pymethods]
impl SharedFiles {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// The number of files that are kept.
    fn __len__(&self) -> usize {
        let files = self.lock();
        files.meshes.len() + files.textures.len() + files.environments.len()
    }
}

impl SharedFiles {
    fn lock(&self) -> MutexGuard<'_, Files> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a mesh file that was read with the same up axis, if it is kept.
    pub(crate) fn mesh(&self, file: &str, up: Option<Up>) -> Option<Read<SingleMesh>> {
        self.lock().meshes.get(&(file.to_owned(), up)).cloned()
    }

    /// Keeps a mesh file for other worlds.
    pub(crate) fn keep_mesh(&self, file: &str, up: Option<Up>, mesh: &SingleMesh, notices: &[Notice]) {
        let images: usize = mesh.textures.iter().map(|texture| image_bytes(&texture.image)).sum();
        // The size of positions, normals and texture coordinates of each vertex, and of the indices of each triangle.
        let bytes = images + mesh.mesh.vertices.len() * 44 + mesh.mesh.triangles.len() * 12;
        let read = (mesh.clone(), notices.to_vec());
        self.lock().keep(bytes, |files| {
            files.meshes.insert((file.to_owned(), up), read);
        });
    }

    /// The texture of a file. The file is read if no other world has read it.
    pub(crate) fn texture(
        &self,
        files: &mut AssetRoot,
        key: (&str, [Wrap; 2], ColorUse),
        read: impl FnOnce(&mut AssetRoot) -> Result<Texture, FormatError>,
    ) -> Result<Texture, FormatError> {
        let (file, wrap, color_use) = key;
        let key = (file.to_owned(), wrap, color_use == ColorUse::Color);
        self.read(files, key, |files| &mut files.textures, |texture| image_bytes(&texture.image), read)
    }

    /// The environment image of a file. The file is read if no other world has read it.
    pub(crate) fn environment(
        &self,
        files: &mut AssetRoot,
        file: &str,
        read: impl FnOnce(&mut AssetRoot) -> Result<Arc<Image>, FormatError>,
    ) -> Result<Arc<Image>, FormatError> {
        self.read(files, file.to_owned(), |files| &mut files.environments, |image| image_bytes(image), read)
    }

    fn read<K: Eq + Hash, T: Clone>(
        &self,
        files: &mut AssetRoot,
        key: K,
        kept: impl Fn(&mut Files) -> &mut HashMap<K, Read<T>>,
        bytes: impl FnOnce(&T) -> usize,
        read: impl FnOnce(&mut AssetRoot) -> Result<T, FormatError>,
    ) -> Result<T, FormatError> {
        let known = kept(&mut self.lock()).get(&key).cloned();
        if let Some((found, notices)) = known {
            files.repeat_notices(&notices);
            return Ok(found);
        }
        let before = files.notices().len();
        let found = read(files)?;
        let notices = files.notices()[before..].to_vec();
        self.lock().keep(bytes(&found), |files| {
            kept(files).insert(key, (found.clone(), notices));
        });
        Ok(found)
    }
}

impl Files {
    /// Keeps a file if there is room for its bytes.
    fn keep(&mut self, bytes: usize, insert: impl FnOnce(&mut Self)) {
        if self.bytes + bytes <= MAX_BYTES {
            self.bytes += bytes;
            insert(self);
        }
    }
}

/// Upper bound of an image's memory in bytes, without its mip maps.
fn image_bytes(image: &Image) -> usize {
    image.size[0] as usize * image.size[1] as usize * 16
}
