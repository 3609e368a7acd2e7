//! The albedos of interfaces that are rougher along one direction: tables made where they are first needed.

use std::sync::OnceLock;

use glam::Vec3;

use crate::lobes::albedo_tables::{MIRROR, along, mean, schlick_weight};
use crate::lobes::ggx::Ggx;

/// Entries along the perceptual roughness of the smoother direction, along anisotropy, along the square root of the
/// cosine, and along the square of the cosine of the azimuth.
const ROWS: usize = 32;
const COLUMNS: usize = 24;
const STEPS: usize = 48;
const TURNS: usize = 9;
/// Points of a quadrature, outwards and around.
const OUT: u32 = 48;
const AROUND: u32 = 48;

/// Albedos as in the isotropic tables, for one roughness and anisotropy.
#[derive(Debug)]
struct Block {
    all: [[f32; STEPS]; TURNS],
    f0: [[f32; STEPS]; TURNS],
    all_mean: f32,
    f0_mean: f32,
}

static BLOCKS: [[OnceLock<Box<Block>>; COLUMNS]; ROWS] =
    [const { [const { OnceLock::new() }; COLUMNS] }; ROWS];

/// Between which four blocks a roughness lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anisotropic {
    blocks: [&'static Block; 4],
    between: [f32; 2],
    /// Whether the bitangent is the rougher direction.
    turned: bool,
}

impl Anisotropic {
    pub fn new(ggx: &Ggx) -> Self {
        let (low, high) = (ggx.x.min(ggx.y).max(MIRROR), ggx.x.max(ggx.y).min(1.0));
        let strength = ((high - low) / (1.0 - low)).max(0.0).sqrt();
        let place = |value: f32, count: usize| {
            let position = value.clamp(0.0, 1.0) * (count - 1) as f32;
            let first = (position as usize).min(count - 2);
            (first, position - first as f32)
        };
        let (row, down) = place(low.sqrt(), ROWS);
        let (column, right) = place(strength, COLUMNS);
        let block = |i: usize| {
            let (row, column) = (row + i / 2, column + i % 2);
            &**BLOCKS[row][column].get_or_init(|| Box::new(Block::new(row, column)))
        };
        Self {
            blocks: [block(0), block(1), block(2), block(3)],
            between: [down, right],
            turned: ggx.y > ggx.x,
        }
    }

    fn mix(&self, of: impl Fn(&Block) -> f32) -> f32 {
        let [a, b, c, d] = self.blocks.map(of);
        let [down, right] = self.between;
        let (top, bottom) = (a + (b - a) * right, c + (d - c) * right);
        top + (bottom - top) * down
    }

    /// What an interface that reflects all reflects at once, and the share of it that Schlick multiplies by f0.
    pub fn at(&self, direction: Vec3) -> (f32, f32) {
        let [x, y] = [direction.x * direction.x, direction.y * direction.y];
        let share = if x + y > 0.0 { x / (x + y) } else { 0.5 };
        let share = if self.turned { 1.0 - share } else { share };
        let position = share * (TURNS - 1) as f32;
        let turn = (position as usize).min(TURNS - 2);
        let between = position - turn as f32;
        let of = |table: &[[f32; STEPS]; TURNS]| {
            let [a, b] = [turn, turn + 1].map(|turn| along(&table[turn], direction.z));
            a + (b - a) * between
        };
        (
            self.mix(|block| of(&block.all)),
            self.mix(|block| of(&block.f0)),
        )
    }

    /// The same in the mean over the hemisphere.
    pub fn mean(&self) -> (f32, f32) {
        (
            self.mix(|block| block.all_mean),
            self.mix(|block| block.f0_mean),
        )
    }
}

impl Block {
    fn new(row: usize, column: usize) -> Self {
        let low = (row as f32 / (ROWS - 1) as f32).powi(2).max(MIRROR);
        let strength = column as f32 / (COLUMNS - 1) as f32;
        let ggx = Ggx {
            x: low + (1.0 - low) * strength * strength,
            y: low,
        };
        let mut block = Self {
            all: [[0.0; STEPS]; TURNS],
            f0: [[0.0; STEPS]; TURNS],
            all_mean: 0.0,
            f0_mean: 0.0,
        };
        for turn in 0..TURNS {
            let cos2 = turn as f32 / (TURNS - 1) as f32;
            for step in 0..STEPS {
                let root = step as f32 / (STEPS - 1) as f32;
                let cosine = (root * root).max(1e-4);
                let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
                let v = Vec3::new(sine * cos2.sqrt(), sine * (1.0 - cos2).sqrt(), cosine);
                (block.all[turn][step], block.f0[turn][step]) = albedo(&ggx, v);
            }
        }
        block.all_mean = mean_of(&block.all);
        block.f0_mean = mean_of(&block.f0);
        block
    }
}

/// Over the hemisphere, weighed by the cosine; all azimuths alike, whose squared cosine is not spread evenly.
fn mean_of(table: &[[f32; STEPS]; TURNS]) -> f32 {
    const AZIMUTHS: usize = 64;
    let mut weights = [0.0f64; TURNS];
    for i in 0..AZIMUTHS {
        let angle = (i as f64 + 0.5) / AZIMUTHS as f64 * std::f64::consts::FRAC_PI_2;
        let position = angle.cos().powi(2) * (TURNS - 1) as f64;
        let turn = (position as usize).min(TURNS - 2);
        weights[turn] += (turn as f64 + 1.0 - position) / AZIMUTHS as f64;
        weights[turn + 1] += (position - turn as f64) / AZIMUTHS as f64;
    }
    table
        .iter()
        .zip(weights)
        .map(|(row, weight)| weight * f64::from(mean(row)))
        .sum::<f64>() as f32
}

fn albedo(ggx: &Ggx, v: Vec3) -> (f32, f32) {
    let (mut all, mut f0, mut points) = (0.0, 0.0, 0.0);
    for ring in 0..OUT {
        // Denser at both ends, where normals turn fast.
        let s = (ring as f32 + 0.5) / OUT as f32;
        let (out, density) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        for turn in 0..AROUND {
            points += f64::from(density);
            let h = ggx.sample(v, [(turn as f32 + 0.5) / AROUND as f32, out]);
            let l = 2.0 * v.dot(h) * h - v;
            if l.z > 0.0 {
                let seen = density * ggx.visible_also(v, l);
                all += f64::from(seen);
                f0 += f64::from(seen * schlick_weight(v.dot(h)));
            }
        }
    }
    ((all / points) as f32, (f0 / points) as f32)
}
