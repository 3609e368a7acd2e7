//! An image around the world.

use std::sync::Arc;

use glam::Vec3;
use raycam_bvh::prefetch;
use raycam_scene::{Image, Interpolation, Texels, Texture, TextureSampler, Up, Wrap};

use super::LightSample;
use super::panorama::{Frame, Table};

/// A table for drawing directions has at most this many columns, and rows; larger images share its cells.
const MOST_CELLS: usize = 2048;

#[derive(Debug)]
pub(crate) struct Environment {
    texture: Texture,
    scale: f32,
    frame: Frame,
    table: Option<Table>,
}

impl Environment {
    pub fn new(image: Arc<Image>, up: Up, yaw: f64, scale: f32) -> Self {
        let table = table(&image);
        let texture = Texture {
            image,
            sampler: TextureSampler {
                wrap: [Wrap::Repeat, Wrap::Clamp],
                magnification: Interpolation::Linear,
                ..TextureSampler::default()
            },
        };
        Self {
            texture,
            scale,
            frame: Frame::new(up, yaw),
            table: table.filter(|_| scale > 0.0),
        }
    }

    pub fn sample(&self, random: [f32; 2]) -> Option<LightSample> {
        let direction = self.table.as_ref()?.sample(&self.frame, random);
        let (radiance, pdf) = self.behind(direction);
        Some(LightSample {
            direction,
            end: None,
            radiance,
            pdf,
            delta: false,
        })
    }

    /// Asks for what [`Environment::behind`] reads for a direction: one after the other, such reads are what takes the time.
    pub fn prefetch_behind(&self, direction: Vec3) {
        let place = self.frame.place(direction);
        if let Some(table) = &self.table {
            table.prefetch(place);
        }
        // Images with a high dynamic range are of this kind; others are a quarter of the size.
        let image = &*self.texture.image;
        if let Texels::Float(texels) = &image.texels {
            let [width, height] = image.size.map(|n| n as usize);
            let texel = |x: f32, n: usize| ((x * n as f32 - 0.5).max(0.0) as usize).min(n - 1);
            let (column, row) = (texel(place[0], width), texel(place[1], height));
            for row in [row, (row + 1).min(height - 1)] {
                for column in [column, (column + 1).min(width - 1)] {
                    prefetch(&raw const texels[row * width + column]);
                }
            }
        }
    }

    /// The same for [`Environment::sample`] of several.
    pub fn prefetch_samples(&self, random: &[[f32; 2]]) {
        if let Some(table) = &self.table {
            for random in random {
                table.prefetch_sample(*random);
            }
            for random in random {
                self.prefetch_behind(table.sample(&self.frame, *random));
            }
        }
    }

    /// The radiance out of a direction, and the density of [`Environment::sample`].
    pub fn behind(&self, direction: Vec3) -> (Vec3, f32) {
        let place = self.frame.place(direction);
        let texel = self.texture.lookup(place);
        let radiance = Vec3::from_slice(&texel).max(Vec3::ZERO) * self.scale;
        let pdf = self.table.as_ref().map_or(0.0, |table| table.pdf(place));
        (radiance, pdf)
    }
}

/// By the mean brightness of each cell as it is seen: linear between texels, which spreads every texel over its
/// neighbours by 1/8, 3/4, 1/8 both ways. So no direction that shines has the density 0.
fn table(image: &Image) -> Option<Table> {
    let [width, height] = image.size.map(|n| n as usize);
    let bright = |x: usize, y: usize| {
        let [r, g, b, _] = image
            .texels
            .linear(y * width + x)
            .map(|v| f64::from(v.max(0.0)));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let share = width.max(height).div_ceil(MOST_CELLS).max(1);
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
        spread(
            row(y.saturating_sub(1)),
            row(y),
            row((y + 1).min(height - 1)),
        )
    };
    // A cell of the table may cover parts of texels: all that it touches count.
    let range = |cell: usize, cells: usize, texels: usize| {
        cell * texels / cells..((cell + 1) * texels).div_ceil(cells)
    };
    Table::new([columns, rows], |column, row| {
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
