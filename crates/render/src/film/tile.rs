//! Tiles: rectangles of pixels that one thread renders at a time.

/// Width and height of a tile in pixels, if each thread has many tiles.
pub(crate) const TILE_SIZE: u32 = 32;
/// Minimum number of tiles per thread, for load balancing; large tiles are halved to reach this number.
const TILES_PER_THREAD: usize = 8;
/// Side length in pixels of the squares whose rays are consecutive in a batch.
pub(crate) const RAY_BLOCK: u32 = 8;

/// Rectangle of pixels in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    /// Tiles of a region (x, y, width, height), row by row.
    pub fn tiles_of(region: [u32; 4]) -> Vec<Tile> {
        Self::tiles_of_size(region, TILE_SIZE)
    }

    /// Tiles of a region. Tiles are halved in size while there are few per thread. Consecutive tiles are in
    /// different strips of [`TILE_SIZE`] rows, so that two threads rarely write to the same strip.
    pub fn for_threads(region: [u32; 4], threads: usize) -> Vec<Tile> {
        let mut size = TILE_SIZE;
        loop {
            let mut tiles = Self::tiles_of_size(region, size);
            if size == RAY_BLOCK || tiles.len() >= TILES_PER_THREAD * threads {
                tiles.sort_by_key(|tile| ((tile.y - region[1]) % TILE_SIZE, tile.x, tile.y));
                return tiles;
            }
            size /= 2;
        }
    }

    /// Merges neighbouring tiles of a row; returns each merged tile with the number of tiles that it contains.
    pub fn merge_rows(mut tiles: Vec<Tile>) -> Vec<(Tile, usize)> {
        tiles.sort_by_key(|tile| (tile.y, tile.x));
        let beside = |a: &Tile, b: &Tile| (a.y, a.height, a.x + a.width) == (b.y, b.height, b.x);
        let rows = tiles.chunk_by(beside).filter_map(|row| {
            let width = row.iter().map(|tile| tile.width).sum();
            let first = *row.first()?;
            Some((Tile { width, ..first }, row.len()))
        });
        rows.collect()
    }

    fn tiles_of_size([x, y, width, height]: [u32; 4], size: u32) -> Vec<Tile> {
        let mut tiles = vec![];
        for row in (0..height).step_by(size as usize) {
            for column in (0..width).step_by(size as usize) {
                tiles.push(Tile {
                    x: x + column,
                    y: y + row,
                    width: size.min(width - column),
                    height: size.min(height - row),
                });
            }
        }
        tiles
    }

    /// True if the tile shares a pixel with a rectangle (x, y, width, height).
    pub fn overlaps(&self, [x, y, width, height]: [u32; 4]) -> bool {
        let meet = |a: u32, a_size: u32, b: u32, b_size: u32| a < b.saturating_add(b_size) && b < a + a_size;
        meet(self.x, self.width, x, width) && meet(self.y, self.height, y, height)
    }

    /// Sets `pixels` to the tile's pixels, block by block.
    pub fn pixels(&self, pixels: &mut Vec<[u32; 2]>) {
        pixels.clear();
        self.blocks().for_each(|block| block.push_rows(pixels));
    }

    /// Blocks of the tile, full blocks first, so that each full block is 64 rays starting at a multiple of 64.
    pub fn blocks(&self) -> impl Iterator<Item = Tile> {
        let Tile { width, height, .. } = *self;
        let (x, y) = (self.x, self.y);
        let parts = |whole: bool| {
            let rows = (0..height).step_by(RAY_BLOCK as usize);
            let places = rows.flat_map(move |v| (0..width).step_by(RAY_BLOCK as usize).map(move |u| (u, v)));
            let blocks = places.map(move |(u, v)| Tile {
                x: x + u,
                y: y + v,
                width: RAY_BLOCK.min(width - u),
                height: RAY_BLOCK.min(height - v),
            });
            blocks.filter(move |one| (one.width == RAY_BLOCK && one.height == RAY_BLOCK) == whole)
        };
        parts(true).chain(parts(false))
    }

    /// Appends the tile's pixels to a list, row by row.
    pub fn push_rows(&self, pixels: &mut Vec<[u32; 2]>) {
        let row = |v| (0..self.width).map(move |u| [self.x + u, self.y + v]);
        pixels.extend((0..self.height).flat_map(row));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_adjacent_tiles_are_merged() {
        let mut tiles = Tile::tiles_of([5, 7, 100, 70]);
        tiles.remove(5); // this tile is in the middle of the second row
        tiles.reverse();
        let found: Vec<_> = Tile::merge_rows(tiles)
            .into_iter()
            .map(|(tile, count)| ([tile.x, tile.y, tile.width, tile.height], count))
            .collect();
        let expected = [([5, 7, 100, 32], 4), ([5, 39, 32, 32], 1), ([69, 39, 36, 32], 2), ([5, 71, 100, 6], 4)];
        assert_eq!(found, expected);
    }

    #[test]
    fn tiles_cover_every_pixel_once_and_occupy_all_threads() {
        for (region, threads) in [([3, 5, 64, 48], 2), ([0, 0, 640, 480], 64), ([7, 0, 9, 100], 3)] {
            let tiles = Tile::for_threads(region, threads);
            let largest = tiles.iter().map(|tile| tile.width.max(tile.height)).max();
            assert!(tiles.len() >= TILES_PER_THREAD * threads || largest == Some(RAY_BLOCK));
            let mut pixels = vec![];
            let band = |tile: &Tile| (tile.y - region[1]) / TILE_SIZE;
            let beside = tiles.windows(2).filter(|two| band(&two[0]) == band(&two[1]));
            assert!(2 * beside.count() <= tiles.len() || region[3] <= TILE_SIZE);
            for tile in &tiles {
                let row = |y: u32| (y - region[1]) / TILE_SIZE;
                assert_eq!(row(tile.y), row(tile.y + tile.height - 1));
                tile.push_rows(&mut pixels);
            }
            pixels.sort_unstable_by_key(|&[x, y]| [y, x]);
            let [x, y, width, height] = region;
            let all = (y..y + height).flat_map(|y| (x..x + width).map(move |x| [x, y]));
            assert!(all.eq(pixels));
        }
        assert_eq!(Tile::for_threads([0, 0, 640, 480], 2).len(), 300);
    }
}
