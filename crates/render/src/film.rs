//! The planes of a frame while many threads write them, a tile at a time.

use std::sync::{Mutex, PoisonError};

use crate::channel::{Channel, Kind};
use crate::error::RenderError;
use crate::frame::Plane;
use crate::tile::{TILE, Tile};

/// The most memory that the planes of a frame may take.
pub const MAX_FRAME_BYTES: u64 = 8 << 30;

/// Allocates the planes of a region.
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
        .iter()
        .map(|&channel| {
            let components = channel.components();
            let count = pixels * components;
            let plane = match channel.kind() {
                Kind::F32 => Plane::F32 {
                    components,
                    data: vec![0.0; count],
                },
                Kind::F64 => Plane::F64 {
                    components,
                    data: vec![0.0; count],
                },
                Kind::I32 => Plane::I32 {
                    components,
                    data: vec![0; count],
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

    /// Writes all channels of a tile: `write` gets each channel's strip and where in it, in pixels, each of `pixels`
    /// lies.
    pub fn write(
        &self,
        tile: &Tile,
        pixels: &[[u32; 2]],
        mut write: impl FnMut(Channel, &mut Strip, &[usize]),
    ) {
        let band = (tile.y - self.region[1]) / TILE;
        let first = self.region[1] + band * TILE;
        let at = |&[x, y]: &[u32; 2]| {
            (y - first) as usize * self.region[2] as usize + (x - self.region[0]) as usize
        };
        let places: Vec<usize> = pixels.iter().map(at).collect();
        // A thread that panicked left its own pixels unwritten; nobody else's suffer.
        let mut strips = self.bands[band as usize]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        for (channel, strip) in strips.iter_mut() {
            write(*channel, strip, &places);
        }
    }
}
