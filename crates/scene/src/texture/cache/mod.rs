//! Limit on texture memory, and the temporary file for textures that exceed it.

pub(crate) mod paged;
pub(crate) mod tiles;
pub(crate) mod unlinked_file;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::notice::{Notice, NoticeCode};
use crate::texture::cache::tiles::TileCache;
use crate::texture::cache::unlinked_file::UnlinkedFile;
use crate::texture::texel::{ResidentTexels, TexelKind};

/// Memory of a world's textures. While all images and their mip maps fit into the limit, they are stored in memory.
/// Otherwise, all of them are stored in a temporary file, in tiles of 64 x 64 texels, and the memory contains recently
/// used tiles.
///
/// The file is created in the folder of the environment variable `TMPDIR`, otherwise in `/var/tmp`. The temporary file
/// is unlinked, so that the system deletes it at the end of the process in every case.
#[derive(Debug)]
pub struct TextureCache {
    /// Identifier, unique within this process.
    pub(crate) id: u64,
    pub(crate) limit: u64,
    folders: Vec<PathBuf>,
    /// Memory in bytes that all images inserted so far would take.
    pub(crate) requested_bytes: AtomicU64,
    file: OnceLock<UnlinkedFile>,
    cache: TileCache,
    tiles_read: AtomicU64,
    bytes_read: AtomicU64,
    failure: OnceLock<SceneError>,
}

/// Statistics of reads from the temporary file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PageInStats {
    /// Number of tiles read, counting repeated reads.
    pub tiles: u64,
    /// Number of bytes read.
    pub bytes: u64,
}

impl PartialEq for TextureCache {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl TextureCache {
    /// Creates a cache with a limit in bytes.
    pub fn new(limit: u64) -> Self {
        Self::in_folders(limit, unlinked_file::folders())
    }

    /// Creates a cache with a limit in bytes, and a folder for the temporary file.
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

    /// The limit in bytes.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// True if the images inserted so far exceed the limit.
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
                    failure.get_or_insert_with(|| storage_error(folder, &error, "cannot be created", 0));
                }
            }
        }
        Err(failure.unwrap_or_else(|| {
            SceneError::world("textures: no folder for temporary files found; set TMPDIR to an existing folder")
        }))
    }

    /// Returns the tile of `count` texels at an offset of the file. If a tile cannot be read, it is black, and
    /// [`TextureCache::check`] returns the error.
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

    /// Fills a buffer with the bytes of the file from `start` on.
    pub(crate) fn read(&self, bytes: &mut [u8], start: u64) -> Result<()> {
        let file = self.file()?;
        file.read(bytes, start).map_err(|error| storage_error(&file.folder, &error, "cannot be read", file.len()))
    }

    /// Returns the statistics of all reads from the temporary file so far.
    pub fn page_in_stats(&self) -> PageInStats {
        PageInStats { tiles: self.tiles_read.load(Ordering::Relaxed), bytes: self.bytes_read.load(Ordering::Relaxed) }
    }

    /// Checks that no read has failed.
    ///
    /// # Errors
    /// [`SceneError::Storage`] with the first failed read.
    pub fn check(&self) -> Result<()> {
        self.failure.get().map_or(Ok(()), |error| Err(error.clone()))
    }

    /// Notice that the textures exceed the limit and are in a temporary file; `None` if they do not exceed it.
    pub(crate) fn notice(&self) -> Option<Notice> {
        let file = self.file.get()?;
        let message = format!(
            "textures require more than texture_memory = {}; they are in a temporary file in {}",
            mebibytes(self.limit),
            file.folder.display()
        );
        Some(Notice::new(NoticeCode::ExceededTextureMemory, message))
    }
}

impl PageInStats {
    /// Notice about tiles read from the file since `before`; `None` if no tiles were read.
    pub fn notice_since(&self, before: &Self) -> Option<Notice> {
        let (tiles, bytes) = (self.tiles - before.tiles, self.bytes - before.bytes);
        (tiles > 0).then(|| {
            let message = format!(
                "{} ({}) read back from the temporary file",
                counted(tiles as usize, "texture tile"),
                mebibytes(bytes)
            );
            Notice::new(NoticeCode::TexturesPaged, message)
        })
    }
}

/// Formats a number of bytes.
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
            "the temporary texture file ({}) {what} in this folder: {error}; free some space, set TMPDIR to another \
             folder, or raise texture_memory",
            mebibytes(written)
        ),
    }
}
