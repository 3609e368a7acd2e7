//! Environment map: bilinear lookups for many directions at a time.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use raycam_bvh::{WithSimd, dispatch_simd, prefetch};
use raycam_scene::{Image, Texels};

/// Equirectangular image that repeats horizontally.
#[derive(Debug)]
pub(crate) struct EnvironmentImage {
    pub image: Arc<Image>,
    /// Factor on the image's values.
    pub scale: f32,
}

/// Image coordinates in 0..=1 (right, down) and the four texels around each position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BilinearTaps<const N: usize> {
    uv: [[f32; N]; 2],
    columns: [[u32; N]; 2],
    rows: [[u32; N]; 2],
    /// Interpolation weights of the second column and row.
    fraction: [[f32; N]; 2],
}

impl<const N: usize> BilinearTaps<N> {
    pub fn uv(&self, lane: usize) -> [f32; 2] {
        [self.uv[0][lane], self.uv[1][lane]]
    }
}

impl EnvironmentImage {
    /// Texels around image coordinates, with their interpolation weights.
    pub fn taps<const N: usize>(&self, places: [[f32; N]; 2]) -> BilinearTaps<N> {
        let mut taps = BilinearTaps { uv: places, columns: [[0; N]; 2], rows: [[0; N]; 2], fraction: [[0.0; N]; 2] };
        dispatch_simd(ComputeTaps { size: self.image.size, taps: &mut taps });
        taps
    }

    /// Prefetches the texels of a lane.
    #[inline]
    pub fn prefetch<const N: usize>(&self, taps: &BilinearTaps<N>, lane: usize) {
        // High dynamic range images are stored as float32; other images take a quarter of this memory.
        if let Texels::Float(texels) = &self.image.texels {
            let [above, below] = self.indices(taps, lane);
            for index in above.into_iter().chain(below) {
                prefetch(&raw const texels[index]);
            }
        }
    }

    /// Interpolated radiance of a lane.
    #[inline]
    pub fn radiance<const N: usize>(&self, taps: &BilinearTaps<N>, lane: usize) -> Vec3 {
        let texel = |index: usize| match &self.image.texels {
            Texels::Float(texels) => Vec4::from(texels[index]),
            texels => Vec4::from(texels.linear(index)),
        };
        let [right, down] = [taps.fraction[0][lane], taps.fraction[1][lane]];
        let mix = |a: Vec4, b: Vec4, t: f32| a + (b - a) * t;
        let [above, below] = self.indices(taps, lane).map(|row| mix(texel(row[0]), texel(row[1]), right));
        mix(above, below, down).truncate().max(Vec3::ZERO) * self.scale
    }

    /// Indices of a lane's four texels, row by row.
    #[inline]
    fn indices<const N: usize>(&self, taps: &BilinearTaps<N>, lane: usize) -> [[usize; 2]; 2] {
        let width = self.image.size[0] as usize;
        let columns = [0, 1].map(|i: usize| taps.columns[i][lane] as usize);
        [0, 1].map(|i: usize| columns.map(|column| taps.rows[i][lane] as usize * width + column))
    }
}

/// Loop over lanes that computes [`EnvironmentImage::taps`].
struct ComputeTaps<'a, const N: usize> {
    size: [u32; 2],
    taps: &'a mut BilinearTaps<N>,
}

impl<const N: usize> WithSimd for ComputeTaps<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self { size, taps } = self;
        let ends = size.map(|size| size as i32 - 1);
        for lane in 0..N {
            let [(x, right), (y, down)] = [0, 1].map(|axis: usize| {
                // The position is measured from the centre of the texel before the first texel, so that its whole part
                // is the index of the second of two neighbouring texels.
                let position = taps.uv[axis][lane] * size[axis] as f32 + 0.5;
                let next = (position as i32).clamp(0, ends[axis] + 1);
                (next, position - next as f32)
            });
            let first = if x == 0 { ends[0] } else { x - 1 };
            taps.columns[0][lane] = first as u32;
            taps.columns[1][lane] = if x > ends[0] { 0 } else { x as u32 };
            taps.rows[0][lane] = (y - 1).max(0) as u32;
            taps.rows[1][lane] = y.min(ends[1]) as u32;
            taps.fraction[0][lane] = right;
            taps.fraction[1][lane] = down;
        }
    }
}
