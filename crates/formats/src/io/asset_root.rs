//! The folder that a world may read from: I/O alone, no formats.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use raycam_scene::{Image, TextureCache, World};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::io::byte_source;
use crate::io::input_file::InputFile;
use crate::io::parallel;

/// A folder with the rest of the budget: names in files lead only to regular files inside.
#[derive(Debug)]
pub struct AssetRoot {
    root: PathBuf,
    pub(crate) budget: Budget,
    notices: Vec<String>,
    /// True if the program itself names the files: then they may lie anywhere.
    trusted: bool,
    /// Bounds the memory of images, if something does.
    texture_memory: Option<Arc<TextureCache>>,
}

/// Bytes from which on several threads read a file.
const PARALLEL_READ_THRESHOLD: u64 = 4 << 20;
/// Bytes that one thread reads at a time.
const READ_CHUNK: usize = 1 << 20;

impl AssetRoot {
    /// Everything inside `root`, symbolic links resolved, within `budget`. An empty `root` is the current folder.
    pub fn new(root: &Path, budget: &Budget) -> Self {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        Self {
            root: root.into(),
            budget: *budget,
            notices: Vec::new(),
            trusted: false,
            texture_memory: budget.texture_memory.map(TextureCache::new).map(Arc::new),
        }
    }

    /// The same, but that [`AssetLoader`] are named by the program itself: they lie anywhere, relative names start from `root`. What
    /// such a file names in turn lies in `root` as well, or in the folder of the file.
    pub fn trusted(root: &Path, budget: &Budget) -> Self {
        Self { trusted: true, ..Self::new(root, budget) }
    }

    /// The same root for additions to a world, whose texture cache it shares.
    #[must_use]
    pub fn extending(self, world: &World) -> Self {
        Self { texture_memory: world.texture_cache.clone(), ..self }
    }

    /// Removes and returns the notices of images; a [`MeshFile`](raycam_scene::MeshFile) has its own notices.
    pub(crate) fn drain_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// Completes a world that was read from here: adds the notices, and stores its images in the texture cache.
    ///
    /// # Errors
    /// Those of [`World::page_textures`].
    pub fn finish_world(&mut self, world: &mut World) -> Result<(), FormatError> {
        world.notices.extend(self.drain_notices());
        world.texture_cache = self.texture_memory.clone();
        Ok(world.page_textures()?)
    }

    /// The root of a file that the caller names: its folder, wherever that is.
    pub(crate) fn containing(path: &Path, budget: &Budget) -> Self {
        Self::new(path.parent().unwrap_or(Path::new("")), budget)
    }

    /// The rest of the budget.
    pub fn budget(&self) -> &Budget {
        &self.budget
    }

    /// The bytes of a file asked for by its path.
    pub(crate) fn read(&mut self, path: &Path) -> Result<InputFile, FormatError> {
        self.read_head(path, |_, _| None)
    }

    /// The same; of a large file only the first bytes, as many as `head` returns for the file and its size.
    pub(crate) fn read_head(
        &mut self,
        path: &Path,
        head: impl Fn(&File, u64) -> Option<u64>,
    ) -> Result<InputFile, FormatError> {
        self.read_bytes(path, path, head)
    }

    /// The bytes of the file that `reference` names, as written in the file `from`.
    pub(crate) fn read_reference(&mut self, from: &Path, reference: &str) -> Result<InputFile, FormatError> {
        let refused = |message: &str| FormatError::Reference { reference: reference.into(), message: message.into() };
        let folder = from.parent().unwrap_or(Path::new(""));
        let folder = folder.strip_prefix(&self.root).unwrap_or(folder);
        let inside = normalize(folder, reference).map_err(refused)?;
        let path = self.display_path(&inside);
        let io = |source| FormatError::Io { path: path.clone(), source };
        let root = self.root.canonicalize().map_err(io)?;
        let real = root.join(&inside).canonicalize().map_err(io)?;
        if !real.starts_with(&root) {
            return Err(refused("it leads out of the folder of the world file; copy it there"));
        }
        self.read_bytes(&real, &path, |_, _| None)
    }

    /// The path of a file as errors show it.
    fn display_path(&self, path: &Path) -> PathBuf {
        if self.root == Path::new(".") { path.into() } else { self.root.join(path) }
    }

    /// Reads `path`, called `shown` in errors.
    fn read_bytes(
        &mut self,
        path: &Path,
        shown: &Path,
        head: impl Fn(&File, u64) -> Option<u64>,
    ) -> Result<InputFile, FormatError> {
        let io = |source| FormatError::Io { path: shown.into(), source };
        let kind = |kind, message| io(io::Error::new(kind, message));
        // Checked before opening, since opening a pipe would wait for a writer. Reading a folder fails by itself.
        let status = fs::metadata(path).map_err(io)?;
        if !status.is_file() && !status.is_dir() {
            let message = "a device, pipe or socket, expected a regular file";
            return Err(kind(io::ErrorKind::InvalidInput, message));
        }
        let mut file = File::open(path).map_err(io)?;
        let size = file.metadata().map_err(io)?.len();
        self.budget.take_bytes(shown, size)?;
        let mut bytes = Vec::new();
        if byte_source::HAS_POSITIONED_READ
            && size >= PARALLEL_READ_THRESHOLD
            && let Some(head) = head(&file, size)
        {
            file.seek(SeekFrom::Start(0)).map_err(io)?;
            (&file).take(head).read_to_end(&mut bytes).map_err(io)?;
            if bytes.len() as u64 != head {
                return Err(io(byte_source::file_changed_error()));
            }
            return Ok(InputFile { path: shown.into(), bytes, rest: Some((file, size as usize)) });
        }
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        bytes.try_reserve_exact(size as usize).map_err(|e| io(e.into()))?;
        if size >= PARALLEL_READ_THRESHOLD {
            // Freed, so that the new pages are zero pages that several threads touch first.
            drop(bytes);
            bytes = vec![0; size as usize];
            read_at_once(&file, &mut bytes).map_err(io)?;
        }
        file.take(size + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 != size {
            return Err(io(byte_source::file_changed_error()));
        }
        Ok(InputFile::new(shown, bytes))
    }

    /// The result of `read` for a file that a description names.
    pub(crate) fn read_asset<T>(
        &mut self,
        file: &str,
        read: impl FnOnce(InputFile, &mut Self) -> Result<T, FormatError>,
    ) -> Result<T, FormatError> {
        match self.read_reference(Path::new(""), file) {
            Err(FormatError::Reference { .. }) if self.trusted && !file.is_empty() => {
                let path = self.display_path(Path::new(file));
                let mut containing =
                    Self { texture_memory: self.texture_memory.clone(), ..Self::containing(&path, &self.budget) };
                let result = containing.read(&path).and_then(|source| read(source, &mut containing));
                self.budget = containing.budget;
                self.notices.append(&mut containing.notices);
                result
            }
            source => read(source?, self),
        }
    }

    /// Stores an image in the texture cache, if the budget bounds the memory of images.
    pub(crate) fn store_texture(&self, image: Arc<Image>) -> Result<Arc<Image>, FormatError> {
        match &self.texture_memory {
            Some(memory) => Ok(memory.insert(image)?),
            None => Ok(image),
        }
    }

    /// The rest of the budget, and the notices of images.
    pub(crate) fn budget_and_notices(&mut self) -> (&mut Budget, &mut Vec<String>) {
        (&mut self.budget, &mut self.notices)
    }
}

/// Fills `bytes` from the beginning of a file, several parts at a time, and leaves it after them.
fn read_at_once(mut file: &File, bytes: &mut [u8]) -> io::Result<()> {
    if !byte_source::HAS_POSITIONED_READ {
        return file.read_exact(bytes);
    }
    parallel::fill_blocks(bytes, READ_CHUNK, |start, part| byte_source::read_exact_at(file, part, start as u64))?;
    file.seek(SeekFrom::Start(bytes.len() as u64)).map(drop)
}

/// The path of `reference` inside the root, relative to `folder`; or the reason of the refusal.
fn normalize(folder: &Path, reference: &str) -> Result<PathBuf, &'static str> {
    if reference.is_empty() || reference.contains('\0') {
        return Err("expected a file name");
    }
    if reference.contains('\\') {
        return Err("expected / between folders, not \\");
    }
    let scheme = reference.split('/').next().is_some_and(|start| start.contains(':'));
    if scheme || reference.starts_with('/') {
        return Err("expected a path relative to the file that names it, without a scheme or a drive");
    }
    let mut path = PathBuf::new();
    for component in folder.components().chain(Path::new(reference).components()) {
        match component {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => return Err("it leads out of the folder of the world file; copy it there"),
        }
    }
    Ok(path)
}
