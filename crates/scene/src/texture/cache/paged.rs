//! Texels in the temporary file of a [`TextureCache`], read tile by tile.

use std::cell::RefCell;
use std::sync::Arc;

use crate::error::Result;
use crate::texture::cache::TextureCache;
use crate::texture::texel::{ResidentTexels, TexelKind, TexelQuad};
use crate::texture::texel_weight::TexelWeight;

/// Texels per side of a tile; tiles at the right and bottom edges are smaller.
pub(crate) const TILE_SIZE: usize = 64;

/// Texels of an image, or of one level of the image's mip map, in a file.
#[derive(Clone, Debug)]
pub struct PagedTexels {
    cache: Arc<TextureCache>,
    /// Levels of the whole mip map, starting with the image.
    levels: Arc<[Level]>,
    /// The same levels with colours weighted by alpha; `None` for an opaque image.
    by_alpha: Option<Arc<[Level]>>,
    level: usize,
}

/// One level of a mip map: its offset in the file, its size and its texel format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    pub kind: TexelKind,
    pub size: [u32; 2],
    pub offset: u64,
}

/// Location of a tile: its offset in the file, its number of texels per row, and its number of texels.
struct TileLocation {
    start: u64,
    width: usize,
    count: usize,
}

impl PartialEq for PagedTexels {
    fn eq(&self, other: &Self) -> bool {
        self.cache.id == other.cache.id && self.current_level() == other.current_level()
    }
}

impl Level {
    /// Tile that contains a texel.
    fn tile(&self, x: usize, y: usize) -> TileLocation {
        let [width, height] = self.size.map(|n| n as usize);
        let (left, top) = (x - x % TILE_SIZE, y - y % TILE_SIZE);
        let rows = TILE_SIZE.min(height - top);
        let before = top * width + left * rows;
        let columns = TILE_SIZE.min(width - left);
        TileLocation { start: self.offset + (before * self.kind.bytes()) as u64, width: columns, count: columns * rows }
    }
}

impl PagedTexels {
    pub(crate) fn new(cache: Arc<TextureCache>, levels: Vec<Level>, by_alpha: Option<Vec<Level>>) -> Self {
        Self { cache, levels: levels.into(), by_alpha: by_alpha.map(Into::into), level: 0 }
    }

    pub(crate) fn is_opaque(&self) -> bool {
        self.by_alpha.is_none()
    }

    fn current_level(&self) -> &Level {
        &self.levels[self.level]
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        let [width, height] = self.size().map(|n| n as usize);
        width * height
    }

    /// Always false, because an image has at least one texel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.current_level().size
    }

    pub(crate) fn kind(&self) -> TexelKind {
        self.current_level().kind
    }

    /// This mip level and all smaller levels.
    pub(crate) fn mip_map(&self, weight: TexelWeight) -> impl Iterator<Item = Self> {
        let by_alpha = self.by_alpha.as_ref().filter(|_| weight == TexelWeight::Alpha);
        let levels = by_alpha.unwrap_or(&self.levels).clone();
        (self.level..levels.len()).map(move |level| Self { level, levels: levels.clone(), ..self.clone() })
    }

    /// Linear value of a texel.
    pub(crate) fn linear(&self, index: usize) -> [f32; 4] {
        let width = self.size()[0] as usize;
        let (x, y) = (index % width, index / width);
        THREAD_TILES.with_borrow_mut(|recent| recent.texel(self, x, y))
    }

    /// Linear values of the four texels in two columns and two rows.
    pub(crate) fn fetch_quad(&self, columns: [usize; 2], rows: [usize; 2]) -> TexelQuad {
        THREAD_TILES.with_borrow_mut(|recent| rows.map(|y| columns.map(|x| recent.texel(self, x, y))))
    }

    /// All texels, read into memory.
    ///
    /// # Errors
    /// [`crate::SceneError::Storage`] if the file cannot be read.
    pub(crate) fn read_all(&self) -> Result<ResidentTexels> {
        let level = self.current_level();
        let [width, height] = level.size.map(|n| n as usize);
        let texel = level.kind.bytes();
        let mut bytes = vec![0; width * height * texel];
        let mut rows = Vec::new();
        for top in (0..height).step_by(TILE_SIZE) {
            let count = TILE_SIZE.min(height - top) * width;
            rows.resize(count * texel, 0);
            self.cache.read(&mut rows, level.offset + (top * width * texel) as u64)?;
            let mut from = &rows[..];
            for left in (0..width).step_by(TILE_SIZE) {
                let columns = TILE_SIZE.min(width - left) * texel;
                for y in top..(top + TILE_SIZE).min(height) {
                    let (row, rest) = from.split_at(columns);
                    let to = (y * width + left) * texel;
                    bytes[to..to + columns].copy_from_slice(row);
                    from = rest;
                }
            }
        }
        Ok(level.kind.decode(&bytes))
    }
}

/// Number of tiles that a thread keeps.
const THREAD_TILE_SLOTS: usize = 16;

thread_local! {
    static THREAD_TILES: RefCell<ThreadTiles> = const { RefCell::new(ThreadTiles([const { None }; THREAD_TILE_SLOTS])) };
}

/// Tiles recently used by a thread. Most lookups find their tile here and need no lock.
struct ThreadTiles([Option<ThreadTile>; THREAD_TILE_SLOTS]);

struct ThreadTile {
    cache_id: u64,
    start: u64,
    texels: Arc<ResidentTexels>,
}

impl ThreadTiles {
    #[inline]
    fn texel(&mut self, image: &PagedTexels, x: usize, y: usize) -> [f32; 4] {
        let location = image.current_level().tile(x, y);
        let inside = y % TILE_SIZE * location.width + x % TILE_SIZE;
        self.tile(image, &location).linear(inside)
    }

    #[inline]
    fn tile(&mut self, image: &PagedTexels, location: &TileLocation) -> &ResidentTexels {
        let cache_id = image.cache.id;
        let mixed = (location.start ^ cache_id).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let slot = &mut self.0[(mixed >> 60) as usize];
        let found = slot.take().filter(|tile| tile.start == location.start && tile.cache_id == cache_id);
        let tile = found.unwrap_or_else(|| ThreadTile {
            cache_id,
            start: location.start,
            texels: image.cache.tile(location.start, image.kind(), location.count),
        });
        &slot.insert(tile).texels
    }
}
