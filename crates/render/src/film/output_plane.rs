//! Where the planes of a picture are written, and how large they may be.

use raycam_bvh::zeroed_huge;
use rayon::prelude::*;

use crate::error::RenderError;
use crate::film::channel::{Channel, PixelType};
use crate::film::image_plane::ImagePlane;

/// The most memory that the planes of a frame may take.
pub const MAX_FRAME_BYTES: u64 = 8 << 30;

/// How many pixels a region has, if there is memory for its planes.
pub(crate) fn check_size(
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
pub(crate) fn allocate_planes(
    region: [u32; 4],
    channels: &[Channel],
) -> Result<Vec<(Channel, ImagePlane)>, RenderError> {
    let pixels = check_size(region, channels)?;
    Ok(channels
        .par_iter()
        .map(|&channel| {
            let components = channel.components();
            let count = pixels * components;
            let plane = match channel.pixel_type() {
                PixelType::F32 => ImagePlane::F32 {
                    components,
                    data: zeroed_huge(count),
                },
                PixelType::F64 => ImagePlane::F64 {
                    components,
                    data: zeroed_huge(count),
                },
                PixelType::I32 => ImagePlane::I32 {
                    components,
                    data: zeroed_huge(count),
                },
            };
            (channel, plane)
        })
        .collect())
}

/// Where a plane of a picture is written: as many values as the region has pixels, times the channel's components.
pub enum PlaneData<'a> {
    /// float32.
    F32(&'a mut [f32]),
    /// float64.
    F64(&'a mut [f64]),
    /// int32.
    I32(&'a mut [i32]),
}

/// A plane to be written.
pub struct OutputPlane<'a> {
    /// What of.
    pub channel: Channel,
    /// Where to.
    pub values: PlaneData<'a>,
    /// Whether all of them are 0 already; else they may be anything.
    pub zero: bool,
}

impl<'a> OutputPlane<'a> {
    /// One that is zero.
    pub(crate) fn zeroed((channel, plane): &'a mut (Channel, ImagePlane)) -> Self {
        Self {
            channel: *channel,
            values: match plane {
                ImagePlane::F32 { data, .. } => PlaneData::F32(data),
                ImagePlane::F64 { data, .. } => PlaneData::F64(data),
                ImagePlane::I32 { data, .. } => PlaneData::I32(data),
            },
            zero: true,
        }
    }

    /// Whether it is as large as it has to be, and of the kind of its channel.
    pub(crate) fn fits(&self, pixels: usize) -> bool {
        let (kind, length) = match &self.values {
            PlaneData::F32(to) => (PixelType::F32, to.len()),
            PlaneData::F64(to) => (PixelType::F64, to.len()),
            PlaneData::I32(to) => (PixelType::I32, to.len()),
        };
        kind == self.channel.pixel_type() && length == pixels * self.channel.components()
    }

    /// Its rows of tiles, of so many pixels each.
    pub(crate) fn split_rows(self, pixels: usize) -> Vec<PlaneData<'a>> {
        let length = pixels * self.channel.components();
        match self.values {
            PlaneData::F32(to) => to.chunks_mut(length).map(PlaneData::F32).collect(),
            PlaneData::F64(to) => to.chunks_mut(length).map(PlaneData::F64).collect(),
            PlaneData::I32(to) => to.chunks_mut(length).map(PlaneData::I32).collect(),
        }
    }
}
