//! How much of the light a rough interface sends back in one reflection, and what it would with all the others.
//!
//! C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", 2017: a second lobe returns what one
//! reflection loses; it is reciprocal. Tables over cosine and roughness are made once, by quadrature.

use std::sync::LazyLock;

use glam::Vec3;

use crate::lobes::albedo_anisotropic::AnisotropicAlbedo;
use crate::lobes::fresnel::reflect;
use crate::lobes::ggx::Ggx;

/// Entries along the square root of the cosine, and along that of perceptual roughness: narrow lobes change fast.
pub(crate) const COSINE_STEPS: usize = 80;
pub(crate) const ROUGHNESS_ROWS: usize = 64;
/// Points of a quadrature, outwards and around.
const RADIAL_POINTS: u32 = 64;
const ANGULAR_POINTS: u32 = 16;

/// Entries of a table, and more: a power of two, so that no index needs to be checked.
const TABLE_ENTRIES: usize = (ROUGHNESS_ROWS * COSINE_STEPS).next_power_of_two();

/// Albedos at roughness and cosine: of an interface that reflects all, and the share of it that Schlick's approximation
/// multiplies by f0.
pub(crate) struct AlbedoTables {
    /// Row after row.
    entries: [[f32; 2]; TABLE_ENTRIES],
    /// Means over the cosine-weighed hemisphere.
    means: [[f32; 2]; ROUGHNESS_ROWS],
}

static ALBEDO_TABLES: LazyLock<Box<AlbedoTables>> = LazyLock::new(|| Box::new(AlbedoTables::new()));

/// The tables of interfaces that are as rough in all directions.
pub(crate) fn albedo_tables() -> &'static AlbedoTables {
    &ALBEDO_TABLES
}

/// Between which rows of the tables a roughness lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlbedoRow {
    row: u32,
    fraction: f32,
}

/// The albedos of one roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DirectionalAlbedo {
    Isotropic(AlbedoRow),
    Anisotropic(AnisotropicAlbedo),
}

/// Albedos of an interface that reflects `f0` to `f90`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Albedo {
    /// By one reflection.
    pub single_scatter: Vec3,
    /// By all the others.
    pub multi_scatter: Vec3,
}

/// The width of lobes that anisotropic tables begin with.
pub(crate) const MIN_TABLE_ALPHA: f32 = 1e-3;

impl AlbedoRow {
    #[inline(always)]
    pub fn new(ggx: &Ggx) -> Self {
        let (row, between) = roughness_row(ggx);
        Self {
            row: row as u32,
            fraction: between,
        }
    }

    /// What an interface that reflects all reflects at once at a cosine, and the share of it that Schlick multiplies by f0.
    #[inline(always)]
    pub fn albedo_at(self, tables: &AlbedoTables, cosine: f32) -> [f32; 2] {
        let (step, part) = table_position::<COSINE_STEPS>(cosine);
        let first = self.row as usize * COSINE_STEPS + step;
        let entry = |i: usize| tables.entries[(first + i) % TABLE_ENTRIES];
        let low = lerp_pair(entry(0), entry(1), part);
        lerp_pair(
            low,
            lerp_pair(entry(COSINE_STEPS), entry(COSINE_STEPS + 1), part),
            self.fraction,
        )
    }

    /// The same in the mean over the hemisphere.
    #[inline(always)]
    pub fn mean_albedo(self, tables: &AlbedoTables) -> [f32; 2] {
        let row = self.row as usize;
        let [low, high] = [row, row + 1].map(|row| tables.means[row % ROUGHNESS_ROWS]);
        lerp_pair(low, high, self.fraction)
    }
}

#[inline(always)]
fn lerp_pair(low: [f32; 2], high: [f32; 2], between: f32) -> [f32; 2] {
    let [a, b] = low;
    [a + (high[0] - a) * between, b + (high[1] - b) * between]
}

impl DirectionalAlbedo {
    pub fn new(ggx: &Ggx) -> Self {
        if ggx.is_isotropic() {
            Self::Isotropic(AlbedoRow::new(ggx))
        } else {
            Self::Anisotropic(AnisotropicAlbedo::new(ggx))
        }
    }

    /// [`AlbedoRow::albedo_at`], in coordinates with the normal along z.
    fn albedo_at(&self, direction: Vec3) -> [f32; 2] {
        match self {
            Self::Isotropic(rows) => rows.albedo_at(&ALBEDO_TABLES, direction.z),
            Self::Anisotropic(tables) => tables.albedo_at(direction).into(),
        }
    }

    /// [`AlbedoRow::mean`].
    fn mean_albedo(&self) -> [f32; 2] {
        match self {
            Self::Isotropic(rows) => rows.mean_albedo(&ALBEDO_TABLES),
            Self::Anisotropic(tables) => tables.mean_albedo().into(),
        }
    }

    /// What an interface that reflects all loses by reflecting once, in coordinates with the normal along z.
    pub fn energy_loss(&self, direction: Vec3) -> f32 {
        1.0 - self.albedo_at(direction)[0]
    }

    /// What it loses in the mean.
    pub fn mean_energy_loss(&self) -> f32 {
        1.0 - self.mean_albedo()[0]
    }

    /// [`multi_scatter_color`] at this roughness.
    pub fn multi_scatter_color(&self, ends: (Vec3, Vec3)) -> Vec3 {
        multi_scatter_color(ends, self.mean_albedo()[0])
    }

    pub fn albedo(&self, ends: (Vec3, Vec3), direction: Vec3) -> Albedo {
        Albedo::new(ends, self.albedo_at(direction), self.mean_albedo()[0])
    }

    pub fn albedo_mean(&self, ends: (Vec3, Vec3)) -> Albedo {
        Albedo::new(ends, self.mean_albedo(), self.mean_albedo()[0])
    }
}

/// The colour of all reflections but the first: what the interface reflects in the mean, again and again, where one that
/// reflects all keeps this share of light at once.
#[inline(always)]
pub(crate) fn multi_scatter_color((f0, f90): (Vec3, Vec3), kept: f32) -> Vec3 {
    let mean = f0 + (f90 - f0) / 21.0;
    mean * mean * kept / (Vec3::ONE - mean * (1.0 - kept))
}

impl Albedo {
    /// By what [`AlbedoRow::albedo_at`] says, and what is kept in the mean.
    #[inline(always)]
    pub fn new((f0, f90): (Vec3, Vec3), [all, of_f0]: [f32; 2], kept: f32) -> Self {
        Self {
            single_scatter: f0 * of_f0 + f90 * (all - of_f0),
            multi_scatter: multi_scatter_color((f0, f90), kept) * (1.0 - all),
        }
    }

    /// What the interface leaves for what is below.
    #[inline(always)]
    pub fn base_transmittance(&self) -> f32 {
        1.0 - (self.single_scatter + self.multi_scatter).max_element()
    }
}

/// Between the entries of a row over the square root of the cosine.
pub(crate) fn interpolate<const N: usize>(row: &[f32; N], cosine: f32) -> f32 {
    let (first, part) = table_position::<N>(cosine);
    row[first] + (row[first + 1] - row[first]) * part
}

/// The entry of a cosine, and how far it is on the way to the next.
#[inline(always)]
pub(crate) fn table_position<const N: usize>(cosine: f32) -> (usize, f32) {
    let position = cosine.clamp(0.0, 1.0).sqrt() * (N - 1) as f32;
    // By 32 bits: that is one instruction for many.
    let first = (position as i32).clamp(0, N as i32 - 2);
    (first as usize, position - first as f32)
}

impl AlbedoTables {
    fn new() -> Self {
        let mut tables = Self {
            entries: [[0.0; 2]; TABLE_ENTRIES],
            means: [[0.0; 2]; ROUGHNESS_ROWS],
        };
        // Rows do not know of each other: every core makes some.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let share = ROUGHNESS_ROWS.div_ceil(cores);
        let rows = &mut tables.entries[..ROUGHNESS_ROWS * COSINE_STEPS];
        let shares = rows
            .chunks_mut(share * COSINE_STEPS)
            .zip(tables.means.chunks_mut(share));
        std::thread::scope(|scope| {
            for (first, (entries, means)) in shares.enumerate() {
                scope.spawn(move || {
                    for (i, row) in entries.chunks_mut(COSINE_STEPS).enumerate() {
                        means[i] = fill_row(first * share + i, row);
                    }
                });
            }
        });
        tables
    }
}

/// The row of a roughness, and how far it is on the way to the next.
#[inline(always)]
pub(crate) fn roughness_row(ggx: &Ggx) -> (usize, f32) {
    table_position::<ROUGHNESS_ROWS>(ggx.roughness())
}

/// The roughness of a row.
pub(crate) fn ggx_of_row(row: usize) -> Ggx {
    Ggx::isotropic((row as f32 / (ROUGHNESS_ROWS - 1) as f32).powi(2))
}

/// The cosine of a column.
pub(crate) fn cosine_of(column: usize) -> f32 {
    let root = column as f32 / (COSINE_STEPS - 1) as f32;
    (root * root).max(1e-4)
}

/// Fills a row; returns its means.
fn fill_row(number: usize, row: &mut [[f32; 2]]) -> [f32; 2] {
    let ggx = ggx_of_row(number);
    let mut columns = [[0.0; COSINE_STEPS]; 2];
    for (column, entry) in row.iter_mut().enumerate() {
        *entry = albedo(&ggx, cosine_of(column));
        [columns[0][column], columns[1][column]] = *entry;
    }
    columns.map(|column| hemisphere_mean(&column))
}

/// The mean of values over the microfacets that a direction at a cosine sees, given that direction and their normal: by
/// so many points of a quadrature outwards and around.
pub(crate) fn over_visible_normals<const N: usize>(
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
            for (sum, value) in sums
                .iter_mut()
                .zip(values(v, ggx.sample_wm(v, [around, out])))
            {
                *sum += f64::from(density * value);
            }
            points += f64::from(density);
        }
    }
    sums.map(|sum| (sum / points) as f32)
}

/// The mean of a row over the hemisphere, weighed by the cosine: exact for what is linear in its root between entries.
/// The narrowest lobes lose light at grazing angles alone.
pub(crate) fn hemisphere_mean<const N: usize>(row: &[f32; N]) -> f32 {
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
pub(crate) fn schlick_weight(cosine: f32) -> f32 {
    1.0 - (1.0 - cosine).powi(5)
}

fn albedo(ggx: &Ggx, cosine: f32) -> [f32; 2] {
    if ggx.effectively_smooth() {
        return [1.0, schlick_weight(cosine)];
    }
    over_visible_normals(ggx, cosine, [RADIAL_POINTS, ANGULAR_POINTS], |v, h| {
        let seen = reflect(v, h).map_or(0.0, |l| ggx.g_given_g1(v, l));
        [seen, seen * schlick_weight(v.dot(h))]
    })
}
