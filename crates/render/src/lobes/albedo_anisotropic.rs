//! Directional albedo of anisotropic interfaces. A block of the table is computed when its roughness is first used.

use std::sync::OnceLock;

use glam::Vec3;

use crate::lobes::albedo_grid::{MIN_TABLE_ALPHA, hemisphere_mean, interpolate};
use crate::lobes::fresnel::schlick_weight;
use crate::lobes::ggx::Ggx;

/// Entries along the perceptual roughness of the smoother direction, along anisotropy, along the square root of the
/// cosine, and along the square of the cosine of the azimuth.
const ROUGHNESS_ROWS: usize = 32;
const ANISOTROPY_COLUMNS: usize = 24;
const COSINE_STEPS: usize = 48;
const AZIMUTH_STEPS: usize = 9;
/// Quadrature points per table entry.
const RADIAL_POINTS: u32 = 48;
const ANGULAR_POINTS: u32 = 48;

/// Table for one roughness and anisotropy: the albedo for f0 = f90 = 1, and the part of this albedo that is
/// proportional to f0.
#[derive(Debug)]
struct AlbedoBlock {
    all: [[f32; COSINE_STEPS]; AZIMUTH_STEPS],
    f0: [[f32; COSINE_STEPS]; AZIMUTH_STEPS],
    all_mean: f32,
    f0_mean: f32,
}

static BLOCKS: [[OnceLock<Box<AlbedoBlock>>; ANISOTROPY_COLUMNS]; ROUGHNESS_ROWS] =
    [const { [const { OnceLock::new() }; ANISOTROPY_COLUMNS] }; ROUGHNESS_ROWS];

/// Albedo at one roughness and anisotropy, interpolated between four blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnisotropicAlbedo {
    blocks: [&'static AlbedoBlock; 4],
    fraction: [f32; 2],
    /// True if the bitangent is the rougher direction.
    swap_axes: bool,
}

impl AnisotropicAlbedo {
    pub fn new(ggx: &Ggx) -> Self {
        let (low, high) = (ggx.alpha_x.min(ggx.alpha_y).max(MIN_TABLE_ALPHA), ggx.alpha_x.max(ggx.alpha_y).min(1.0));
        let strength = ((high - low) / (1.0 - low)).max(0.0).sqrt();
        let position = |value: f32, count: usize| {
            let position = value.clamp(0.0, 1.0) * (count - 1) as f32;
            let first = (position as usize).min(count - 2);
            (first, position - first as f32)
        };
        let (row, down) = position(low.sqrt(), ROUGHNESS_ROWS);
        let (column, right) = position(strength, ANISOTROPY_COLUMNS);
        let block = |i: usize| {
            let (row, column) = (row + i / 2, column + i % 2);
            &**BLOCKS[row][column].get_or_init(|| Box::new(AlbedoBlock::new(row, column)))
        };
        Self {
            blocks: [block(0), block(1), block(2), block(3)],
            fraction: [down, right],
            swap_axes: ggx.alpha_y > ggx.alpha_x,
        }
    }

    fn interpolate(&self, of: impl Fn(&AlbedoBlock) -> f32) -> f32 {
        let [a, b, c, d] = self.blocks.map(of);
        let [down, right] = self.fraction;
        let (top, bottom) = (a + (b - a) * right, c + (d - c) * right);
        top + (bottom - top) * down
    }

    /// Albedo in a local direction for f0 = f90 = 1, and the part of this albedo that is proportional to f0.
    pub fn albedo_at(&self, direction: Vec3) -> (f32, f32) {
        let [x, y] = [direction.x * direction.x, direction.y * direction.y];
        let share = if x + y > 0.0 { x / (x + y) } else { 0.5 };
        let share = if self.swap_axes { 1.0 - share } else { share };
        let position = share * (AZIMUTH_STEPS - 1) as f32;
        let turn = (position as usize).min(AZIMUTH_STEPS - 2);
        let between = position - turn as f32;
        let of = |table: &[[f32; COSINE_STEPS]; AZIMUTH_STEPS]| {
            let [a, b] = [turn, turn + 1].map(|turn| interpolate(&table[turn], direction.z));
            a + (b - a) * between
        };
        (self.interpolate(|block| of(&block.all)), self.interpolate(|block| of(&block.f0)))
    }

    /// Cosine-weighted means over the hemisphere of both values of [`AnisotropicAlbedo::albedo_at`].
    pub fn mean_albedo(&self) -> (f32, f32) {
        (self.interpolate(|block| block.all_mean), self.interpolate(|block| block.f0_mean))
    }
}

impl AlbedoBlock {
    fn new(row: usize, column: usize) -> Self {
        let low = (row as f32 / (ROUGHNESS_ROWS - 1) as f32).powi(2).max(MIN_TABLE_ALPHA);
        let strength = column as f32 / (ANISOTROPY_COLUMNS - 1) as f32;
        let ggx = Ggx { alpha_x: low + (1.0 - low) * strength * strength, alpha_y: low };
        let mut block = Self {
            all: [[0.0; COSINE_STEPS]; AZIMUTH_STEPS],
            f0: [[0.0; COSINE_STEPS]; AZIMUTH_STEPS],
            all_mean: 0.0,
            f0_mean: 0.0,
        };
        for turn in 0..AZIMUTH_STEPS {
            let cos2 = turn as f32 / (AZIMUTH_STEPS - 1) as f32;
            for step in 0..COSINE_STEPS {
                let root = step as f32 / (COSINE_STEPS - 1) as f32;
                let cosine = (root * root).max(1e-4);
                let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
                let v = Vec3::new(sine * cos2.sqrt(), sine * (1.0 - cos2).sqrt(), cosine);
                (block.all[turn][step], block.f0[turn][step]) = albedo(&ggx, v);
            }
        }
        block.all_mean = hemisphere_mean_of(&block.all);
        block.f0_mean = hemisphere_mean_of(&block.f0);
        block
    }
}

/// Cosine-weighted mean over the hemisphere. Azimuths have equal weights, although the table is uniform in the square
/// of their cosine.
fn hemisphere_mean_of(table: &[[f32; COSINE_STEPS]; AZIMUTH_STEPS]) -> f32 {
    const AZIMUTHS: usize = 64;
    let mut weights = [0.0f64; AZIMUTH_STEPS];
    for i in 0..AZIMUTHS {
        let angle = (i as f64 + 0.5) / AZIMUTHS as f64 * std::f64::consts::FRAC_PI_2;
        let position = angle.cos().powi(2) * (AZIMUTH_STEPS - 1) as f64;
        let turn = (position as usize).min(AZIMUTH_STEPS - 2);
        weights[turn] += (turn as f64 + 1.0 - position) / AZIMUTHS as f64;
        weights[turn + 1] += (position - turn as f64) / AZIMUTHS as f64;
    }
    table.iter().zip(weights).map(|(row, weight)| weight * f64::from(hemisphere_mean(row))).sum::<f64>() as f32
}

fn albedo(ggx: &Ggx, v: Vec3) -> (f32, f32) {
    let (mut all, mut f0, mut points) = (0.0, 0.0, 0.0);
    for ring in 0..RADIAL_POINTS {
        // The rings are denser at both ends, where normals change direction quickly.
        let s = (ring as f32 + 0.5) / RADIAL_POINTS as f32;
        let (out, density) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        for turn in 0..ANGULAR_POINTS {
            points += f64::from(density);
            let h = ggx.sample_wm(v, [(turn as f32 + 0.5) / ANGULAR_POINTS as f32, out]);
            let l = 2.0 * v.dot(h) * h - v;
            if l.z > 0.0 {
                let seen = density * ggx.g_given_g1(v, l);
                all += f64::from(seen);
                f0 += f64::from(seen * schlick_weight(v.dot(h)));
            }
        }
    }
    ((all / points) as f32, (f0 / points) as f32)
}
