//! The folder from which a world may read. This file contains only I/O and no formats.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{self, Component, Path, PathBuf};
use std::sync::Arc;

use raycam_scene::{Image, Notice, TextureCache, World};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::io::memory_files::MemoryFiles;
use crate::io::{InputFile, byte_source, parallel, reference, stand_in};

/// Folder with the remaining budget: names in files refer only to regular files inside it, also through symbolic links.
///
/// A file that the user names may be a link to any location. The files to which this file refers are then searched next
/// to the link and next to the link's target.
#[derive(Debug)]
pub struct AssetRoot {
    root: PathBuf,
    /// File that the user named; empty if that is the folder itself.
    named: PathBuf,
    /// If the user named a link: the folder of the link's target, with links resolved.
    target: Option<PathBuf>,
    /// Names of the files in each folder that has been searched.
    listings: HashMap<PathBuf, Vec<OsString>>,
    /// Number of files that have been searched for.
    searches: usize,
    /// Remaining budget.
    pub budget: Budget,
    notices: Vec<Notice>,
    /// True if the calling program itself names the files, which may then be in any folder.
    trusted: bool,
    /// True if the caller cannot choose another root, so that errors recommend to move the files instead.
    fixed: bool,
    /// Files in memory; if present, nothing is read from a disk.
    memory: Option<MemoryFiles>,
    /// Texture cache, which limits the memory of images; `None` without a limit.
    texture_memory: Option<Arc<TextureCache>>,
    /// True if the materials always define whether the alpha of an image is used.
    pub(crate) uses_alpha_as_written: bool,
}

/// Reason why a file cannot be read from the root.
enum Fault {
    /// The name is rejected, for this reason.
    Refused(String),
    Io(FormatError),
}

/// Minimum size in bytes of a file that several threads read.
const PARALLEL_READ_THRESHOLD: u64 = 4 << 20;
/// Number of bytes that one thread reads at a time.
const READ_CHUNK: usize = 1 << 20;
/// Maximum number of files per world that are searched for under other names than the written name.
const MAX_SEARCHES: usize = 1000;
/// Maximum number of names in a folder that a search examines.
const MAX_LISTED: usize = 10_000;

impl AssetRoot {
    /// Root that contains all files inside `root`, with symbolic links resolved, within `budget`. An empty `root` is
    /// the current folder.
    pub fn new(root: &Path, budget: &Budget) -> Self {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        Self {
            root: root.into(),
            named: PathBuf::new(),
            target: None,
            listings: HashMap::new(),
            searches: 0,
            budget: *budget,
            notices: Vec::new(),
            trusted: false,
            fixed: false,
            memory: None,
            texture_memory: budget.texture_memory.map(TextureCache::new).map(Arc::new),
            uses_alpha_as_written: false,
        }
    }

    /// Same as [`Self::new`], but the program itself names the files for `AssetLoader`: these files may be in any
    /// folder, and relative names start from `root`. Files to which such a file refers must be in `root`, or in the
    /// folder of the file.
    pub fn trusted(root: &Path, budget: &Budget) -> Self {
        Self { trusted: true, ..Self::new(root, budget) }
    }

    /// Returns the same root for a function whose caller cannot choose another root.
    #[must_use]
    pub fn fixed(self) -> Self {
        Self { fixed: true, ..self }
    }

    /// Returns the same root for additions to a world, with the world's texture cache.
    #[must_use]
    pub fn extending(self, world: &World) -> Self {
        Self { texture_memory: world.texture_cache.clone(), ..self }
    }

    /// The notices of the files that were read so far.
    pub fn notices(&self) -> &[Notice] {
        &self.notices
    }

    /// Adds notices of files that another world has read.
    pub fn repeat_notices(&mut self, notices: &[Notice]) {
        self.notices.extend_from_slice(notices);
    }

    /// Removes and returns the notices about images; a [`MeshFile`](raycam_scene::MeshFile) has separate notices.
    pub(crate) fn drain_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }

    /// Completes a world that was read from this root: adds the notices, and stores its images in the texture cache.
    ///
    /// # Errors
    /// Errors of [`World::page_textures`].
    pub fn finish_world(&mut self, world: &mut World) -> Result<()> {
        world.notices.extend(self.drain_notices());
        world.texture_cache = self.texture_memory.clone();
        Ok(world.page_textures()?)
    }

    /// Root for a file that the caller names: the file's folder, in any location.
    pub fn containing(path: &Path, budget: &Budget) -> Self {
        Self::of_file(path, None, budget)
    }

    /// Root for a file that the caller names: `folder`, or by default the file's folder.
    pub fn of_file(path: &Path, folder: Option<&Path>, budget: &Budget) -> Self {
        let target = fs::symlink_metadata(path).is_ok_and(|status| status.is_symlink());
        let target = target.then(|| path.canonicalize().ok()?.parent().map(Path::to_path_buf)).flatten();
        Self { target, named: path.into(), ..Self::new(folder.or(path.parent()).unwrap_or(Path::new("")), budget) }
    }

    /// Root for a file in memory, which may refer to other files in memory.
    pub(crate) fn of_memory(path: &Path, files: MemoryFiles, budget: &Budget) -> Self {
        Self { named: path.into(), memory: Some(files), ..Self::new(Path::new(""), budget) }
    }

    /// Remaining budget.
    pub fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Bytes of a file requested by its path.
    pub fn read(&mut self, path: &Path) -> Result<InputFile> {
        self.read_head(path, |_, _| None)
    }

    /// Same as [`Self::read`], but only the first bytes of a large file, as many as `head` returns for the file and its
    /// size.
    pub(crate) fn read_head(&mut self, path: &Path, head: impl Fn(&File, u64) -> Option<u64>) -> Result<InputFile> {
        self.read_bytes(path, path, head)
    }

    /// Bytes of the file that `reference` names, as written in the file `from`.
    pub fn read_reference(&mut self, from: &Path, reference: impl AsRef<[u8]>) -> Result<InputFile> {
        let (real, shown) = self.locate(from, reference.as_ref())?;
        self.read_bytes(&real, &shown, |_, _| None)
    }

    /// First bytes, at most `limit`, of the file that `reference` names, as written in the file `from`.
    pub fn read_reference_head(&mut self, from: &Path, reference: impl AsRef<[u8]>, limit: u64) -> Result<Vec<u8>> {
        let (real, shown) = self.locate(from, reference.as_ref())?;
        if let Some(files) = &self.memory {
            let bytes = files.bytes_of(&real).unwrap_or_default();
            let head = bytes[..bytes.len().min(usize::try_from(limit).unwrap_or(usize::MAX))].to_vec();
            self.budget.take_bytes(&shown, head.len() as u64)?;
            return Ok(head);
        }
        let io = |source| FormatError::Io { path: shown.clone(), source };
        if !fs::metadata(&real).map_err(io)?.is_file() {
            return Err(io(io::Error::new(
                io::ErrorKind::InvalidInput,
                "not a regular file (a folder, device, pipe or socket)",
            )));
        }
        let mut bytes = Vec::new();
        File::open(&real).map_err(io)?.take(limit.min(self.budget.bytes)).read_to_end(&mut bytes).map_err(io)?;
        self.budget.take_bytes(&shown, bytes.len() as u64)?;
        Ok(bytes)
    }

    /// All names in a folder inside the root; empty for another folder.
    pub fn folder_names(&self, folder: &Path) -> Vec<String> {
        if let Some(files) = &self.memory {
            let names = files.folder_names(&reference::normalize(folder)).into_iter();
            return names.map(|name| name.to_string_lossy().into_owned()).collect();
        }
        let Ok(place) = path::absolute(folder) else { return vec![] };
        let inside = self.locate_at(&reference::normalize(&place)).is_ok();
        let entries = inside.then(|| fs::read_dir(folder).ok()).flatten().into_iter().flatten().flatten();
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
    }

    /// Resolved path of the file that a name in the file `from` refers to, and its path for errors.
    fn locate(&self, from: &Path, name: &[u8]) -> Result<(PathBuf, PathBuf)> {
        let refused = |message: &str| FormatError::Reference {
            reference: reference::shown(name).into_owned(),
            message: message.into(),
        };
        reference::check(name).map_err(refused)?;
        let mut first = None;
        for folder in self.folders_of(from)? {
            match self.locate_at(&reference::normalize(&folder.join(reference::path_of(name)))) {
                Ok(found) => return Ok(found),
                Err(Fault::Refused(message)) => drop(first.get_or_insert_with(|| refused(&message))),
                Err(Fault::Io(error)) => drop(first.get_or_insert(error)),
            }
        }
        Err(first.unwrap_or_else(|| refused("expected a file name")))
    }

    /// Absolute paths of the folders from which names in a file start: the file's folder and, if the file is a link,
    /// the folder of the link's target. An empty path represents the file that the user named.
    fn folders_of(&self, from: &Path) -> Result<Vec<PathBuf>> {
        let from = if from.as_os_str().is_empty() { &self.named } else { from };
        let folder = match from.parent() {
            None => &self.root,
            Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Some(folder) => folder,
        };
        if self.memory.is_some() {
            return Ok(vec![reference::normalize(folder)]);
        }
        let io = |source| FormatError::Io { path: folder.into(), source };
        let mut folders = vec![reference::normalize(&path::absolute(folder).map_err(io)?)];
        if from.parent().is_some() && fs::symlink_metadata(from).is_ok_and(|status| status.is_symlink()) {
            folders.extend(from.canonicalize().ok().and_then(|real| real.parent().map(Path::to_path_buf)));
        }
        Ok(folders)
    }

    /// Same as [`Self::locate`] for an absolute path, which must be inside the root.
    fn locate_at(&self, path: &Path) -> Result<(PathBuf, PathBuf), Fault> {
        if let Some(files) = &self.memory {
            let missing = || io::Error::new(io::ErrorKind::NotFound, "not among the files that were provided");
            let found = files.bytes_of(path).map(|_| (path.to_path_buf(), path.to_path_buf()));
            return found.ok_or_else(|| Fault::Io(FormatError::Io { path: path.into(), source: missing() }));
        }
        let root = path::absolute(&self.root).map(|root| reference::normalize(&root)).unwrap_or_default();
        let shown = path.strip_prefix(&root).map_or_else(|_| path.to_path_buf(), |inside| self.display_path(inside));
        let io = |source| Fault::Io(FormatError::Io { path: shown.clone(), source });
        let real_root = root.canonicalize().map_err(io)?;
        let roots = || [Some(&real_root), self.target.as_ref()].into_iter().flatten();
        let out = |path: &Path| {
            if self.fixed {
                let folder = real_root.display();
                return format!(
                    "it is outside the folder {folder}; copy it into this folder, and change its name in the file that refers \
                     to it"
                );
            }
            let common = |(a, b): &(Component<'_>, Component<'_>)| a == b;
            let pairs = real_root.components().zip(path.components()).take_while(common);
            let wider: PathBuf = pairs.map(|(component, _)| component).collect();
            format!(
                "it is outside the folder {}; to allow it, load with folder={wider:?} (--folder on the command line, \
                 World(folder=...) for objects that are added)",
                real_root.display()
            )
        };
        if !path.starts_with(&root) && !roots().any(|root| path.starts_with(root)) {
            return Err(Fault::Refused(out(path)));
        }
        let real = path.canonicalize().map_err(io)?;
        if !roots().any(|root| real.starts_with(root)) {
            return Err(Fault::Refused(format!("a symbolic link to {}: {}", real.display(), out(&real))));
        }
        Ok((real, shown))
    }

    /// True if a name refers to a regular file inside the root.
    pub fn is_file(&self, from: &Path, name: &[u8]) -> bool {
        self.locate(from, name).is_ok_and(|(real, _)| self.memory.is_some() || real.is_file())
    }

    /// True while files may be searched for under other names; counts the search.
    pub(crate) fn may_search(&mut self) -> bool {
        self.searches += 1;
        self.searches <= MAX_SEARCHES
    }

    /// Name of the file inside the root whose path differs only in upper and lower case; the first in byte order if
    /// there are several.
    pub(crate) fn in_other_case(&mut self, from: &Path, name: &[u8]) -> Option<Vec<u8>> {
        reference::check(name).ok()?;
        for folder in self.folders_of(from).ok()? {
            let mut found = PathBuf::new();
            for component in reference::path_of(name).components() {
                let Component::Normal(written) = component else {
                    found.push(component);
                    continue;
                };
                let place = reference::normalize(&folder.join(&found));
                if self.memory.is_none() && place.join(written).exists() {
                    found.push(written);
                    continue;
                }
                let lower = written.to_string_lossy().to_lowercase();
                let names = self.listing(&place);
                let same = names.iter().find(|name| name.to_string_lossy().to_lowercase() == lower);
                found.push(same?);
            }
            let found = found.into_os_string().into_encoded_bytes();
            if self.is_file(from, &found) {
                return Some(found);
            }
        }
        None
    }

    /// Sorted names in a folder inside the root, up to [`MAX_LISTED`]; empty for a folder outside the root.
    fn listing(&mut self, folder: &Path) -> &[OsString] {
        if let Some(files) = &self.memory {
            self.listings.insert(folder.into(), files.folder_names(folder));
        } else if !self.listings.contains_key(folder) {
            let inside = self.locate_at(folder).is_ok();
            let entries = inside.then(|| fs::read_dir(folder).ok()).flatten().into_iter().flatten();
            let mut names: Vec<_> = entries.take(MAX_LISTED).flatten().map(|entry| entry.file_name()).collect();
            names.sort();
            self.listings.insert(folder.into(), names);
        }
        &self.listings[folder]
    }

    /// Path of a file as shown in errors.
    fn display_path(&self, path: &Path) -> PathBuf {
        if self.root == Path::new(".") { path.into() } else { self.root.join(path) }
    }

    /// Reads `path`, which is called `shown` in errors.
    fn read_bytes(&mut self, path: &Path, shown: &Path, head: impl Fn(&File, u64) -> Option<u64>) -> Result<InputFile> {
        if let Some(bytes) = self.memory.as_ref().and_then(|files| files.bytes_of(path)) {
            self.budget.take_bytes(shown, bytes.len() as u64)?;
            stand_in::check(shown, bytes)?;
            return Ok(InputFile::new(shown, bytes.to_vec()));
        }
        let io = |source| FormatError::Io { path: shown.into(), source };
        let kind = |kind, message| io(io::Error::new(kind, message));
        // The type is checked before the file is opened, because opening a pipe would wait for a writer. A folder needs
        // no check: reading it is an error.
        let status = fs::metadata(path).map_err(io)?;
        if !status.is_file() && !status.is_dir() {
            return Err(kind(io::ErrorKind::InvalidInput, "a device, pipe or socket; expected a regular file"));
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
            stand_in::check(shown, &bytes)?;
            return Ok(InputFile { path: shown.into(), bytes, rest: Some((file, size as usize)) });
        }
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        bytes.try_reserve_exact(size as usize).map_err(|e| io(e.into()))?;
        if size >= PARALLEL_READ_THRESHOLD {
            // The memory is freed first, so that the new memory consists of zero pages, which several threads then
            // access in parallel.
            drop(bytes);
            bytes = vec![0; size as usize];
            read_at_once(&file, &mut bytes).map_err(io)?;
        }
        file.take(size + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 != size {
            return Err(io(byte_source::file_changed_error()));
        }
        stand_in::check(shown, &bytes)?;
        Ok(InputFile::new(shown, bytes))
    }

    /// Calls `read` with a file that a description names, and with the folder from which this file may read.
    pub(crate) fn read_asset<T>(
        &mut self,
        file: &str,
        read: impl FnOnce(InputFile, &mut Self) -> Result<T>,
    ) -> Result<T> {
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

    /// Stores an image in the texture cache, if the budget limits the memory of images.
    pub(crate) fn store_texture(&self, image: Arc<Image>) -> Result<Arc<Image>> {
        match &self.texture_memory {
            Some(memory) => Ok(memory.insert(image)?),
            None => Ok(image),
        }
    }

    /// Returns the remaining budget, and the notices about images.
    pub(crate) fn budget_and_notices(&mut self) -> (&mut Budget, &mut Vec<Notice>) {
        (&mut self.budget, &mut self.notices)
    }
}

/// Fills `bytes` from the start of a file, several parts at a time, and leaves the file position after them.
fn read_at_once(mut file: &File, bytes: &mut [u8]) -> io::Result<()> {
    if !byte_source::HAS_POSITIONED_READ {
        return file.read_exact(bytes);
    }
    parallel::fill_blocks(bytes, READ_CHUNK, |start, part| byte_source::read_exact_at(file, part, start as u64))?;
    file.seek(SeekFrom::Start(bytes.len() as u64)).map(drop)
}
