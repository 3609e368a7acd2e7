//! The planes of a frame while many threads write them, a tile at a time.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use raycam_bvh::{PastCache, Plain, past_cache};

use crate::channel::Channel;
use crate::frame::Plane;
use crate::target::{Target, Values};
use crate::tile::{TILE, Tile};

/// Bytes of a picture from which on it is written past the cache: it would not stay there.
const LARGE: usize = 4 << 20;

/// Rows of a tile that are written together, and their pixels: what is known of these fits the nearest cache. Rows of a block
/// are a multiple.
const ROWS: u32 = 4;
const PAGE: usize = (TILE * ROWS) as usize;

/// A block of a tile, and which of the tile's pixels it begins with; where that is none, it shows nothing but the
/// background.
pub(crate) type Block = (Tile, Option<usize>);

/// Pixels in a row: where they lie in a strip, and which of the tile's they are, unless they are background.
struct Run {
    to: usize,
    from: Option<usize>,
    length: usize,
    /// Whether it is the first of a row.
    begins: bool,
}

/// What planes are of.
pub(crate) trait Stored: Plain + 'static {
    /// The values of a plane of this kind; none of another.
    fn of(plane: &Plane) -> &[Self];

    /// What is to be written, if it is of this kind.
    fn to<'r, 'a>(values: &'r mut Values<'a>) -> Option<&'r mut &'a mut [Self]>;
}

macro_rules! stored {
    ($($kind:ty: $plane:ident),*) => {$(
        impl Stored for $kind {
            fn of(plane: &Plane) -> &[Self] {
                match plane {
                    Plane::$plane { data, .. } => data,
                    _ => &[],
                }
            }

            fn to<'r, 'a>(values: &'r mut Values<'a>) -> Option<&'r mut &'a mut [Self]> {
                match values {
                    Values::$plane(to) => Some(to),
                    _ => None,
                }
            }
        }
    )*};
}
stored!(f32: F32, f64: F64, i32: I32);

/// The rows of one channel that a row of tiles covers.
struct Strip<'a> {
    channel: Channel,
    values: Values<'a>,
    /// Whether all of them were 0 at first.
    zero: bool,
}

/// What lies in a strip behind the pixels that are written.
struct Rest<'a> {
    channel: Channel,
    values: Values<'a>,
    /// The number of its first pixel in the strip.
    at: usize,
    zero: bool,
    /// What is seen where nothing is.
    background: Option<&'a Plane>,
}

impl<'a> Rest<'a> {
    fn new(strip: &'a mut Strip<'_>, background: Option<&'a Plane>) -> Self {
        Self {
            channel: strip.channel,
            values: match &mut strip.values {
                Values::F32(to) => Values::F32(to),
                Values::F64(to) => Values::F64(to),
                Values::I32(to) => Values::I32(to),
            },
            at: 0,
            zero: strip.zero,
            background,
        }
    }

    /// Memory that nobody writes to costs nothing.
    fn is_idle(&self) -> bool {
        self.zero && self.background.is_some_and(Plane::is_zero)
    }
}

/// One channel of some pixels of a tile.
pub(crate) struct Page<'p, 'a> {
    rest: &'p mut Rest<'a>,
    runs: &'p [Run],
    past: Option<&'p mut PastCache<'a>>,
}

impl Page<'_, '_> {
    /// Puts the value of each pixel in its place, by its number in the tile. Values are of the kind that the channel is of;
    /// others are not put.
    #[inline]
    pub fn put<T: Stored, const N: usize>(&mut self, mut value: impl FnMut(usize) -> [T; N]) {
        let blank = self.blank();
        // All of them before the first is copied: what was written a moment ago is slow to be read.
        let mut pixels = [[T::default(); N]; PAGE];
        let mut room = pixels.as_mut_slice();
        for run in self.runs {
            let (here, after) = room.split_at_mut(run.length);
            room = after;
            match run.from {
                Some(from) => {
                    for (i, pixel) in here.iter_mut().enumerate() {
                        *pixel = value(from + i);
                    }
                }
                None => here.fill(blank),
            }
        }
        self.copy(pixels.as_flattened(), N, false);
    }

    /// Puts the background.
    fn put_background(&mut self) {
        match self.rest.background {
            Some(Plane::F32 { data, .. }) => self.repeat(data),
            Some(Plane::F64 { data, .. }) => self.repeat(data),
            Some(Plane::I32 { data, .. }) => self.repeat(data),
            None => {}
        }
    }

    fn repeat<T: Stored>(&mut self, pixel: &[T]) {
        let row = pixel.repeat(TILE as usize);
        self.copy(&row, pixel.len(), true);
    }

    /// What the background has.
    fn blank<T: Stored, const N: usize>(&self) -> [T; N] {
        let background = self.rest.background.map(T::of);
        let pixel = background.and_then(|pixel| pixel.first_chunk());
        pixel.copied().unwrap_or([T::default(); N])
    }

    /// Puts the values of the runs' pixels, those of one row after those of another, or the same `always`.
    fn copy<T: Stored>(&mut self, mut values: &[T], components: usize, always: bool) {
        let Some(rest) = T::to(&mut self.rest.values) else {
            return;
        };
        for row in self.runs.chunk_by(|_, run| !run.begins) {
            let to = row.first().map_or(self.rest.at, |run| run.to);
            let length = row.iter().map(|run| run.length).sum::<usize>();
            let before = (to - self.rest.at) * components;
            let (_, behind) = std::mem::take(rest).split_at_mut(before);
            let (here, behind) = behind.split_at_mut(length * components);
            let (row, after) = values.split_at(here.len());
            match &mut self.past {
                Some(past) => past.copy(here, row),
                None => here.copy_from_slice(row),
            }
            values = if always { values } else { after };
            (*rest, self.rest.at) = (behind, to + length);
        }
    }
}

/// The planes of a region, cut into rows of tiles, each of which one thread writes at a time.
pub(crate) struct Film<'a> {
    region: [u32; 4],
    bands: Vec<Mutex<Vec<Strip<'a>>>>,
    /// Whether it is [`LARGE`].
    large: bool,
}

impl<'a> Film<'a> {
    /// `None` where a target does not fit the region.
    pub fn new(region: [u32; 4], targets: impl Iterator<Item = Target<'a>>) -> Option<Self> {
        let mut bands: Vec<Vec<_>> = (0..region[3].div_ceil(TILE)).map(|_| vec![]).collect();
        let [width, height] = [region[2] as usize, region[3] as usize];
        let mut bytes = 0;
        for target in targets {
            if !target.fits(width * height) {
                return None;
            }
            bytes += width * height * target.channel.bytes() as usize;
            let (channel, zero) = (target.channel, target.zero);
            for (band, values) in bands.iter_mut().zip(target.strips(width * TILE as usize)) {
                band.push(Strip {
                    channel,
                    values,
                    zero,
                });
            }
        }
        Some(Self {
            region,
            bands: bands.into_iter().map(Mutex::new).collect(),
            large: bytes >= LARGE,
        })
    }

    /// Whether it has these channels, in this order.
    pub fn is_of(&self, channels: &[Channel]) -> bool {
        self.bands.iter().all(|band| {
            let band = band.lock().unwrap_or_else(PoisonError::into_inner);
            band.iter().map(|strip| &strip.channel).eq(channels)
        })
    }

    /// Writes all channels of a tile: `write` gets their pages. The blocks are those of the tile, row by row; `background` is
    /// what a frame of one pixel has, if any of them are that.
    pub fn write(
        &self,
        tile: &Tile,
        blocks: &[Block],
        background: &[(Channel, Plane)],
        mut write: impl FnMut(Channel, &mut Page),
    ) {
        let band = (tile.y - self.region[1]) / TILE;
        let first = self.region[1] + band * TILE;
        // A thread that panicked left its own pixels unwritten; nobody else's suffer.
        let mut strips = self.bands[band as usize]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let mut rests: Vec<Rest> = strips
            .iter_mut()
            .enumerate()
            .map(|(i, strip)| Rest::new(strip, background.get(i).map(|(_, plane)| plane)))
            .collect();
        let mut runs = vec![];
        past_cache(|past| {
            // Some rows in all channels before the next ones.
            for blocks in blocks.chunk_by(|(a, _), (b, _)| a.y == b.y) {
                let height = blocks.first().map_or(0, |(block, _)| block.height);
                let blank = blocks.iter().all(|(_, pixels)| pixels.is_none());
                for row in (0..height).step_by(ROWS as usize) {
                    self.runs(first, blocks, row..height.min(row + ROWS), &mut runs);
                    for rest in &mut rests {
                        if blank && rest.is_idle() {
                            continue;
                        }
                        let channel = rest.channel;
                        let mut page = Page {
                            runs: &runs,
                            past: self.large.then_some(&mut *past),
                            rest,
                        };
                        match blank {
                            true => page.put_background(),
                            false => write(channel, &mut page),
                        }
                    }
                }
            }
        });
    }

    /// The runs of rows of blocks beside each other, in a strip that begins with the row `first`.
    fn runs(&self, first: u32, blocks: &[Block], rows: Range<u32>, runs: &mut Vec<Run>) {
        runs.clear();
        for row in rows {
            for (i, (block, pixels)) in blocks.iter().enumerate() {
                let length = block.width as usize;
                let before = (block.y + row - first) as usize * self.region[2] as usize;
                runs.push(Run {
                    to: before + (block.x - self.region[0]) as usize,
                    from: pixels.map(|pixels| pixels + row as usize * length),
                    length,
                    begins: i == 0,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target;

    /// A picture of pixel numbers in which every third block is background, written tile by tile.
    fn written(region: [u32; 4], channels: &[Channel]) -> Vec<(Channel, Plane)> {
        let mut planes = target::planes(region, channels).unwrap();
        let film = Film::new(region, planes.iter_mut().map(Target::of)).unwrap();
        let mut background = target::planes([0, 0, 1, 1], channels).unwrap();
        for (_, plane) in &mut background {
            match plane {
                Plane::F32 { data, .. } => data.fill(-1.5),
                Plane::F64 { data, .. } => data.fill(-1.5),
                Plane::I32 { data, .. } => data.fill(-1),
            }
        }
        for tile in Tile::for_threads(region, 2) {
            let (mut pixels, mut blocks) = (vec![], vec![]);
            for block in tile.blocks() {
                let seen = !is_blank(&block);
                blocks.push((block, seen.then_some(pixels.len())));
                if seen {
                    block.add_rows(&mut pixels);
                }
            }
            blocks.sort_by_key(|(block, _)| (block.y, block.x));
            let number = |i: usize| pixels[i][1] * 10_000 + pixels[i][0];
            film.write(&tile, &blocks, &background, |channel, page| match channel {
                Channel::Position => {
                    page.put(|i| [0.0, 0.25, 0.5].map(|k| k + f64::from(number(i))))
                }
                Channel::Normal => page.put(|i| [0.0, 0.25, 0.5].map(|k| k + number(i) as f32)),
                _ => page.put(|i| [number(i) as i32]),
            });
        }
        drop(film);
        planes
    }

    fn is_blank(block: &Tile) -> bool {
        (block.x / 8 + block.y / 8).is_multiple_of(3)
    }

    #[test]
    fn every_pixel_is_written_in_its_place_small_pictures_and_large_ones() {
        let channels = [Channel::Position, Channel::Normal, Channel::Triangle];
        for region in [
            [0, 0, 1, 1],
            [8, 16, 9, 70],
            [0, 0, 333, 211],
            [0, 8, 520, 400],
        ] {
            let [x, y, width, height] = region;
            let large = u64::from(width * height) * 40 >= LARGE as u64;
            assert_eq!(large, width == 520);
            let planes = written(region, &channels);
            for (row, column) in (0..height).flat_map(|v| (0..width).map(move |u| (v, u))) {
                // Blocks begin where the region does.
                let tile = Tile {
                    x: x + column / 8 * 8,
                    y: y + row / 8 * 8,
                    width: 8,
                    height: 8,
                };
                let number = (y + row) * 10_000 + x + column;
                let at = (row * width + column) as usize;
                let (real, whole) = match is_blank(&tile) {
                    true => ([-1.5; 3], -1),
                    false => (
                        [0.0, 0.25, 0.5].map(|k| k + f64::from(number)),
                        number as i32,
                    ),
                };
                for (channel, plane) in &planes {
                    match plane {
                        Plane::F64 { data, .. } => assert_eq!(data[3 * at..][..3], real),
                        Plane::F32 { data, .. } => {
                            assert_eq!(data[3 * at..][..3], real.map(|k| k as f32));
                        }
                        Plane::I32 { data, .. } => assert_eq!(data[at], whole, "{channel:?}"),
                    }
                }
            }
        }
    }
}
