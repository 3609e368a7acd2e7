//! Texels in the temporary file of a [`TextureMemory`], looked up tile by tile.

use std::cell::RefCell;
use std::sync::Arc;

use crate::error::SceneError;
use crate::texture::image::{Square, TexelKind};
use crate::texture::{Texels, TextureMemory};

/// Texels on a side of a tile; those at the right and the bottom have what is left.
pub(crate) const SIDE: usize = 64;

/// The texels of an image, or of a level of its mip map, in a file.
#[derive(Clone, Debug)]
pub struct PagedTexels {
    memory: Arc<TextureMemory>,
    /// Of the whole mip map, the image itself first.
    levels: Arc<[Level]>,
    level: usize,
}

/// One level: where it begins in the file, and how its texels are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level {
    pub kind: TexelKind,
    pub size: [u32; 2],
    pub offset: u64,
}

/// A tile: where it begins in the file, its texels on a row, and how many it has.
struct Place {
    start: u64,
    width: usize,
    count: usize,
}

impl PartialEq for PagedTexels {
    fn eq(&self, other: &Self) -> bool {
        self.memory.id == other.memory.id && self.here() == other.here()
    }
}

impl Level {
    /// The tile that a texel is in.
    fn tile(&self, x: usize, y: usize) -> Place {
        let [width, height] = self.size.map(|n| n as usize);
        let (left, top) = (x - x % SIDE, y - y % SIDE);
        let rows = SIDE.min(height - top);
        let before = top * width + left * rows;
        let columns = SIDE.min(width - left);
        Place {
            start: self.offset + (before * self.kind.bytes()) as u64,
            width: columns,
            count: columns * rows,
        }
    }
}

impl PagedTexels {
    pub(crate) fn new(memory: Arc<TextureMemory>, levels: Vec<Level>) -> Self {
        Self {
            memory,
            levels: levels.into(),
            level: 0,
        }
    }

    fn here(&self) -> &Level {
        &self.levels[self.level]
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        let [width, height] = self.size().map(|n| n as usize);
        width * height
    }

    /// Whether there are none: an image has some.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.here().size
    }

    pub(crate) fn kind(&self) -> TexelKind {
        self.here().kind
    }

    /// This level and all that are smaller.
    pub(crate) fn mip_map(&self) -> impl Iterator<Item = Self> {
        (self.level..self.levels.len()).map(|level| Self {
            level,
            ..self.clone()
        })
    }

    /// The linear value of one.
    pub(crate) fn linear(&self, index: usize) -> [f32; 4] {
        let width = self.size()[0] as usize;
        let (x, y) = (index % width, index / width);
        RECENT.with_borrow_mut(|recent| recent.texel(self, x, y))
    }

    /// The linear values where two columns meet two rows.
    pub(crate) fn crossing(&self, columns: [usize; 2], rows: [usize; 2]) -> Square {
        RECENT.with_borrow_mut(|recent| rows.map(|y| columns.map(|x| recent.texel(self, x, y))))
    }

    /// All of them, in memory.
    ///
    /// # Errors
    /// [`SceneError::Storage`] where the file cannot be read.
    pub(crate) fn all(&self) -> Result<Texels, SceneError> {
        let level = self.here();
        let [width, height] = level.size.map(|n| n as usize);
        let texel = level.kind.bytes();
        let mut bytes = vec![0; width * height * texel];
        let mut rows = Vec::new();
        for top in (0..height).step_by(SIDE) {
            let count = SIDE.min(height - top) * width;
            rows.resize(count * texel, 0);
            self.memory
                .read(&mut rows, level.offset + (top * width * texel) as u64)?;
            let mut from = &rows[..];
            for left in (0..width).step_by(SIDE) {
                let columns = SIDE.min(width - left) * texel;
                for y in top..(top + SIDE).min(height) {
                    let (row, rest) = from.split_at(columns);
                    let to = (y * width + left) * texel;
                    bytes[to..to + columns].copy_from_slice(row);
                    from = rest;
                }
            }
        }
        Ok(level.kind.texels(&bytes))
    }
}

/// How many tiles a thread has at hand.
const AT_HAND: usize = 16;

thread_local! {
    static RECENT: RefCell<Recent> = const { RefCell::new(Recent([const { None }; AT_HAND])) };
}

/// The tiles that a thread looked at lately: most lookups are answered here, without a lock.
struct Recent([Option<RecentTile>; AT_HAND]);

struct RecentTile {
    memory: u64,
    start: u64,
    texels: Arc<Texels>,
}

impl Recent {
    #[inline]
    fn texel(&mut self, image: &PagedTexels, x: usize, y: usize) -> [f32; 4] {
        let place = image.here().tile(x, y);
        let inside = y % SIDE * place.width + x % SIDE;
        self.tile(image, &place).linear(inside)
    }

    #[inline]
    fn tile(&mut self, image: &PagedTexels, place: &Place) -> &Texels {
        let memory = image.memory.id;
        let mixed = (place.start ^ memory).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let slot = &mut self.0[(mixed >> 60) as usize];
        let found = slot
            .take()
            .filter(|tile| tile.start == place.start && tile.memory == memory);
        let tile = found.unwrap_or_else(|| RecentTile {
            memory,
            start: place.start,
            texels: image.memory.tile(place.start, image.kind(), place.count),
        });
        &slot.insert(tile).texels
    }
}
