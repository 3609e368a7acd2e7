//! Tiles: the pixels that one thread takes at a time.

/// Width and height of a tile, in pixels.
pub(crate) const TILE: u32 = 32;
/// Rays in a row are best a square of this many pixels.
pub(crate) const BLOCK: u32 = 8;

/// A rectangle of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    /// The tiles of a region (x, y, width, height), row by row.
    pub fn of_region([x, y, width, height]: [u32; 4]) -> Vec<Tile> {
        let mut tiles = vec![];
        for row in (0..height).step_by(TILE as usize) {
            for column in (0..width).step_by(TILE as usize) {
                tiles.push(Tile {
                    x: x + column,
                    y: y + row,
                    width: TILE.min(width - column),
                    height: TILE.min(height - row),
                });
            }
        }
        tiles
    }

    /// Its pixels in the image, block by block.
    pub fn pixels(&self, pixels: &mut Vec<[u32; 2]>) {
        pixels.clear();
        self.blocks().for_each(|block| block.add_rows(pixels));
    }

    /// Its blocks: whole ones first, so that all of them are 64 rays in a row that begin at a multiple of 64.
    pub fn blocks(&self) -> impl Iterator<Item = Tile> {
        let Tile { width, height, .. } = *self;
        let (x, y) = (self.x, self.y);
        let parts = |whole: bool| {
            let rows = (0..height).step_by(BLOCK as usize);
            let places =
                rows.flat_map(move |v| (0..width).step_by(BLOCK as usize).map(move |u| (u, v)));
            let blocks = places.map(move |(u, v)| Tile {
                x: x + u,
                y: y + v,
                width: BLOCK.min(width - u),
                height: BLOCK.min(height - v),
            });
            blocks.filter(move |one| (one.width == BLOCK && one.height == BLOCK) == whole)
        };
        parts(true).chain(parts(false))
    }

    /// Adds its pixels, row by row.
    pub fn add_rows(&self, pixels: &mut Vec<[u32; 2]>) {
        let row = |v| (0..self.width).map(move |u| [self.x + u, self.y + v]);
        pixels.extend((0..self.height).flat_map(row));
    }
}
