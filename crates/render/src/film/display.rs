//! Conversion of linear radiance to display integers.

use raycam_scene::color::{srgb_from_linear, srgb8_from_linear};
use raycam_scene::{ViewTransform, color::Rgb};
use rayon::prelude::*;

use crate::error::RenderError;
use crate::thread_pool::with_pool;

/// Number of pixels per task.
const PIXELS_PER_TASK: usize = 1 << 14;

/// 8-bit sRGB of linear colours times `scale`, through a view transform; NaN becomes 0.
///
/// # Errors
/// Errors of `with_pool`.
pub fn srgb8(pixels: &[Rgb], scale: f32, view: ViewTransform) -> Result<Vec<u8>, RenderError> {
    map_pixels(pixels, scale, view, srgb8_from_linear)
}

/// 16-bit sRGB of linear colours times `scale`, through a view transform; NaN becomes 0.
///
/// # Errors
/// Errors of `with_pool`.
pub fn srgb16(pixels: &[Rgb], scale: f32, view: ViewTransform) -> Result<Vec<u16>, RenderError> {
    // `as` maps NaN to 0 and saturates.
    let encode = |v: f32| (srgb_from_linear(v.clamp(0.0, 1.0)) * 65535.0).round() as u16;
    map_pixels(pixels, scale, view, |rgb| rgb.map(encode))
}

/// Encodes every pixel; uses all threads if there are more than [`PIXELS_PER_TASK`] pixels.
fn map_pixels<T: Copy + Default + Send>(
    pixels: &[Rgb],
    scale: f32,
    view: ViewTransform,
    encode: impl Fn(Rgb) -> [T; 3] + Sync,
) -> Result<Vec<T>, RenderError> {
    let mut data = vec![T::default(); 3 * pixels.len()];
    let run = |(to, from): (&mut [T], &[Rgb])| {
        for (to, from) in to.as_chunks_mut::<3>().0.iter_mut().zip(from) {
            *to = encode(view.apply(from.map(|v| v * scale)));
        }
    };
    if pixels.len() <= PIXELS_PER_TASK {
        run((&mut data, pixels));
        return Ok(data);
    }
    with_pool(None, || {
        let runs = data.par_chunks_mut(3 * PIXELS_PER_TASK).zip(pixels.par_chunks(PIXELS_PER_TASK));
        runs.for_each(run);
    })?;
    Ok(data)
}
