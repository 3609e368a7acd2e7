//! Where the planes of a picture are written, and how large they may be.

use raycam_bvh::zeros;
use rayon::prelude::*;

use crate::error::RenderError;
use crate::film::channel::{Channel, Kind};
use crate::film::frame::Plane;

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
    pub(crate) fn fits(&self, pixels: usize) -> bool {
        let (kind, length) = match &self.values {
            Values::F32(to) => (Kind::F32, to.len()),
            Values::F64(to) => (Kind::F64, to.len()),
            Values::I32(to) => (Kind::I32, to.len()),
        };
        kind == self.channel.kind() && length == pixels * self.channel.components()
    }

    /// Its rows of tiles, of so many pixels each.
    pub(crate) fn strips(self, pixels: usize) -> Vec<Values<'a>> {
        let length = pixels * self.channel.components();
        match self.values {
            Values::F32(to) => to.chunks_mut(length).map(Values::F32).collect(),
            Values::F64(to) => to.chunks_mut(length).map(Values::F64).collect(),
            Values::I32(to) => to.chunks_mut(length).map(Values::I32).collect(),
        }
    }
}
