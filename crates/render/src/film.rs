//! The planes of a frame while many threads write them, a tile at a time.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use raycam_bvh::zeros;
use rayon::prelude::*;

use crate::channel::{Channel, Kind};
use crate::error::RenderError;
use crate::frame::Plane;
use crate::tile::{TILE, Tile};

/// The most memory that the planes of a frame may take.
pub const MAX_FRAME_BYTES: u64 = 8 << 30;

/// Allocates the planes of a region, by the threads of the pool it is called in.
pub(crate) fn planes(
    [_, _, width, height]: [u32; 4],
    channels: &[Channel],
) -> Result<Vec<(Channel, Plane)>, RenderError> {
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
        places: &[usize],
        value: impl Fn(usize) -> [T; N],
    ) {
        match self {
            Self::F32(to) => put(to, places, |i| value(i).map(T::to_f32)),
            Self::F64(to) => put(to, places, |i| value(i).map(T::to_f64)),
            Self::I32(to) => put(to, places, |i| value(i).map(T::to_i32)),
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

/// The planes of a region, cut into rows of tiles, each of which one thread writes at a time.
pub(crate) struct Film<'a> {
    region: [u32; 4],
    bands: Vec<Mutex<Vec<(Channel, Strip<'a>)>>>,
}

impl<'a> Film<'a> {
    pub fn new(region: [u32; 4], planes: &'a mut [(Channel, Plane)]) -> Self {
        let mut bands: Vec<Vec<_>> = (0..region[3].div_ceil(TILE)).map(|_| vec![]).collect();
        for (channel, plane) in planes {
            let length = region[2] as usize * TILE as usize;
            let strips: Vec<Strip> = match plane {
                Plane::F32 { components, data } => data
                    .chunks_mut(length * *components)
                    .map(Strip::F32)
                    .collect(),
                Plane::F64 { components, data } => data
                    .chunks_mut(length * *components)
                    .map(Strip::F64)
                    .collect(),
                Plane::I32 { components, data } => data
                    .chunks_mut(length * *components)
                    .map(Strip::I32)
                    .collect(),
            };
            for (band, strip) in bands.iter_mut().zip(strips) {
                band.push((*channel, strip));
            }
        }
        Self {
            region,
            bands: bands.into_iter().map(Mutex::new).collect(),
        }
    }

    /// Gives all pixels of the blocks of a tile the values of a frame of one pixel.
    pub fn fill(&self, tile: &Tile, blocks: &[Tile], one: &[(Channel, Plane)]) {
        // Planes begin as zeros, and memory that nobody writes to costs nothing.
        if blocks.is_empty() || one.iter().all(|(_, plane)| plane.is_zero()) {
            return;
        }
        let (first, mut strips) = self.band(tile);
        let rows: Vec<Range<usize>> = blocks
            .iter()
            .flat_map(|block| (block.y..block.y + block.height).map(move |row| (block, row)))
            .map(|(block, row)| {
                let start = self.place(first, [block.x, row]);
                start..start + block.width as usize
            })
            .collect();
        for ((_, strip), (_, plane)) in strips.iter_mut().zip(one) {
            match plane {
                Plane::F32 { data, .. } => strip.fill(&rows, data),
                Plane::F64 { data, .. } => strip.fill(&rows, data),
                Plane::I32 { data, .. } => strip.fill(&rows, data),
            }
        }
    }

    /// The rows of tiles that a tile is in, from which row on.
    fn band(&self, tile: &Tile) -> (u32, MutexGuard<'_, Vec<(Channel, Strip<'a>)>>) {
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

    /// Writes all channels of a tile: `write` gets each channel's strip and where in it, in pixels, each of `pixels`
    /// lies.
    pub fn write(
        &self,
        tile: &Tile,
        pixels: &[[u32; 2]],
        mut write: impl FnMut(Channel, &mut Strip, &[usize]),
    ) {
        let (first, mut strips) = self.band(tile);
        let places: Vec<usize> = pixels.iter().map(|&at| self.place(first, at)).collect();
        for (channel, strip) in strips.iter_mut() {
            write(*channel, strip, &places);
        }
    }
}

/// Puts the value of each pixel in its place.
#[inline]
fn put<T: Copy, const N: usize>(to: &mut [T], places: &[usize], value: impl Fn(usize) -> [T; N]) {
    let mut at = 0;
    // A row of a block at a time, most often.
    for run in places.chunk_by(|a, b| a + 1 == *b) {
        let (to, _) = to[run[0] * N..][..run.len() * N].as_chunks_mut();
        for (i, pixel) in to.iter_mut().enumerate() {
            *pixel = value(at + i);
        }
        at += run.len();
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
