//! Output memory of a frame and its limits.

use raycam_bvh::zeroed_huge;
use rayon::prelude::*;

use crate::error::RenderError;
use crate::film::channel::{Channel, PixelType};
use crate::film::image_plane::ImagePlane;
use crate::memory::check_memory;

/// Maximum memory of a frame's planes, in bytes.
pub const MAX_FRAME_BYTES: u64 = 8 << 30;

/// Returns the number of pixels of a region, or an error if there is not enough memory for the region's planes.
pub(crate) fn check_size([_, _, width, height]: [u32; 4], channels: &[Channel]) -> Result<usize, RenderError> {
    let pixels = u64::from(width) * u64::from(height);
    // The arithmetic saturates, because with sides near 2^32 the number of bytes exceeds 64 bits.
    let bytes = pixels.saturating_mul(channels.iter().map(|channel| channel.bytes()).sum());
    let what = || format!("a frame of {width} x {height} pixels with {} channels", channels.len());
    let too_large = || RenderError::TooLarge { what: what(), bytes, limit: MAX_FRAME_BYTES };
    let pixels = usize::try_from(pixels).ok().filter(|_| bytes <= MAX_FRAME_BYTES).ok_or_else(too_large)?;
    check_memory(what, bytes)?;
    Ok(pixels)
}

/// Allocates zeroed planes of a region, on the threads of the current pool.
pub(crate) fn allocate_planes(
    region: [u32; 4],
    channels: &[Channel],
) -> Result<Vec<(Channel, ImagePlane)>, RenderError> {
    /// Minimum number of pixels for which zeroing uses several threads.
    const MANY_PIXELS: usize = 1 << 16;
    let pixels = check_size(region, channels)?;
    let plane = |&channel: &Channel| {
        let components = channel.components();
        let count = pixels * components;
        let plane = match channel.pixel_type() {
            PixelType::F32 => ImagePlane::F32 { components, data: zeroed_huge(count) },
            PixelType::F64 => ImagePlane::F64 { components, data: zeroed_huge(count) },
            PixelType::I32 => ImagePlane::I32 { components, data: zeroed_huge(count) },
        };
        (channel, plane)
    };
    Ok(if pixels < MANY_PIXELS {
        channels.iter().map(plane).collect()
    } else {
        channels.par_iter().map(plane).collect()
    })
}

/// Memory of a plane: one value for each component of each pixel.
pub enum PlaneData<'a> {
    /// float32.
    F32(&'a mut [f32]),
    /// float64.
    F64(&'a mut [f64]),
    /// int32.
    I32(&'a mut [i32]),
}

/// Plane to which a channel is written.
pub struct OutputPlane<'a> {
    /// Channel to write.
    pub channel: Channel,
    /// Memory to which the plane is written.
    pub values: PlaneData<'a>,
    /// True if all values are already 0; otherwise they are arbitrary.
    pub zero: bool,
}

impl<'a> OutputPlane<'a> {
    /// Creates the output plane for an image plane whose values are all 0.
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

    /// True if the plane's size and number type match the channel.
    pub(crate) fn fits(&self, pixels: usize) -> bool {
        let (kind, length) = match &self.values {
            PlaneData::F32(to) => (PixelType::F32, to.len()),
            PlaneData::F64(to) => (PixelType::F64, to.len()),
            PlaneData::I32(to) => (PixelType::I32, to.len()),
        };
        kind == self.channel.pixel_type() && length == pixels * self.channel.components()
    }

    /// Splits the plane into strips of `pixels` pixels, one for each row of tiles.
    pub(crate) fn split_rows(self, pixels: usize) -> Vec<PlaneData<'a>> {
        let length = pixels * self.channel.components();
        match self.values {
            PlaneData::F32(to) => to.chunks_mut(length).map(PlaneData::F32).collect(),
            PlaneData::F64(to) => to.chunks_mut(length).map(PlaneData::F64).collect(),
            PlaneData::I32(to) => to.chunks_mut(length).map(PlaneData::I32).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_above_the_memory_limit_are_refused_before_allocation() {
        let channels = [Channel::Color, Channel::Depth];
        assert_eq!(check_size([3, 4, 5, 6], &channels).unwrap(), 30);
        let error = check_size([0, 0, u32::MAX, u32::MAX], &channels).unwrap_err();
        assert!(matches!(error, RenderError::TooLarge { limit: MAX_FRAME_BYTES, .. }), "{error}");
    }
}
