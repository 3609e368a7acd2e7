//! Colours of a photograph at fractional pixels, averaged over areas of pixels.

use std::ops::Range;

use glam::DVec2;
use raycam_scene::Texels;

use crate::control::Control;
use crate::error::RenderError;
use crate::queries::tasks::{in_tasks, is_brief};

/// Maximum number of lookups along the longer axis of an area.
const MAX_TAPS: f64 = 4.0;
/// Estimated time of an area on one thread, in nanoseconds.
const NS_PER_AREA: f64 = 150.0;

/// A photograph with copies at half, quarter, ... size, until a side has one pixel.
#[derive(Clone, Debug)]
pub struct PhotoPyramid {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    size: [usize; 2],
    pixels: Texels,
}

impl Level {
    /// Returns the level of half the size, whose pixels are means of 2 x 2 pixels. Of an odd number of rows or columns,
    /// the last one is omitted.
    fn halve(&self) -> Self {
        let [width, height] = self.size.map(|side| side / 2);
        let row = |y: usize| -> Vec<[f32; 4]> {
            (y * self.size[0]..(y + 1) * self.size[0]).map(|at| self.pixels.linear(at)).collect()
        };
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let (upper, lower) = (row(2 * y), row(2 * y + 1));
            let pairs = upper.as_chunks().0.iter().zip(lower.as_chunks().0);
            pixels.extend(pairs.map(|([a, b], [c, d])| -> [f32; 4] {
                std::array::from_fn(|i| ((a[i] + c[i]) + (b[i] + d[i])) * 0.25)
            }));
        }
        Self { size: [width, height], pixels: Texels::Float(pixels) }
    }

    /// Interpolates between the four pixels around a place, which is given in pixels of this level from the top left
    /// corner.
    fn bilinear(&self, place: DVec2) -> [f64; 4] {
        let [width, height] = self.size;
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let place = (place - 0.5).clamp(DVec2::ZERO, last);
        let (left, top) = (place.x as usize, place.y as usize);
        let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let (fx, fy) = (place.x - left as f64, place.y - top as f64);
        let row = |y: usize| {
            let [a, b] = [left, right].map(|x| self.pixels.linear(y * width + x).map(f64::from));
            std::array::from_fn::<f64, 4, _>(|i| (1.0 - fx) * a[i] + fx * b[i])
        };
        let (upper, lower) = (row(top), row(bottom));
        std::array::from_fn(|i| (1.0 - fy) * upper[i] + fy * lower[i])
    }
}

impl PhotoPyramid {
    /// Creates the pyramid of a photograph of `size` (width, height), at least 1 x 1 pixel. The photograph's own pixels
    /// keep their format, because most of them are never looked up.
    ///
    /// # Errors
    /// [`RenderError::Settings`] if the number of pixels is not width x height, or 0.
    pub fn new(size: [usize; 2], pixels: Texels) -> Result<Self, RenderError> {
        if pixels.is_empty() || pixels.len() != size[0] * size[1] {
            return Err(RenderError::settings(format!(
                "photograph of size {} x {}: expected at least one pixel, and as many as the size specifies, got {}",
                size[0],
                size[1],
                pixels.len()
            )));
        }
        let mut levels = vec![Level { size, pixels }];
        while let Some(last) = levels.last().filter(|level| level.size[0].min(level.size[1]) > 1) {
            levels.push(last.halve());
        }
        Ok(Self { levels })
    }

    /// Returns the mean colours of areas around `places`, which are in pixels from the top left corner. An area
    /// \[a, b, c, d] is the parallelogram with the sides (a, c) and (b, d) in pixels; its numbers that are not finite
    /// count as 0.
    ///
    /// Up to four lookups are placed along an area's longer axis. Each lookup averages over the width of the shorter
    /// axis, or over a quarter of a longer axis that is more than four times as long. Source:
    /// McCormack, Perry, Farkas and Jouppi, Feline: fast elliptical lines for anisotropic texture mapping, 1999.
    ///
    /// # Errors
    /// [`RenderError::Settings`] if the arrays differ in length, [`RenderError::Cancelled`], and errors of
    /// `crate::thread_pool::with_pool`.
    pub fn mean_colors(
        &self,
        places: &[[f64; 2]],
        areas: &[[f64; 4]],
        threads: Option<usize>,
        control: &Control,
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        let n = places.len();
        if n != areas.len() {
            return Err(RenderError::settings(format!("{n} places and {} areas; expected equal numbers", areas.len())));
        }
        let mut found = Vec::with_capacity(n);
        let work = |range: Range<usize>| -> Vec<[f32; 4]> {
            range.map(|i| self.mean_color(DVec2::from(places[i]), areas[i])).collect()
        };
        in_tasks((n, NS_PER_AREA), threads, control, work, |mut more| found.append(&mut more))?;
        Ok(found)
    }

    /// True if the calling thread alone can compute the colours of `n` areas in a fraction of a millisecond.
    pub fn is_brief(n: usize) -> bool {
        is_brief(n, NS_PER_AREA)
    }

    fn mean_color(&self, place: DVec2, area: [f64; 4]) -> [f32; 4] {
        let [a, b, c, d] = area.map(|value| if value.is_finite() { value } else { 0.0 });
        // Singular values of the matrix, and the direction of the longer axis.
        let (p, q, r) = (a * a + b * b, c * c + d * d, a * c + b * d);
        let (middle, half) = (f64::midpoint(p, q), (p - q) / 2.0);
        let off = (half * half + r * r).sqrt();
        let (longer, shorter) = ((middle + off).sqrt(), (middle - off).max(0.0).sqrt());
        let taps = (longer / shorter.max(1.0) - 0.5).ceil().clamp(1.0, MAX_TAPS);
        if taps == 1.0 {
            return self.color_at(place, (longer * shorter).sqrt());
        }
        let width = shorter.max(longer / taps);
        let cosine = half / off;
        let along = DVec2::new(f64::midpoint(1.0, cosine).sqrt(), ((1.0 - cosine) / 2.0).sqrt().copysign(r)) * longer;
        let mut total = [0.0f32; 4];
        for tap in 0..taps as usize {
            let color = self.color_at(place + ((tap as f64 + 0.5) / taps - 0.5) * along, width);
            total = std::array::from_fn(|i| total[i] + color[i]);
        }
        total.map(|sum| sum / taps as f32)
    }

    /// Mean colour over about `width` pixels, interpolated between the two levels whose pixel sizes enclose `width`.
    fn color_at(&self, place: DVec2, width: f64) -> [f32; 4] {
        let top = self.levels.len() - 1;
        let level = libm::log2(width.max(1.0)).min(top as f64);
        let low = level as usize;
        let share = level - low as f64;
        let from = |number: usize| self.levels[number].bilinear(place / (1u64 << number) as f64);
        let fine = from(low);
        if share == 0.0 {
            return fine.map(|value| value as f32);
        }
        let coarse = from(low + 1);
        std::array::from_fn(|i| ((1.0 - share) * fine[i] + share * coarse[i]) as f32)
    }
}
