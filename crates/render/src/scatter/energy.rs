//! How much of the light a rough interface sends back in one reflection, and what it would with all the others.
//!
//! C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", 2017: a second lobe returns what one
//! reflection loses; it is reciprocal. Tables over cosine and roughness are made once, by quadrature.

use std::sync::LazyLock;

use glam::Vec3;

use super::anisotropic::Anisotropic;
use super::fresnel::reflect;
use super::ggx::Ggx;

/// Entries along the square root of the cosine, and along that of perceptual roughness: narrow lobes change fast.
pub(super) const STEPS: usize = 80;
pub(super) const ROWS: usize = 64;
/// Points of a quadrature, outwards and around.
const RINGS: u32 = 64;
const TURNS: u32 = 16;

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
pub(crate) enum Energy {
    Isotropic { row: usize, between: f32 },
    Anisotropic(Anisotropic),
}

/// Albedos of an interface that reflects `f0` to `f90`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Albedo {
    /// By one reflection.
    pub single: Vec3,
    /// By all the others.
    pub multiple: Vec3,
}

/// The width of lobes that anisotropic tables begin with.
pub(super) const MIRROR: f32 = 1e-3;

impl Energy {
    pub fn new(ggx: &Ggx) -> Self {
        if !ggx.is_isotropic() {
            return Self::Anisotropic(Anisotropic::new(ggx));
        }
        let (row, between) = row_of(ggx);
        Self::Isotropic { row, between }
    }

    /// What an interface that reflects all reflects at once, and the share of it that Schlick multiplies by f0.
    fn at(&self, direction: Vec3) -> (f32, f32) {
        match *self {
            Self::Isotropic { row, between } => {
                let of = |table: &[[f32; STEPS]; ROWS]| {
                    let low = along(&table[row], direction.z);
                    low + (along(&table[row + 1], direction.z) - low) * between
                };
                (of(&TABLES.all), of(&TABLES.f0))
            }
            Self::Anisotropic(ref tables) => tables.at(direction),
        }
    }

    /// The same in the mean over the hemisphere.
    fn mean(&self) -> (f32, f32) {
        match *self {
            Self::Isotropic { row, between } => {
                let of = |table: &[f32; ROWS]| table[row] + (table[row + 1] - table[row]) * between;
                (of(&TABLES.all_mean), of(&TABLES.f0_mean))
            }
            Self::Anisotropic(ref tables) => tables.mean(),
        }
    }

    /// What an interface that reflects all loses by reflecting once, in coordinates with the normal along z.
    pub fn lost(&self, direction: Vec3) -> f32 {
        1.0 - self.at(direction).0
    }

    /// What it loses in the mean.
    pub fn lost_mean(&self) -> f32 {
        1.0 - self.mean().0
    }

    /// The colour of all reflections but the first: what the interface reflects in the mean, again and again.
    pub fn multiple(&self, (f0, f90): (Vec3, Vec3)) -> Vec3 {
        let mean = f0 + (f90 - f0) / 21.0;
        let kept = self.mean().0;
        mean * mean * kept / (Vec3::ONE - mean * (1.0 - kept))
    }

    pub fn albedo(&self, ends: (Vec3, Vec3), direction: Vec3) -> Albedo {
        self.of(ends, self.at(direction))
    }

    pub fn albedo_mean(&self, ends: (Vec3, Vec3)) -> Albedo {
        self.of(ends, self.mean())
    }

    fn of(&self, (f0, f90): (Vec3, Vec3), (all, of_f0): (f32, f32)) -> Albedo {
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
        // Rows do not know of each other: every core makes some.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let share = ROWS.div_ceil(cores);
        let rows = tables
            .all
            .chunks_mut(share)
            .zip(tables.f0.chunks_mut(share));
        std::thread::scope(|scope| {
            for (first, (all, f0)) in rows.enumerate() {
                scope.spawn(move || {
                    for (i, (all, f0)) in all.iter_mut().zip(f0).enumerate() {
                        fill(first * share + i, all, f0);
                    }
                });
            }
        });
        tables.all_mean = tables.all.map(|row| mean(&row));
        tables.f0_mean = tables.f0.map(|row| mean(&row));
        tables
    }
}

/// The row of a roughness, and how far it is on the way to the next.
pub(super) fn row_of(ggx: &Ggx) -> (usize, f32) {
    let position = ggx.roughness().clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f32;
    let row = (position as usize).min(ROWS - 2);
    (row, position - row as f32)
}

/// The roughness of a row.
pub(super) fn of_row(row: usize) -> Ggx {
    Ggx::isotropic((row as f32 / (ROWS - 1) as f32).powi(2))
}

/// The cosine of a column.
pub(super) fn cosine_of(column: usize) -> f32 {
    let root = column as f32 / (STEPS - 1) as f32;
    (root * root).max(1e-4)
}

fn fill(row: usize, all: &mut [f32; STEPS], f0: &mut [f32; STEPS]) {
    let ggx = of_row(row);
    for (column, (all, f0)) in all.iter_mut().zip(f0).enumerate() {
        (*all, *f0) = albedo(&ggx, cosine_of(column));
    }
}

/// The mean of values over the microfacets that a direction at a cosine sees, given that direction and their normal: by
/// so many points of a quadrature outwards and around.
pub(super) fn over_visible_normals<const N: usize>(
    ggx: &Ggx,
    cosine: f32,
    [rings, turns]: [u32; 2],
    values: impl Fn(Vec3, Vec3) -> [f32; N],
) -> [f32; N] {
    let v = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let (mut sums, mut points) = ([0.0f64; N], 0.0);
    for ring in 0..rings {
        // Denser at both ends, where normals turn fast.
        let s = (ring as f32 + 0.5) / rings as f32;
        let (out, density) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        for turn in 0..turns {
            // Both sides of the plane of incidence are alike.
            let around = (turn as f32 + 0.5) / (2 * turns) as f32;
            for (sum, value) in sums.iter_mut().zip(values(v, ggx.sample(v, [around, out]))) {
                *sum += f64::from(density * value);
            }
            points += f64::from(density);
        }
    }
    sums.map(|sum| (sum / points) as f32)
}

/// The mean of a row over the hemisphere, weighed by the cosine: exact for what is linear in its root between entries.
/// The narrowest lobes lose light at grazing angles alone.
pub(super) fn mean<const N: usize>(row: &[f32; N]) -> f32 {
    // Gauss and Legendre with three points is exact to the fifth power; this is the fourth.
    let points = [(0.5 - 0.15f64.sqrt(), 5.0 / 18.0), (0.5, 8.0 / 18.0)];
    let [left, middle] = points;
    let points = [left, middle, (1.0 - left.0, left.1)];
    let width = 1.0 / (N - 1) as f64;
    let cell = |i: usize| {
        let (low, high) = (f64::from(row[i]), f64::from(row[i + 1]));
        let part = |(at, weight): (f64, f64)| {
            let root = (i as f64 + at) * width;
            weight * 4.0 * root.powi(3) * (low + (high - low) * at)
        };
        points.map(part).iter().sum::<f64>() * width
    };
    (0..N - 1).map(cell).sum::<f64>() as f32
}

/// What Schlick's approximation multiplies f0 by.
pub(super) fn schlick_weight(cosine: f32) -> f32 {
    1.0 - (1.0 - cosine).powi(5)
}

fn albedo(ggx: &Ggx, cosine: f32) -> (f32, f32) {
    if ggx.is_smooth() {
        return (1.0, schlick_weight(cosine));
    }
    let [all, f0] = over_visible_normals(ggx, cosine, [RINGS, TURNS], |v, h| {
        let seen = reflect(v, h).map_or(0.0, |l| ggx.visible_also(v, l));
        [seen, seen * schlick_weight(v.dot(h))]
    });
    (all, f0)
}
