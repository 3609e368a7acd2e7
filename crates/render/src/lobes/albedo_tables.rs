//! Directional albedo of rough interfaces, and the energy that single scattering loses.
//!
//! C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", 2017: a second, reciprocal lobe returns
//! the energy that one microfacet reflection loses. The tables over cosine and roughness are computed once, by
//! quadrature.
//!
//! Table values are pairs: the albedo of an interface with f0 = f90 = 1, and the part of this albedo that is
//! proportional to f0 in Schlick's approximation.

use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

use glam::Vec3;

use crate::lobes::albedo_anisotropic::AnisotropicAlbedo;
use crate::lobes::albedo_grid::{
    COSINE_STEPS, ROUGHNESS_ROWS, cosine_of_column, ggx_of_row, hemisphere_mean, mean_over_visible_normals,
    roughness_row, table_position,
};
use crate::lobes::fresnel::{reflect, schlick_weight};
use crate::lobes::ggx::Ggx;

/// Quadrature points per table entry.
const RADIAL_POINTS: u32 = 64;
const ANGULAR_POINTS: u32 = 16;

/// Entries of a table, rounded up to a power of two so that a mask replaces the bounds check.
const TABLE_ENTRIES: usize = (ROUGHNESS_ROWS * COSINE_STEPS).next_power_of_two();

/// Pairs of values by roughness and cosine, and the pairs' cosine-weighted means over the hemisphere.
pub(crate) struct AlbedoTables {
    entries: [[f32; 2]; TABLE_ENTRIES],
    means: [[f32; 2]; ROUGHNESS_ROWS],
}

static ALBEDO_TABLES: LazyLock<Box<AlbedoTables>> = LazyLock::new(|| Box::new(AlbedoTables::new()));

/// The tables of isotropic interfaces.
pub(crate) fn albedo_tables() -> &'static AlbedoTables {
    &ALBEDO_TABLES
}

/// Row of the isotropic tables, and a position between this row and the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlbedoRow {
    row: u32,
    fraction: f32,
}

/// Directional albedo at one roughness, as a function of direction.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DirectionalAlbedo {
    Isotropic(AlbedoRow),
    Anisotropic(AnisotropicAlbedo),
}

/// Directional albedo of an interface whose reflectance ranges from `f0` to `f90`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Albedo {
    /// Albedo of light that is reflected once.
    pub single_scatter: Vec3,
    /// Albedo of light that is reflected more than once.
    pub multi_scatter: Vec3,
}

impl AlbedoRow {
    #[inline(always)]
    pub fn new(ggx: &Ggx) -> Self {
        let (row, fraction) = roughness_row(ggx);
        Self { row: row as u32, fraction }
    }

    /// The pair of table values, interpolated at a cosine.
    #[inline(always)]
    pub fn albedo_at(self, tables: &AlbedoTables, cosine: f32) -> [f32; 2] {
        let (step, part) = table_position::<COSINE_STEPS>(cosine);
        let first = self.row as usize * COSINE_STEPS + step;
        let entry = |i: usize| tables.entries[(first + i) % TABLE_ENTRIES];
        let low = lerp_pair(entry(0), entry(1), part);
        let high = lerp_pair(entry(COSINE_STEPS), entry(COSINE_STEPS + 1), part);
        lerp_pair(low, high, self.fraction)
    }

    /// The cosine-weighted mean of the pair of table values over the hemisphere.
    #[inline(always)]
    pub fn mean_albedo(self, tables: &AlbedoTables) -> [f32; 2] {
        let row = self.row as usize;
        let [low, high] = [row, row + 1].map(|row| tables.means[row % ROUGHNESS_ROWS]);
        lerp_pair(low, high, self.fraction)
    }
}

#[inline(always)]
fn lerp_pair(low: [f32; 2], high: [f32; 2], fraction: f32) -> [f32; 2] {
    let [a, b] = low;
    [a + (high[0] - a) * fraction, b + (high[1] - b) * fraction]
}

impl DirectionalAlbedo {
    pub fn new(ggx: &Ggx) -> Self {
        if ggx.is_isotropic() {
            Self::Isotropic(AlbedoRow::new(ggx))
        } else {
            Self::Anisotropic(AnisotropicAlbedo::new(ggx))
        }
    }

    /// The pair of table values in a local direction.
    fn albedo_at(&self, direction: Vec3) -> [f32; 2] {
        match self {
            Self::Isotropic(row) => row.albedo_at(&ALBEDO_TABLES, direction.z),
            Self::Anisotropic(tables) => tables.albedo_at(direction).into(),
        }
    }

    /// The cosine-weighted mean of the pair of table values over the hemisphere.
    fn mean_albedo(&self) -> [f32; 2] {
        match self {
            Self::Isotropic(row) => row.mean_albedo(&ALBEDO_TABLES),
            Self::Anisotropic(tables) => tables.mean_albedo().into(),
        }
    }

    /// Fraction of light in a local direction that single reflection loses for f0 = f90 = 1.
    pub fn energy_loss(&self, direction: Vec3) -> f32 {
        1.0 - self.albedo_at(direction)[0]
    }

    /// The cosine-weighted mean of [`DirectionalAlbedo::energy_loss`].
    pub fn mean_energy_loss(&self) -> f32 {
        1.0 - self.mean_albedo()[0]
    }

    /// [`multi_scatter_color`] of an interface of this roughness with these reflectances.
    pub fn multi_scatter_color(&self, f0_f90: (Vec3, Vec3)) -> Vec3 {
        multi_scatter_color(f0_f90, self.mean_albedo()[0])
    }

    /// The albedo in a local direction, for these reflectances.
    pub fn albedo(&self, f0_f90: (Vec3, Vec3), direction: Vec3) -> Albedo {
        Albedo::new(f0_f90, self.albedo_at(direction), self.mean_albedo()[0])
    }

    /// The cosine-weighted mean of [`DirectionalAlbedo::albedo`].
    pub fn albedo_mean(&self, f0_f90: (Vec3, Vec3)) -> Albedo {
        Albedo::new(f0_f90, self.mean_albedo(), self.mean_albedo()[0])
    }
}

/// Colour of light that is reflected more than once, for an interface whose mean albedo for f0 = f90 = 1 is
/// `mean_albedo`.
#[inline(always)]
pub(crate) fn multi_scatter_color((f0, f90): (Vec3, Vec3), mean_albedo: f32) -> Vec3 {
    let mean = f0 + (f90 - f0) / 21.0;
    mean * mean * mean_albedo / (Vec3::ONE - mean * (1.0 - mean_albedo))
}

/// Value of the lobe of light that is reflected more than once, times the cosine of `wi`; computed from the lobe's
/// colour, the energy losses in both directions, and the mean energy loss.
#[inline(always)]
pub(crate) fn multi_scatter_lobe(color: Vec3, losses: [f32; 2], mean: f32, cosine: f32) -> Vec3 {
    let [wo, wi] = losses;
    let returned = wo * wi / mean;
    let returned = if mean > 1e-6 { returned } else { 0.0 };
    color * (returned * cosine * FRAC_1_PI)
}

impl Albedo {
    /// Computes the albedo from a pair of table values and the mean of the pair's first value.
    #[inline(always)]
    pub fn new((f0, f90): (Vec3, Vec3), [all, of_f0]: [f32; 2], mean_albedo: f32) -> Self {
        Self {
            single_scatter: f0 * of_f0 + f90 * (all - of_f0),
            multi_scatter: multi_scatter_color((f0, f90), mean_albedo) * (1.0 - all),
        }
    }

    /// Smallest fraction of light, over the colours, that the interface leaves for the layers below.
    #[inline(always)]
    pub fn base_transmittance(&self) -> f32 {
        1.0 - (self.single_scatter + self.multi_scatter).max_element()
    }
}

impl AlbedoTables {
    fn new() -> Self {
        let mut tables = Self { entries: [[0.0; 2]; TABLE_ENTRIES], means: [[0.0; 2]; ROUGHNESS_ROWS] };
        // Rows are independent, so every thread fills a part of the rows.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let share = ROUGHNESS_ROWS.div_ceil(cores);
        let rows = &mut tables.entries[..ROUGHNESS_ROWS * COSINE_STEPS];
        let shares = rows.chunks_mut(share * COSINE_STEPS).zip(tables.means.chunks_mut(share));
        let fill_rows = |first: usize, entries: &mut [[f32; 2]], means: &mut [[f32; 2]]| {
            for (i, row) in entries.chunks_mut(COSINE_STEPS).enumerate() {
                means[i] = fill_row(first + i, row);
            }
        };
        if cores == 1 {
            shares.enumerate().for_each(|(i, (entries, means))| fill_rows(i * share, entries, means));
        } else {
            std::thread::scope(|scope| {
                for (i, (entries, means)) in shares.enumerate() {
                    scope.spawn(move || fill_rows(i * share, entries, means));
                }
            });
        }
        tables
    }
}

/// Fills a row and returns its means.
fn fill_row(index: usize, row: &mut [[f32; 2]]) -> [f32; 2] {
    let ggx = ggx_of_row(index);
    let mut columns = [[0.0; COSINE_STEPS]; 2];
    for (column, entry) in row.iter_mut().enumerate() {
        *entry = albedo_pair(&ggx, cosine_of_column(column));
        [columns[0][column], columns[1][column]] = *entry;
    }
    columns.map(|column| hemisphere_mean(&column))
}

fn albedo_pair(ggx: &Ggx, cosine: f32) -> [f32; 2] {
    if ggx.effectively_smooth() {
        return [1.0, schlick_weight(cosine)];
    }
    let points = [RADIAL_POINTS, ANGULAR_POINTS];
    mean_over_visible_normals(ggx, cosine, points, |wo, wm| {
        let visible = reflect(wo, wm).map_or(0.0, |wi| ggx.g_given_g1(wo, wi));
        [visible, visible * schlick_weight(wo.dot(wm))]
    })
}
