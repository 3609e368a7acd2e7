//! Environment light: an image around the scene, or a Preetham sky.

pub(crate) mod environment_image;
pub(crate) mod equirect;
pub(crate) mod gradient_sky;
pub(crate) mod preetham;

use std::f64::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use raycam_scene::{Image, Up};

use crate::light::environment::environment_image::{BilinearTaps, EnvironmentImage};
use crate::light::environment::equirect::EquirectFrame;
use crate::light::environment::preetham::PreethamSky;
use crate::light::samples::{EnvironmentSample, LightLiSample};
use crate::sampling::piecewise_constant_2d::PiecewiseConstant2D;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Maximum number of columns, and of rows, of a sampling distribution; cells of larger images are merged.
const MAX_CELLS: usize = 2048;

/// Columns and rows of the sampling distribution of a Preetham sky.
const SKY_CELLS: [usize; 2] = [256, 128];

/// Number of directions per block of lookups, so that the data that a block reads fits the L1 cache.
const LOOKUP_BLOCK: usize = 64;

#[derive(Debug)]
pub(crate) struct EnvironmentLight {
    frame: EquirectFrame,
    distribution: Option<Arc<PiecewiseConstant2D>>,
    source: EnvironmentSource,
}

/// Source of the radiance by direction.
#[derive(Debug)]
enum EnvironmentSource {
    Image(EnvironmentImage),
    Preetham(PreethamSky),
}

/// Lookups in progress. For an image, the texels have been prefetched; for a sky, the radiance has already been
/// computed.
enum PendingLookups<'a, const N: usize> {
    Image(&'a EnvironmentImage, BilinearTaps<N>),
    Sky { uv: [[f32; N]; 2], radiances: Vec3xN<f32, N> },
}

impl<const N: usize> PendingLookups<'_, N> {
    /// Image coordinates of a lane.
    fn uv(&self, lane: usize) -> [f32; 2] {
        match self {
            PendingLookups::Image(_, taps) => taps.uv(lane),
            PendingLookups::Sky { uv, .. } => uv.map(|values| values[lane]),
        }
    }
}

impl EnvironmentLight {
    /// Environment light of an image; it shares the table of one of the `known` lights that has the same image.
    pub fn new(image: Arc<Image>, up: Up, yaw: f64, scale: f32, known: &[&EnvironmentLight]) -> Self {
        let is_same = |other: &&&EnvironmentLight| match &other.source {
            EnvironmentSource::Image(source) => Arc::ptr_eq(&source.image, &image) && source.scale > 0.0,
            EnvironmentSource::Preetham(_) => false,
        };
        let distribution = (scale > 0.0).then(|| match known.iter().find(is_same) {
            Some(other) => other.distribution.clone(),
            None => image_distribution(&image).map(Arc::new),
        });
        Self {
            frame: EquirectFrame::new(up, yaw),
            distribution: distribution.flatten(),
            source: EnvironmentSource::Image(EnvironmentImage { image, scale }),
        }
    }

    /// Environment light of a Preetham sky; it shares the table of one of the `known` lights that has the same sky.
    pub fn of_sky(sky: PreethamSky, up: Up, known: &[&EnvironmentLight]) -> Self {
        let frame = EquirectFrame::new(up, 0.0);
        let is_same = |other: &&&EnvironmentLight| match &other.source {
            EnvironmentSource::Preetham(source) => *source == sky && other.frame == frame,
            EnvironmentSource::Image(_) => false,
        };
        let distribution = match known.iter().find(is_same) {
            Some(other) => other.distribution.clone(),
            None => sky_distribution(&sky, &frame).map(Arc::new),
        };
        Self { frame, distribution, source: EnvironmentSource::Preetham(sky) }
    }

    /// Samples a direction in proportion to brightness; `None` if the environment is black.
    pub fn sample(&self, random: [f32; 2]) -> Option<LightLiSample> {
        let direction = self.frame.sample(self.distribution.as_ref()?, random);
        let (radiance, pdf) = self.radiance_and_pdf(direction);
        let around = EnvironmentSample { direction, radiance, pdf };
        Some(around.sample())
    }

    /// Same as [`EnvironmentLight::sample`], for many random numbers. If the environment is black, `out` becomes empty.
    pub fn sample_many(&self, random: &[[f32; 2]], out: &mut Vec<EnvironmentSample>) {
        out.clear();
        let Some(table) = &self.distribution else {
            return;
        };
        for random in random.chunks(LOOKUP_BLOCK) {
            let mut directions = [[0.0; LOOKUP_BLOCK]; 3];
            self.frame.sample_many(table, random, &mut directions);
            let lookups = self.begin_lookups(&directions, random.len());
            out.extend((0..random.len()).map(|lane| {
                let (radiance, pdf) = self.finish_lookup(&lookups, lane);
                EnvironmentSample { direction: get_lane(&directions, lane).into(), radiance, pdf }
            }));
        }
    }

    /// Radiance from a direction, and the density of [`EnvironmentLight::sample`].
    pub fn radiance_and_pdf(&self, direction: Vec3) -> (Vec3, f32) {
        let directions = direction.to_array().map(|value| [value]);
        self.finish_lookup(&self.begin_lookups(&directions, 1), 0)
    }

    /// Same as [`EnvironmentLight::radiance_and_pdf`], for many directions, with prefetched memory.
    pub fn lookup_many(&self, directions: impl Iterator<Item = Vec3>, out: &mut Vec<(Vec3, f32)>) {
        out.clear();
        let mut block = [[0.0; LOOKUP_BLOCK]; 3];
        let mut count = 0;
        let mut find = |block: &Vec3xN<f32, LOOKUP_BLOCK>, count| {
            let lookups = self.begin_lookups(block, count);
            out.extend((0..count).map(|lane| self.finish_lookup(&lookups, lane)));
        };
        for direction in directions {
            set_lane(&mut block, count, direction.to_array());
            count += 1;
            if count == LOOKUP_BLOCK {
                find(&block, count);
                count = 0;
            }
        }
        find(&block, count);
    }

    /// Computes the addresses for the first `count` directions, and prefetches the data that
    /// [`EnvironmentLight::finish_lookup`] reads.
    fn begin_lookups<const N: usize>(&self, directions: &Vec3xN<f32, N>, count: usize) -> PendingLookups<'_, N> {
        let mut uv = [[0.0; N]; 2];
        self.frame.to_uv_many(directions, &mut uv);
        let lookups = match &self.source {
            EnvironmentSource::Image(backdrop) => PendingLookups::Image(backdrop, backdrop.taps(uv)),
            EnvironmentSource::Preetham(sky) => PendingLookups::Sky { uv, radiances: sky.radiance_many(directions) },
        };
        for lane in 0..if N > 1 { count } else { 0 } {
            if let PendingLookups::Image(backdrop, taps) = &lookups {
                backdrop.prefetch(taps, lane);
            }
            if let Some(table) = &self.distribution {
                table.prefetch(lookups.uv(lane));
            }
        }
        lookups
    }

    /// Radiance and density of a lane.
    fn finish_lookup<const N: usize>(&self, lookups: &PendingLookups<N>, lane: usize) -> (Vec3, f32) {
        let pdf = match &self.distribution {
            Some(table) => table.pdf(lookups.uv(lane)),
            None => 0.0,
        };
        let radiance = match lookups {
            PendingLookups::Image(backdrop, taps) => backdrop.radiance(taps, lane),
            PendingLookups::Sky { radiances, .. } => get_lane(radiances, lane).into(),
        };
        (radiance, pdf)
    }
}

/// Sampling distribution of an image: mean brightness of each cell under bilinear interpolation, which spreads a
/// texel over its neighbours with weights 1/8, 3/4, 1/8 along both axes. No emitting direction therefore has density
/// 0.
fn image_distribution(image: &Image) -> Option<PiecewiseConstant2D> {
    let [width, height] = image.size.map(|n| n as usize);
    let bright = |x: usize, y: usize| {
        let [r, g, b, _] = image.texels.linear(y * width + x).map(|v| f64::from(v.max(0.0)));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let share = width.max(height).div_ceil(MAX_CELLS).max(1);
    let [columns, rows] = [width.div_ceil(share), height.div_ceil(share)];
    let mut texels: Vec<f64> = vec![0.0; width * height];
    for y in 0..height {
        for x in 0..width {
            texels[y * width + x] = bright(x, y);
        }
    }
    let spread = |a: f64, b: f64, c: f64| (a + 6.0 * b + c) / 8.0;
    let seen = |x: usize, y: usize| {
        let row = |y: usize| {
            let at = |x: usize| texels[y * width + x];
            spread(at((x + width - 1) % width), at(x), at((x + 1) % width))
        };
        spread(row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1)))
    };
    // A cell may cover parts of texels; every texel that it touches is included.
    let range = |cell: usize, cells: usize, texels: usize| cell * texels / cells..((cell + 1) * texels).div_ceil(cells);
    PiecewiseConstant2D::new([columns, rows], |column, row| {
        let mut sum = 0.0;
        let (ys, xs) = (range(row, rows, height), range(column, columns, width));
        let count = (ys.len() * xs.len()) as f64;
        for y in ys {
            for x in xs.clone() {
                sum += seen(x, y);
            }
        }
        sum / count
    })
}

/// Sampling distribution of a sky. The brightness of a cell is the maximum at its corners and its centre, so that the
/// distribution includes the glow around the sun.
fn sky_distribution(sky: &PreethamSky, frame: &EquirectFrame) -> Option<PiecewiseConstant2D> {
    let [columns, rows] = SKY_CELLS.map(|n| n as f64);
    PiecewiseConstant2D::new(SKY_CELLS, |column, row| {
        let bright = |(dx, dy): (f64, f64)| {
            let (u, v) = ((column as f64 + dx) / columns, (row as f64 + dy) / rows);
            let [r, g, b] = sky.radiance(frame.direction(u, (PI * v).cos())).to_array();
            f64::from(r + g + b)
        };
        let uv = [(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
        uv.map(bright).into_iter().fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use raycam_scene::{Texels, Texture, TextureSampler, Wrap};

    use super::*;

    /// An environment with an image in which all texels have different values.
    fn made(size: [u32; 2]) -> (EnvironmentLight, Texture) {
        let texel = |i: u32| [1, 3, 5, 7].map(|k| (1 + i * k * 503 % 1009) as f32 / 100.0);
        let image = Arc::new(Image::new("", size, Texels::Float((0..size[0] * size[1]).map(texel).collect())));
        let sampler = TextureSampler { wrap: [Wrap::Repeat, Wrap::Clamp], ..TextureSampler::default() };
        let environment = EnvironmentLight::new(image.clone(), Up::Z, 20.0, 2.0, &[]);
        (environment, Texture { image, sampler })
    }

    fn unit(i: usize) -> Vec3 {
        let angle = i as f64 * 2.4;
        let z = 1.0 - 2.0 * ((i * 37) % 401) as f64 / 400.0;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z).as_vec3()
    }

    /// Looks up many directions and checks that each result equals a single lookup; returns the radiance of each.
    fn many(environment: &EnvironmentLight, count: usize) -> Vec<Vec3> {
        let random = |i: usize| [(i * 53 % 211) as f32 / 210.0, (i % 97) as f32 / 96.0];
        let random: Vec<[f32; 2]> = (0..count).map(random).collect();
        let mut drawn = vec![];
        environment.sample_many(&random, &mut drawn);
        assert_eq!(drawn.len(), count);
        for (random, around) in random.iter().zip(&drawn) {
            let each = environment.sample(*random).unwrap();
            assert_eq!(format!("{:?}", around.sample()), format!("{each:?}"));
        }
        let mut behind = vec![];
        environment.lookup_many((0..count).map(unit), &mut behind);
        let each = (0..count).map(|i| environment.radiance_and_pdf(unit(i)));
        assert!(behind.iter().copied().eq(each));
        behind.into_iter().map(|(radiance, _)| radiance).collect()
    }

    const COUNTS: [usize; 5] = [0, 1, LOOKUP_BLOCK - 1, LOOKUP_BLOCK, 3 * LOOKUP_BLOCK + 5];

    #[test]
    fn batched_image_lookups_equal_single_lookups() {
        for size in [[1, 1], [2, 1], [37, 20], [512, 256]] {
            let (environment, texture) = made(size);
            for count in COUNTS {
                for (i, radiance) in many(&environment, count).into_iter().enumerate() {
                    let texel = texture.lookup(environment.frame.to_uv(unit(i)));
                    let off = radiance - Vec3::from_slice(&texel) * 2.0;
                    assert!(off.abs().max_element() < 2e-2, "{size:?}, {i}: {off}");
                }
            }
        }
    }

    #[test]
    fn batched_sky_lookups_equal_single_lookups() {
        let made = || PreethamSky::new(Up::Y, DVec3::new(1.0, -0.4, 0.2), 3.0, 1.5).0;
        let (environment, sky) = (EnvironmentLight::of_sky(made(), Up::Y, &[]), made());
        for count in COUNTS {
            for (i, radiance) in many(&environment, count).into_iter().enumerate() {
                assert_eq!(radiance, sky.radiance(unit(i)));
            }
        }
    }
}
