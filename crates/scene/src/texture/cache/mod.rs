//! How much memory textures may take, and the temporary file for those that do not fit.

pub(crate) mod paged;
pub(crate) mod tiles;
pub(crate) mod unlinked_file;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use crate::error::{Result, SceneError};
use crate::notice::{Notice, NoticeCode};
use crate::texture::cache::tiles::TileCache;
use crate::texture::cache::unlinked_file::UnlinkedFile;
use crate::texture::texel::{ResidentTexels, TexelKind};

/// The memory of a world's textures. As long as all images fit together with their mip maps they lie in it as they are.
/// Once they do not, all of them lie in a temporary file, in tiles of 64 x 64 texels, and the memory holds the tiles
/// lately used.
///
/// The file goes to the folder that the environment variable `TMPDIR` names, else to `/var/tmp`. It has no name, so
/// that it is gone when the process ends, however it ends.
#[derive(Debug)]
pub struct TextureCache {
    /// Unique within this process.
    pub(crate) id: u64,
    pub(crate) limit: u64,
    folders: Vec<PathBuf>,
    /// Bytes that all images inserted so far would take.
    pub(crate) requested_bytes: AtomicU64,
    file: OnceLock<UnlinkedFile>,
    cache: TileCache,
    tiles_read: AtomicU64,
    bytes_read: AtomicU64,
    failure: OnceLock<SceneError>,
}

/// Reads from the temporary file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PageInStats {
    /// Tiles, each as often as it was read.
    pub tiles: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl PartialEq for TextureCache {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl TextureCache {
    /// With a limit in bytes.
    pub fn new(limit: u64) -> Self {
        Self::in_folders(limit, unlinked_file::folders())
    }

    /// With a limit in bytes, and a folder for the temporary file.
    pub fn in_folder(limit: u64, folder: &Path) -> Self {
        Self::in_folders(limit, vec![folder.into()])
    }

    fn in_folders(limit: u64, folders: Vec<PathBuf>) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            limit,
            folders,
            requested_bytes: AtomicU64::new(0),
            file: OnceLock::new(),
            cache: TileCache::new(limit),
            tiles_read: AtomicU64::new(0),
            bytes_read: AtomicU64::new(0),
            failure: OnceLock::new(),
        }
    }

    /// Its limit in bytes.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// True if the images inserted so far do not fit.
    pub fn is_exceeded(&self) -> bool {
        self.requested_bytes.load(Ordering::Relaxed) > self.limit
    }

    pub(crate) fn file(&self) -> Result<&UnlinkedFile> {
        if let Some(file) = self.file.get() {
            return Ok(file);
        }
        let mut failure = None;
        for folder in &self.folders {
            match UnlinkedFile::new(folder) {
                Ok(file) => return Ok(self.file.get_or_init(|| file)),
                Err(error) => {
                    failure.get_or_insert_with(|| storage_error(folder, &error, "cannot be made", 0));
                }
            }
        }
        Err(failure.unwrap_or_else(|| SceneError::world("textures: no folder for temporary files")))
    }

    /// The tile of `count` texels at an offset of the file. A tile that cannot be read is black, and
    /// [`TextureCache::check`] says why.
    pub(crate) fn tile(&self, start: u64, kind: TexelKind, count: usize) -> Arc<ResidentTexels> {
        if let Some(tile) = self.cache.get(start) {
            return tile;
        }
        let mut bytes = vec![0; count * kind.bytes()];
        if let Err(error) = self.read(&mut bytes, start) {
            self.failure.get_or_init(|| error);
        }
        self.tiles_read.fetch_add(1, Ordering::Relaxed);
        let read = bytes.len() as u64;
        self.bytes_read.fetch_add(read, Ordering::Relaxed);
        let tile = Arc::new(kind.decode(&bytes));
        self.cache.insert(start, tile.clone(), read);
        tile
    }

    /// Bytes of the file.
    pub(crate) fn read(&self, bytes: &mut [u8], start: u64) -> Result<()> {
        let file = self.file()?;
        file.read(bytes, start).map_err(|error| storage_error(&file.folder, &error, "cannot be read", file.len()))
    }

    /// All reads from the temporary file so far.
    pub fn page_in_stats(&self) -> PageInStats {
        PageInStats { tiles: self.tiles_read.load(Ordering::Relaxed), bytes: self.bytes_read.load(Ordering::Relaxed) }
    }

    /// Checks that no read has failed.
    ///
    /// # Errors
    /// [`SceneError::Storage`] with what could not be read first.
    pub fn check(&self) -> Result<()> {
        self.failure.get().map_or(Ok(()), |error| Err(error.clone()))
    }

    /// The notice for the user who set the limit, if it is exceeded.
    pub(crate) fn notice(&self) -> Option<Notice> {
        let file = self.file.get()?;
        let message = format!(
            "textures need more than texture_memory = {}: they are in a temporary file in {}",
            mebibytes(self.limit),
            file.folder.display()
        );
        Some(Notice::new(NoticeCode::ExceededTextureMemory, message))
    }
}

impl PageInStats {
    /// The notice of tiles read since `before`; `None` without any.
    pub fn notice_since(&self, before: &Self) -> Option<Notice> {
        let (tiles, bytes) = (self.tiles - before.tiles, self.bytes - before.bytes);
        (tiles > 0).then(|| {
            let message =
                format!("{tiles} texture tiles ({}) were read back from the temporary file", mebibytes(bytes));
            Notice::new(NoticeCode::TexturesPaged, message)
        })
    }
}

/// A number of bytes as people write it.
pub(crate) fn mebibytes(bytes: u64) -> String {
    match bytes {
        0..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        0x10_0000..0x1000_0000_0000 if bytes.is_multiple_of(1 << 20) => {
            format!("{} MiB", bytes >> 20)
        }
        _ => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
    }
}

pub(crate) fn storage_error(folder: &Path, error: &io::Error, what: &str, written: u64) -> SceneError {
    SceneError::Storage {
        path: folder.into(),
        number: error.raw_os_error(),
        message: format!(
            "the temporary file of textures, which has {}, {what} there: {error}; make room, set TMPDIR to another \
             folder, or raise texture_memory",
            mebibytes(written)
        ),
    }
}
