//! How much of the light a rough interface sends back in one reflection, and what it would with all the others.
//!
//! C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", 2017: a second lobe returns what one
//! reflection loses; it is reciprocal. Tables over cosine and roughness are made once, by quadrature.

use std::sync::LazyLock;

use glam::Vec3;

use super::ggx::Ggx;

/// Entries along the square root of the cosine, and along perceptual roughness.
const STEPS: usize = 64;
const ROWS: usize = 48;
/// Points of a quadrature, outwards and around.
const RINGS: u32 = 64;
const TURNS: u32 = 20;

/// Albedos at roughness and cosine: of an interface that reflects all, and the share of it that Schlick's approximation
/// multiplies by f0.
struct Tables {
    all: [[f32; STEPS]; ROWS],
    f0: [[f32; STEPS]; ROWS],
    /// Means over the cosine-weighed hemisphere.
    all_mean: [f32; ROWS],
    f0_mean: [f32; ROWS],
}

static TABLES: LazyLock<Box<Tables>> = LazyLock::new(|| Box::new(Tables::new()));

/// The albedos of one roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energy {
    row: usize,
    between: f32,
}

/// Albedos of an interface that reflects `f0` to `f90`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Albedo {
    /// By one reflection.
    pub single: Vec3,
    /// By all the others.
    pub multiple: Vec3,
}

impl Energy {
    pub fn new(roughness: f32) -> Self {
        let position = roughness.clamp(0.0, 1.0) * (ROWS - 1) as f32;
        let row = (position as usize).min(ROWS - 2);
        Self {
            row,
            between: position - row as f32,
        }
    }

    fn at(&self, table: &[[f32; STEPS]; ROWS], cosine: f32) -> f32 {
        let low = along(&table[self.row], cosine);
        low + (along(&table[self.row + 1], cosine) - low) * self.between
    }

    fn mean(&self, table: &[f32; ROWS]) -> f32 {
        table[self.row] + (table[self.row + 1] - table[self.row]) * self.between
    }

    /// What an interface that reflects all loses by reflecting once.
    pub fn lost(&self, cosine: f32) -> f32 {
        1.0 - self.at(&TABLES.all, cosine)
    }

    /// What it loses in the mean.
    pub fn lost_mean(&self) -> f32 {
        1.0 - self.mean(&TABLES.all_mean)
    }

    /// The colour of all reflections but the first: what the interface reflects in the mean, again and again.
    pub fn multiple(&self, (f0, f90): (Vec3, Vec3)) -> Vec3 {
        let mean = f0 + (f90 - f0) / 21.0;
        let kept = self.mean(&TABLES.all_mean);
        mean * mean * kept / (Vec3::ONE - mean * (1.0 - kept))
    }

    pub fn albedo(&self, (f0, f90): (Vec3, Vec3), cosine: f32) -> Albedo {
        let (all, of_f0) = (self.at(&TABLES.all, cosine), self.at(&TABLES.f0, cosine));
        Albedo {
            single: f0 * of_f0 + f90 * (all - of_f0),
            multiple: self.multiple((f0, f90)) * (1.0 - all),
        }
    }

    pub fn albedo_mean(&self, (f0, f90): (Vec3, Vec3)) -> Albedo {
        let (all, of_f0) = (self.mean(&TABLES.all_mean), self.mean(&TABLES.f0_mean));
        Albedo {
            single: f0 * of_f0 + f90 * (all - of_f0),
            multiple: self.multiple((f0, f90)) * (1.0 - all),
        }
    }
}

/// Between the entries of a row over the square root of the cosine.
pub(super) fn along<const N: usize>(row: &[f32; N], cosine: f32) -> f32 {
    let position = cosine.clamp(0.0, 1.0).sqrt() * (N - 1) as f32;
    let first = (position as usize).min(N - 2);
    row[first] + (row[first + 1] - row[first]) * (position - first as f32)
}

impl Tables {
    fn new() -> Self {
        let mut tables = Self {
            all: [[0.0; STEPS]; ROWS],
            f0: [[0.0; STEPS]; ROWS],
            all_mean: [0.0; ROWS],
            f0_mean: [0.0; ROWS],
        };
        for row in 0..ROWS {
            let ggx = Ggx::isotropic(row as f32 / (ROWS - 1) as f32);
            for column in 0..STEPS {
                let root = column as f32 / (STEPS - 1) as f32;
                let (all, f0) = albedo(&ggx, (root * root).max(1e-4));
                tables.all[row][column] = all;
                tables.f0[row][column] = f0;
            }
            tables.all_mean[row] = mean(&tables.all[row]);
            tables.f0_mean[row] = mean(&tables.f0[row]);
        }
        tables
    }
}

/// The mean of a row over the hemisphere, weighed by the cosine.
fn mean(row: &[f32; STEPS]) -> f32 {
    const PIECES: usize = 1024;
    let at = |i: usize| {
        let cosine = (i as f32 + 0.5) / PIECES as f32;
        f64::from(2.0 * cosine * along(row, cosine))
    };
    ((0..PIECES).map(at).sum::<f64>() / PIECES as f64) as f32
}

fn albedo(ggx: &Ggx, cosine: f32) -> (f32, f32) {
    let weight = |cosine: f32| 1.0 - (1.0 - cosine).powi(5);
    if ggx.is_smooth() {
        return (1.0, weight(cosine));
    }
    let v = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let (mut all, mut f0) = (0.0, 0.0);
    let mut points = 0.0;
    for ring in 0..RINGS {
        // Denser at both ends, where normals turn fast.
        let s = (ring as f32 + 0.5) / RINGS as f32;
        let (out, density) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        for turn in 0..TURNS {
            // Both sides of the plane of incidence are alike.
            let around = (turn as f32 + 0.5) / (2 * TURNS) as f32;
            points += f64::from(density);
            let h = ggx.sample(v, [around, out]);
            let l = 2.0 * v.dot(h) * h - v;
            if l.z > 0.0 {
                let seen = density * ggx.visible_also(v, l);
                all += f64::from(seen);
                f0 += f64::from(seen * weight(v.dot(h)));
            }
        }
    }
    ((all / points) as f32, (f0 / points) as f32)
}
