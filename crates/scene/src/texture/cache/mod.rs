//! How much memory textures may take, and the temporary file for those that do not fit.

pub(crate) mod paged;
pub(crate) mod tiles;
pub(crate) mod unlinked_file;

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use crate::error::SceneError;
use crate::texture::cache::paged::{Level, PagedTexels, TILE_SIZE};
use crate::texture::cache::tiles::TileCache;
use crate::texture::cache::unlinked_file::UnlinkedFile;
use crate::texture::image::TexelKind;
use crate::texture::{Image, Texels, Texture};
use crate::world::World;

/// The memory of a world's textures. As long as all images fit together with their mip maps they lie in it as they are. Once
/// they do not, all of them lie in a temporary file, in tiles of 64 x 64 texels, and the memory holds the tiles lately used.
///
/// The file goes to the folder that the environment variable `TMPDIR` names, else to `/var/tmp`. It has no name, so that it
/// is gone when the process ends, however it ends.
#[derive(Debug)]
pub struct TextureCache {
    /// Tells it from every other one of this process.
    pub(crate) id: u64,
    limit: u64,
    folders: Vec<PathBuf>,
    /// What the images kept so far would take.
    requested_bytes: AtomicU64,
    file: OnceLock<UnlinkedFile>,
    cache: TileCache,
    tiles_read: AtomicU64,
    bytes_read: AtomicU64,
    failure: OnceLock<SceneError>,
}

/// What has been read back from the temporary file.
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

    /// Whether the images kept so far do not fit.
    pub fn is_exceeded(&self) -> bool {
        self.requested_bytes.load(Ordering::Relaxed) > self.limit
    }

    /// The image, counted, and paged where those kept so far do not fit with it.
    ///
    /// # Errors
    /// Those of [`Image::validate`] and [`TextureCache::page_out`].
    pub fn insert(self: &Arc<Self>, image: Arc<Image>) -> Result<Arc<Image>, SceneError> {
        image.validate()?;
        self.count(&image);
        if self.is_exceeded() {
            self.page_out(&image).map(Arc::new)
        } else {
            Ok(image)
        }
    }

    /// Counts an image.
    pub(crate) fn count(&self, image: &Image) {
        self.requested_bytes
            .fetch_add(image.bytes(), Ordering::Relaxed);
    }

    /// The image with its texels, and those of its mip map, in the temporary file.
    ///
    /// # Errors
    /// [`SceneError::Storage`] where that cannot be written.
    pub fn page_out(self: &Arc<Self>, image: &Image) -> Result<Image, SceneError> {
        if matches!(image.texels, Texels::Paged(_)) {
            return Ok(image.clone());
        }
        let mut levels = Vec::new();
        let mut next = Some(Cow::Borrowed(image));
        while let Some(image) = next {
            levels.push(self.write(&image)?);
            next = image.halved().map(Cow::Owned);
        }
        Ok(Image {
            name: image.name.clone(),
            size: image.size,
            texels: Texels::Paged(PagedTexels::new(self.clone(), levels)),
        })
    }

    /// Writes an image's tiles: rows of tiles from the top, each from the left.
    fn write(&self, image: &Image) -> Result<Level, SceneError> {
        let [width, height] = image.size.map(|n| n as usize);
        let file = self.file()?;
        let (mut offset, mut bytes) = (None, Vec::new());
        for top in (0..height).step_by(TILE_SIZE) {
            bytes.clear();
            for left in (0..width).step_by(TILE_SIZE) {
                let right = (left + TILE_SIZE).min(width);
                for y in top..(top + TILE_SIZE).min(height) {
                    let row = y * width;
                    image
                        .texels
                        .write_bytes(row + left..row + right, &mut bytes);
                }
            }
            let start = file.append(&bytes).map_err(|error| {
                let written = file.len();
                storage_error(&file.folder, &error, "cannot be written", written)
            })?;
            offset.get_or_insert(start);
        }
        Ok(Level {
            kind: image.texels.kind(),
            size: image.size,
            offset: offset.unwrap_or(0),
        })
    }

    fn file(&self) -> Result<&UnlinkedFile, SceneError> {
        if let Some(file) = self.file.get() {
            return Ok(file);
        }
        let mut failure = None;
        for folder in &self.folders {
            match UnlinkedFile::new(folder) {
                Ok(file) => return Ok(self.file.get_or_init(|| file)),
                Err(error) => {
                    failure
                        .get_or_insert_with(|| storage_error(folder, &error, "cannot be made", 0));
                }
            }
        }
        Err(failure
            .unwrap_or_else(|| SceneError::World("textures: no folder for temporary files".into())))
    }

    /// The tile of so many texels that begins there in the file. Where it cannot be read it is black, and
    /// [`TextureCache::check`] says why.
    pub(crate) fn tile(&self, start: u64, kind: TexelKind, count: usize) -> Arc<Texels> {
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
        let tile = Arc::new(kind.texels(&bytes));
        self.cache.insert(start, tile.clone(), read);
        tile
    }

    /// Bytes of the file.
    pub(crate) fn read(&self, bytes: &mut [u8], start: u64) -> Result<(), SceneError> {
        let file = self.file()?;
        file.read(bytes, start)
            .map_err(|error| storage_error(&file.folder, &error, "cannot be read", file.len()))
    }

    /// What has been read back since it was made.
    pub fn page_in_stats(&self) -> PageInStats {
        PageInStats {
            tiles: self.tiles_read.load(Ordering::Relaxed),
            bytes: self.bytes_read.load(Ordering::Relaxed),
        }
    }

    /// Whether everything that was asked for could be read.
    ///
    /// # Errors
    /// [`SceneError::Storage`] with what could not be read first.
    pub fn check(&self) -> Result<(), SceneError> {
        self.failure
            .get()
            .map_or(Ok(()), |error| Err(error.clone()))
    }

    /// What to tell the one who set the limit, where it is exceeded.
    pub(crate) fn notice(&self) -> Option<String> {
        let file = self.file.get()?;
        Some(format!(
            "textures need more than texture_memory = {}: they lie in a temporary file in {}",
            mebibytes(self.limit),
            file.folder.display()
        ))
    }
}

impl World {
    /// The same, its images within a memory for textures.
    ///
    /// # Errors
    /// Those of [`World::page_textures`].
    pub fn with_texture_cache(mut self, memory: TextureCache) -> Result<Self, SceneError> {
        let mut known = HashSet::new();
        for texture in &self.textures {
            if known.insert(Arc::as_ptr(&texture.image)) {
                memory.count(&texture.image);
            }
        }
        self.texture_cache = Some(Arc::new(memory));
        self.page_textures()?;
        Ok(self)
    }

    /// Whether all textures fit into their memory.
    ///
    /// # Errors
    /// [`SceneError::World`] where they do not.
    pub fn check_textures_in_memory(&self) -> Result<(), SceneError> {
        match &self.texture_cache {
            Some(memory) if memory.is_exceeded() => Err(SceneError::World(format!(
                "the textures, which need {}, exceed texture_memory = {}; a job (a video, a data set, workers) sends all \
                 of them: raise texture_memory, or render picture by picture",
                mebibytes(memory.requested_bytes.load(Ordering::Relaxed)),
                mebibytes(memory.limit)
            ))),
            _ => Ok(()),
        }
    }

    /// Once the images do not fit into the memory for textures: sees to it that all of them lie in its file, and says so.
    ///
    /// # Errors
    /// [`SceneError::Storage`] where the file cannot be written.
    pub fn page_textures(&mut self) -> Result<(), SceneError> {
        let Some(memory) = &self.texture_cache else {
            return Ok(());
        };
        if !memory.is_exceeded() {
            return Ok(());
        }
        let mut paged: HashMap<*const Image, Arc<Image>> = HashMap::new();
        for i in 0..self.textures.len() {
            let Texture { image, sampler } = &*self.textures[i];
            if matches!(image.texels, Texels::Paged(_)) {
                continue;
            }
            let (key, sampler) = (Arc::as_ptr(image), *sampler);
            let image = match paged.get(&key) {
                Some(known) => known.clone(),
                None => Arc::new(memory.page_out(image)?),
            };
            paged.insert(key, image.clone());
            self.textures[i] = Arc::new(Texture { image, sampler });
        }
        let notice = memory.notice();
        let new = notice.filter(|notice| !self.notices.contains(notice));
        self.notices.extend(new);
        Ok(())
    }
}

impl PageInStats {
    /// What has been read since `before`, in words; nothing where that is nothing.
    pub fn notice_since(&self, before: &Self) -> Option<String> {
        let (tiles, bytes) = (self.tiles - before.tiles, self.bytes - before.bytes);
        (tiles > 0).then(|| {
            format!(
                "{tiles} tiles of textures ({}) were read back from the temporary file",
                mebibytes(bytes)
            )
        })
    }
}

/// A number of bytes as people write it.
fn mebibytes(bytes: u64) -> String {
    match bytes {
        0..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        0x10_0000..0x1000_0000_0000 if bytes.is_multiple_of(1 << 20) => {
            format!("{} MiB", bytes >> 20)
        }
        _ => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
    }
}

fn storage_error(folder: &Path, error: &io::Error, what: &str, written: u64) -> SceneError {
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
