//! Grids and quadratures shared by the albedo tables.
//!
//! Tables are uniform in the square root of the cosine and in the square root of perceptual roughness,
//! because the albedo of narrow lobes changes quickly where the cosine or the roughness is near 0.

use glam::Vec3;

use crate::lobes::ggx::Ggx;

/// Numbers of entries along the square root of the cosine and along the square root of perceptual roughness.
pub(crate) const COSINE_STEPS: usize = 80;
pub(crate) const ROUGHNESS_ROWS: usize = 64;

/// Width `alpha` of the narrowest distribution in the anisotropic tables.
pub(crate) const MIN_TABLE_ALPHA: f32 = 1e-3;

/// Interpolated value of a table row at a cosine.
pub(crate) fn interpolate<const N: usize>(row: &[f32; N], cosine: f32) -> f32 {
    let (first, part) = table_position::<N>(cosine);
    row[first] + (row[first + 1] - row[first]) * part
}

/// Index of the entry at or below a cosine, and the cosine's position between this entry and the next, from 0 to 1.
#[inline(always)]
pub(crate) fn table_position<const N: usize>(cosine: f32) -> (usize, f32) {
    let position = cosine.clamp(0.0, 1.0).sqrt() * (N - 1) as f32;
    // The conversion to 32 bits is a single vector instruction.
    let first = (position as i32).clamp(0, N as i32 - 2);
    (first as usize, position - first as f32)
}

/// Index of the row at or below a roughness, and the roughness's position between this row and the next, from 0 to 1.
#[inline(always)]
pub(crate) fn roughness_row(ggx: &Ggx) -> (usize, f32) {
    table_position::<ROUGHNESS_ROWS>(ggx.roughness())
}

/// Microfacet distribution that belongs to a table row.
pub(crate) fn ggx_of_row(row: usize) -> Ggx {
    Ggx::isotropic((row as f32 / (ROUGHNESS_ROWS - 1) as f32).powi(2))
}

/// Cosine that belongs to a table column.
pub(crate) fn cosine_of_column(column: usize) -> f32 {
    let root = column as f32 / (COSINE_STEPS - 1) as f32;
    (root * root).max(1e-4)
}

/// Means of functions of `wo` and a microfacet normal, over the microfacets visible from `wo`. `cosine` is
/// the cosine of `wo`; `radial` and `angular` are the quadrature's numbers of points.
pub(crate) fn mean_over_visible_normals<const N: usize>(
    ggx: &Ggx,
    cosine: f32,
    [radial, angular]: [u32; 2],
    values: impl Fn(Vec3, Vec3) -> [f32; N],
) -> [f32; N] {
    let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let (mut sums, mut points) = ([0.0f64; N], 0.0);
    for ring in 0..radial {
        // The rings are denser at both ends, where normals change direction quickly.
        let s = (ring as f32 + 0.5) / radial as f32;
        let (out, density) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        for turn in 0..angular {
            // Half of the azimuths are sufficient, because the plane of incidence is a plane of symmetry.
            let around = (turn as f32 + 0.5) / (2 * angular) as f32;
            let wm = ggx.sample_wm(wo, [around, out]);
            for (sum, value) in sums.iter_mut().zip(values(wo, wm)) {
                *sum += f64::from(density * value);
            }
            points += f64::from(density);
        }
    }
    sums.map(|sum| (sum / points) as f32)
}

/// The cosine-weighted mean of a row over the hemisphere: exact for a row that is linear in the root of the cosine.
pub(crate) fn hemisphere_mean<const N: usize>(row: &[f32; N]) -> f32 {
    // Three-point Gauss-Legendre quadrature is exact for polynomials up to degree 5; the integrand has degree
    // 4.
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
