//! The planes of a frame while many threads write them, a tile at a time.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use raycam_bvh::zeros;
use rayon::prelude::*;

use crate::channel::{Channel, Kind};
use crate::error::RenderError;
use crate::frame::Plane;
use crate::tile::{BLOCK, TILE, Tile};

/// The most memory that the planes of a frame may take.
pub const MAX_FRAME_BYTES: u64 = 8 << 30;

/// How many pixels a region has, if there is memory for its planes.
pub(crate) fn check_room(
    [_, _, width, height]: [u32; 4],
    channels: &[Channel],
) -> Result<usize, RenderError> {
    let pixels = u64::from(width) * u64::from(height);
    let bytes = pixels * channels.iter().map(|channel| channel.bytes()).sum::<u64>();
    let too_large = || RenderError::TooLarge {
        what: format!(
            "a frame of {width} x {height} pixels and {} channels",
            channels.len()
        ),
        bytes,
        limit: MAX_FRAME_BYTES,
    };
    let pixels = usize::try_from(pixels)
        .ok()
        .filter(|_| bytes <= MAX_FRAME_BYTES)
        .ok_or_else(too_large)?;
    // Asked for and given back: an allocation that fails below would end the process.
    Vec::<u8>::new()
        .try_reserve_exact(bytes as usize)
        .map_err(|_| too_large())?;
    Ok(pixels)
}

/// Allocates the planes of a region, by the threads of the pool it is called in.
pub(crate) fn planes(
    region: [u32; 4],
    channels: &[Channel],
) -> Result<Vec<(Channel, Plane)>, RenderError> {
    let pixels = check_room(region, channels)?;
    Ok(channels
        .par_iter()
        .map(|&channel| {
            let components = channel.components();
            let count = pixels * components;
            let plane = match channel.kind() {
                Kind::F32 => Plane::F32 {
                    components,
                    data: zeros(count),
                },
                Kind::F64 => Plane::F64 {
                    components,
                    data: zeros(count),
                },
                Kind::I32 => Plane::I32 {
                    components,
                    data: zeros(count),
                },
            };
            (channel, plane)
        })
        .collect())
}

/// Where a plane of a picture is written: as many values as the region has pixels, times the channel's components.
pub enum Values<'a> {
    /// float32.
    F32(&'a mut [f32]),
    /// float64.
    F64(&'a mut [f64]),
    /// int32.
    I32(&'a mut [i32]),
}

/// A plane to be written.
pub struct Target<'a> {
    /// What of.
    pub channel: Channel,
    /// Where to.
    pub values: Values<'a>,
    /// Whether all of them are 0 already; else they may be anything.
    pub zero: bool,
}

impl<'a> Target<'a> {
    /// One that is zero.
    pub(crate) fn of((channel, plane): &'a mut (Channel, Plane)) -> Self {
        Self {
            channel: *channel,
            values: match plane {
                Plane::F32 { data, .. } => Values::F32(data),
                Plane::F64 { data, .. } => Values::F64(data),
                Plane::I32 { data, .. } => Values::I32(data),
            },
            zero: true,
        }
    }

    /// Whether it is as large as it has to be, and of the kind of its channel.
    fn fits(&self, pixels: usize) -> bool {
        let (kind, length) = match &self.values {
            Values::F32(to) => (Kind::F32, to.len()),
            Values::F64(to) => (Kind::F64, to.len()),
            Values::I32(to) => (Kind::I32, to.len()),
        };
        kind == self.channel.kind() && length == pixels * self.channel.components()
    }

    /// Its rows of tiles, of so many pixels each.
    fn strips(self, pixels: usize) -> Vec<Strip<'a>> {
        let length = pixels * self.channel.components();
        match self.values {
            Values::F32(to) => to.chunks_mut(length).map(Strip::F32).collect(),
            Values::F64(to) => to.chunks_mut(length).map(Strip::F64).collect(),
            Values::I32(to) => to.chunks_mut(length).map(Strip::I32).collect(),
        }
    }
}

/// Pixels in a row: where they lie in a strip, and which of the tile's they are.
pub(crate) struct Run {
    to: usize,
    from: usize,
    length: usize,
}

/// Runs that are written at a time: what is known of them fits the nearest cache.
const RUNS: usize = 32;

/// The rows of one plane that a row of tiles covers.
pub(crate) enum Strip<'a> {
    F32(&'a mut [f32]),
    F64(&'a mut [f64]),
    I32(&'a mut [i32]),
}

impl Strip<'_> {
    /// Puts the value of each pixel in its place. What is no number of the strip's kind is rounded to one; those of all
    /// channels are.
    #[inline]
    pub fn put<T: Number, const N: usize>(
        &mut self,
        runs: &[Run],
        mut value: impl FnMut(usize) -> [T; N],
    ) {
        match self {
            Self::F32(to) => put(to, runs, |i| value(i).map(T::to_f32)),
            Self::F64(to) => put(to, runs, |i| value(i).map(T::to_f64)),
            Self::I32(to) => put(to, runs, |i| value(i).map(T::to_i32)),
        }
    }

    /// Gives these pixels the values of one.
    fn fill<T: Number>(&mut self, pixels: &[Range<usize>], one: &[T]) {
        let numbers = one.iter().copied();
        match self {
            Self::F32(to) => repeat(to, pixels, &numbers.map(T::to_f32).collect::<Vec<_>>()),
            Self::F64(to) => repeat(to, pixels, &numbers.map(T::to_f64).collect::<Vec<_>>()),
            Self::I32(to) => repeat(to, pixels, &numbers.map(T::to_i32).collect::<Vec<_>>()),
        }
    }
}

/// What strips are of.
pub(crate) trait Number: Copy {
    fn to_f32(self) -> f32;
    fn to_f64(self) -> f64;
    fn to_i32(self) -> i32;
}

macro_rules! number {
    ($($kind:ty),*) => {$(
        impl Number for $kind {
            fn to_f32(self) -> f32 {
                self as f32
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn to_i32(self) -> i32 {
                self as i32
            }
        }
    )*};
}
number!(f32, f64, i32);

/// A channel's part of a row of tiles, and whether all of it was 0.
type Part<'a> = (Channel, Strip<'a>, bool);

/// The planes of a region, cut into rows of tiles, each of which one thread writes at a time.
pub(crate) struct Film<'a> {
    region: [u32; 4],
    bands: Vec<Mutex<Vec<Part<'a>>>>,
}

impl<'a> Film<'a> {
    /// `None` where a target does not fit the region.
    pub fn new(region: [u32; 4], targets: impl Iterator<Item = Target<'a>>) -> Option<Self> {
        let mut bands: Vec<Vec<_>> = (0..region[3].div_ceil(TILE)).map(|_| vec![]).collect();
        let [width, height] = [region[2] as usize, region[3] as usize];
        for target in targets {
            if !target.fits(width * height) {
                return None;
            }
            let (channel, zero) = (target.channel, target.zero);
            for (band, strip) in bands.iter_mut().zip(target.strips(width * TILE as usize)) {
                band.push((channel, strip, zero));
            }
        }
        Some(Self {
            region,
            bands: bands.into_iter().map(Mutex::new).collect(),
        })
    }

    /// Whether it has these channels, in this order.
    pub fn is_of(&self, channels: &[Channel]) -> bool {
        self.bands.iter().all(|band| {
            let band = band.lock().unwrap_or_else(PoisonError::into_inner);
            band.iter().map(|(channel, ..)| channel).eq(channels)
        })
    }

    /// Gives all pixels of the blocks of a tile the values of a frame of one pixel.
    pub fn fill(&self, tile: &Tile, blocks: &[Tile], one: &[(Channel, Plane)]) {
        if blocks.is_empty() {
            return;
        }
        let (first, mut strips) = self.band(tile);
        // Memory that nobody writes to costs nothing.
        let idle =
            |((_, _, zero), (_, plane)): (&Part, &(Channel, Plane))| *zero && plane.is_zero();
        if strips.iter().zip(one).all(idle) {
            return;
        }
        let rows: Vec<Range<usize>> = blocks
            .iter()
            .flat_map(|block| (block.y..block.y + block.height).map(move |row| (block, row)))
            .map(|(block, row)| {
                let start = self.place(first, [block.x, row]);
                start..start + block.width as usize
            })
            .collect();
        for ((_, strip, zero), (_, plane)) in strips.iter_mut().zip(one) {
            if *zero && plane.is_zero() {
                continue;
            }
            match plane {
                Plane::F32 { data, .. } => strip.fill(&rows, data),
                Plane::F64 { data, .. } => strip.fill(&rows, data),
                Plane::I32 { data, .. } => strip.fill(&rows, data),
            }
        }
    }

    /// The rows of tiles that a tile is in, from which row on.
    fn band(&self, tile: &Tile) -> (u32, MutexGuard<'_, Vec<Part<'a>>>) {
        let band = (tile.y - self.region[1]) / TILE;
        // A thread that panicked left its own pixels unwritten; nobody else's suffer.
        let strips = self.bands[band as usize]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        (self.region[1] + band * TILE, strips)
    }

    /// Where in a strip that begins with the row `first` a pixel lies.
    fn place(&self, first: u32, [x, y]: [u32; 2]) -> usize {
        (y - first) as usize * self.region[2] as usize + (x - self.region[0]) as usize
    }

    /// Writes all channels of a tile: `write` gets each channel's strip and where in it `pixels` lie.
    pub fn write(
        &self,
        tile: &Tile,
        pixels: &[[u32; 2]],
        mut write: impl FnMut(Channel, &mut Strip, &[Run]),
    ) {
        let (first, mut strips) = self.band(tile);
        let mut runs: Vec<Run> = Vec::with_capacity((TILE * TILE / BLOCK) as usize);
        if pixels.len() == (TILE * TILE) as usize {
            // Blocks beside each other are written row by row: whole lines of the cache.
            for row in 0..TILE {
                let to = self.place(first, [tile.x, tile.y + row]);
                let block = (row / BLOCK * TILE + row % BLOCK) * BLOCK;
                runs.extend((0..TILE / BLOCK).map(|i| Run {
                    to: to + (i * BLOCK) as usize,
                    from: (block + i * BLOCK * BLOCK) as usize,
                    length: BLOCK as usize,
                }));
            }
        } else {
            for (from, &pixel) in pixels.iter().enumerate() {
                let to = self.place(first, pixel);
                match runs.last_mut() {
                    Some(run) if run.to + run.length == to => run.length += 1,
                    _ => runs.push(Run {
                        to,
                        from,
                        length: 1,
                    }),
                }
            }
            runs.sort_unstable_by_key(|run| run.to);
        }
        // Some pixels of all channels before others, so that what is known of them is looked up in the nearest cache.
        for some in runs.chunks(RUNS) {
            for (channel, strip, _) in strips.iter_mut() {
                write(*channel, strip, some);
            }
        }
    }
}

/// Puts the value of each pixel in its place.
#[inline]
fn put<T: Copy, const N: usize>(
    to: &mut [T],
    runs: &[Run],
    mut value: impl FnMut(usize) -> [T; N],
) {
    for run in runs {
        let (to, _) = to[run.to * N..][..run.length * N].as_chunks_mut();
        for (i, pixel) in to.iter_mut().enumerate() {
            *pixel = value(run.from + i);
        }
    }
}

/// The same values for each of these pixels.
fn repeat<T: Copy>(to: &mut [T], pixels: &[Range<usize>], one: &[T]) {
    for row in pixels {
        let to = &mut to[row.start * one.len()..row.end * one.len()];
        match one {
            [value] => to.fill(*value),
            _ => to
                .chunks_exact_mut(one.len())
                .for_each(|pixel| pixel.copy_from_slice(one)),
        }
    }
}
