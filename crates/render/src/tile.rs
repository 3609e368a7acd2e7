//! Tiles: the pixels that one thread takes at a time.

/// Width and height of a tile, in pixels.
pub(crate) const TILE: u32 = 32;
/// Rays in a row are best a square of this many pixels.
const BLOCK: u32 = 8;

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

    /// Its pixels in the image, block by block: whole blocks first, so that all of them are 64 rays in a row that
    /// begin at a multiple of 64.
    pub fn pixels(&self, pixels: &mut Vec<[u32; 2]>) {
        pixels.clear();
        for whole in [true, false] {
            for y in (0..self.height).step_by(BLOCK as usize) {
                for x in (0..self.width).step_by(BLOCK as usize) {
                    let (width, height) = (BLOCK.min(self.width - x), BLOCK.min(self.height - y));
                    if (width == BLOCK && height == BLOCK) == whole {
                        let row = |v| (0..width).map(move |u| [self.x + x + u, self.y + y + v]);
                        pixels.extend((0..height).flat_map(row));
                    }
                }
            }
        }
    }
}
