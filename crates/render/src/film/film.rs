//! Film: the planes of a frame, which many threads write tile by tile.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::film::channel::Channel;
use crate::film::image_plane::ImagePlane;
use crate::film::output_plane::OutputPlane;
use crate::film::tile::{TILE_SIZE, Tile};
use crate::film::tile_writer::{ChannelStrip, PixelRun, ROWS_PER_WRITE, RowWriter, StripCursor};

/// Block of a tile, and the index of the block's first pixel among the tile's traced pixels; the index is
/// `None` if the block shows the background.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelBlock {
    pub block: Tile,
    pub first_pixel: Option<usize>,
}

/// Planes of a region, divided into rows of tiles; only one thread at a time writes a row.
pub(crate) struct Film<'a> {
    region: [u32; 4],
    tile_rows: Vec<Mutex<Vec<ChannelStrip<'a>>>>,
}

impl<'a> Film<'a> {
    /// Returns the film that writes to these planes of a region; `None` if the size or the type of a plane does not
    /// match.
    pub fn new(region: [u32; 4], targets: impl Iterator<Item = OutputPlane<'a>>) -> Option<Self> {
        let mut tile_rows: Vec<Vec<_>> = (0..region[3].div_ceil(TILE_SIZE)).map(|_| vec![]).collect();
        let [width, height] = [region[2] as usize, region[3] as usize];
        for target in targets {
            if !target.fits(width * height) {
                return None;
            }
            let (channel, zero) = (target.channel, target.zero);
            for (tile_row, values) in tile_rows.iter_mut().zip(target.split_rows(width * TILE_SIZE as usize)) {
                tile_row.push(ChannelStrip { channel, values, zero });
            }
        }
        Some(Self { region, tile_rows: tile_rows.into_iter().map(Mutex::new).collect() })
    }

    /// True if the film has exactly these channels, in this order.
    pub fn has_channels(&self, channels: &[Channel]) -> bool {
        self.tile_rows.iter().all(|tile_row| {
            let tile_row = tile_row.lock().unwrap_or_else(PoisonError::into_inner);
            tile_row.iter().map(|strip| &strip.channel).eq(channels)
        })
    }

    /// Writes all channels of a tile: `write` is called with the row writers of each channel. `blocks` are the tile's
    /// blocks, row by row; `background` is a frame of one background pixel, required if any block is background.
    pub fn write(
        &self,
        tile: &Tile,
        blocks: &[PixelBlock],
        background: &[(Channel, ImagePlane)],
        mut write: impl FnMut(Channel, &mut RowWriter),
    ) {
        let (first, mut strips) = self.tile_row(tile);
        let mut rests: Vec<StripCursor> = strips
            .iter_mut()
            .enumerate()
            .map(|(i, strip)| StripCursor::new(strip, background.get(i).map(|(_, plane)| plane)))
            .collect();
        let mut runs = vec![];
        // Some rows of all channels are written before the following rows, so that the data from which the channels are
        // computed stays in the cache.
        for blocks in blocks.chunk_by(|a, b| a.block.y == b.block.y) {
            let height = blocks.first().map_or(0, |one| one.block.height);
            let blank = blocks.iter().all(|one| one.first_pixel.is_none());
            for row in (0..height).step_by(ROWS_PER_WRITE as usize) {
                self.pixel_runs(first, blocks, row..height.min(row + ROWS_PER_WRITE), &mut runs);
                for cursor in &mut rests {
                    if blank && cursor.is_already_background() {
                        continue;
                    }
                    let channel = cursor.channel;
                    let mut rows = RowWriter { runs: &runs, cursor };
                    match blank {
                        true => rows.write_background(),
                        false => write(channel, &mut rows),
                    }
                }
            }
        }
    }

    /// Fills a tile, which may be several tiles wide, with the background. All rows of one channel are written before
    /// the next channel.
    pub fn fill(&self, tile: &Tile, background: &[(Channel, ImagePlane)]) {
        let (first, mut strips) = self.tile_row(tile);
        let mut runs = vec![];
        let whole = PixelBlock { block: *tile, first_pixel: None };
        self.pixel_runs(first, &[whole], 0..tile.height, &mut runs);
        for (strip, (_, plane)) in strips.iter_mut().zip(background) {
            let cursor = &mut StripCursor::new(strip, Some(plane));
            if !cursor.is_already_background() {
                RowWriter { runs: &runs, cursor }.write_background();
            }
        }
    }

    /// Strips of the row of tiles that contains this tile, and the first image row of these strips.
    fn tile_row(&self, tile: &Tile) -> (u32, MutexGuard<'_, Vec<ChannelStrip<'a>>>) {
        let tile_row = (tile.y - self.region[1]) / TILE_SIZE;
        // After a panic, the lock is still usable: only the pixels of the panicked thread are missing.
        let strips = self.tile_rows[tile_row as usize].lock().unwrap_or_else(PoisonError::into_inner);
        (self.region[1] + tile_row * TILE_SIZE, strips)
    }

    /// Sets `runs` to the pixel runs of some rows of adjacent blocks; `first` is the first image row of the strip.
    fn pixel_runs(&self, first: u32, blocks: &[PixelBlock], rows: Range<u32>, runs: &mut Vec<PixelRun>) {
        runs.clear();
        for row in rows {
            for (i, &PixelBlock { block, first_pixel }) in blocks.iter().enumerate() {
                let length = block.width as usize;
                let before = (block.y + row - first) as usize * self.region[2] as usize;
                runs.push(PixelRun {
                    to: before + (block.x - self.region[0]) as usize,
                    from: first_pixel.map(|pixels| pixels + row as usize * length),
                    length,
                    starts_row: i == 0,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::output_plane;

    /// Image of pixel indices in which every third block is background, written tile by tile.
    fn written(region: [u32; 4], channels: &[Channel]) -> Vec<(Channel, ImagePlane)> {
        let mut planes = output_plane::allocate_planes(region, channels).unwrap();
        let film = Film::new(region, planes.iter_mut().map(OutputPlane::zeroed)).unwrap();
        let mut background = output_plane::allocate_planes([0, 0, 1, 1], channels).unwrap();
        for (_, plane) in &mut background {
            match plane {
                ImagePlane::F32 { data, .. } => data.fill(-1.5),
                ImagePlane::F64 { data, .. } => data.fill(-1.5),
                ImagePlane::I32 { data, .. } => data.fill(-1),
            }
        }
        for tile in Tile::for_threads(region, 2) {
            let (mut pixels, mut blocks) = (vec![], vec![]);
            for block in tile.blocks() {
                let seen = !is_blank(&block);
                blocks.push(PixelBlock { block, first_pixel: seen.then_some(pixels.len()) });
                if seen {
                    block.push_rows(&mut pixels);
                }
            }
            blocks.sort_by_key(|one| (one.block.y, one.block.x));
            let number = |i: usize| pixels[i][1] * 10_000 + pixels[i][0];
            film.write(&tile, &blocks, &background, |channel, page| match channel {
                Channel::Position => page.write(|i| [0.0, 0.25, 0.5].map(|k| k + f64::from(number(i)))),
                Channel::Normal => page.write(|i| [0.0, 0.25, 0.5].map(|k| k + number(i) as f32)),
                _ => page.write(|i| [number(i) as i32]),
            });
        }
        drop(film);
        planes
    }

    fn is_blank(block: &Tile) -> bool {
        (block.x / 8 + block.y / 8).is_multiple_of(3)
    }

    #[test]
    fn wide_tiles_write_only_their_own_pixels() {
        let channels = [Channel::Position, Channel::Instance];
        for (region, tile) in [
            ([3, 5, 100, 70], [35, 37, 60, 32]),
            ([0, 0, 700, 200], [0, 192, 700, 8]), // a merged tile of the full width
        ] {
            let mut planes = output_plane::allocate_planes(region, &channels).unwrap();
            let film = Film::new(region, planes.iter_mut().map(OutputPlane::zeroed)).unwrap();
            let mut background = output_plane::allocate_planes([0, 0, 1, 1], &channels).unwrap();
            for (i, (_, plane)) in background.iter_mut().enumerate() {
                match plane {
                    ImagePlane::F64 { data, .. } => data.copy_from_slice(&[1.0, f64::NAN, -0.5]),
                    ImagePlane::I32 { data, .. } => data.fill(-1 - i as i32),
                    ImagePlane::F32 { .. } => {}
                }
            }
            let [x, y, width, height] = tile;
            let tile = Tile { x, y, width, height };
            film.fill(&tile, &background);
            drop(film);
            for at in 0..region[2] * region[3] {
                let (u, v) = (at % region[2] + region[0], at / region[2] + region[1]);
                let inside = (x..x + width).contains(&u) && (y..y + height).contains(&v);
                let at = at as usize;
                let [ImagePlane::F64 { data: place, .. }, ImagePlane::I32 { data: id, .. }] =
                    [&planes[0].1, &planes[1].1]
                else {
                    unreachable!()
                };
                let place = &place[3 * at..][..3];
                match inside {
                    true => assert!(place[0] == 1.0 && place[1].is_nan() && place[2] == -0.5),
                    false => assert_eq!(place, [0.0; 3]),
                }
                assert_eq!(id[at], if inside { -2 } else { 0 });
            }
        }
    }

    #[test]
    fn pixels_of_small_and_large_images_are_written_in_place() {
        let channels = [Channel::Position, Channel::Normal, Channel::Triangle];
        for region in [[0, 0, 1, 1], [8, 16, 9, 70], [0, 0, 333, 211], [0, 8, 520, 400]] {
            let [x, y, width, height] = region;
            let planes = written(region, &channels);
            for (row, column) in (0..height).flat_map(|v| (0..width).map(move |u| (v, u))) {
                // The grid of blocks begins at the region's corner.
                let tile = Tile { x: x + column / 8 * 8, y: y + row / 8 * 8, width: 8, height: 8 };
                let number = (y + row) * 10_000 + x + column;
                let at = (row * width + column) as usize;
                let (real, whole) = match is_blank(&tile) {
                    true => ([-1.5; 3], -1),
                    false => ([0.0, 0.25, 0.5].map(|k| k + f64::from(number)), number as i32),
                };
                for (channel, plane) in &planes {
                    match plane {
                        ImagePlane::F64 { data, .. } => assert_eq!(data[3 * at..][..3], real),
                        ImagePlane::F32 { data, .. } => {
                            assert_eq!(data[3 * at..][..3], real.map(|k| k as f32));
                        }
                        ImagePlane::I32 { data, .. } => assert_eq!(data[at], whole, "{channel:?}"),
                    }
                }
            }
        }
    }
}
