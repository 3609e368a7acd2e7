//! Transmittance of rough interfaces seen from inside. It determines the share of light that reaches the layers below.
//!
//! The transmittance falls to zero at the critical angle, within a few standard deviations of the
//! microfacets' slopes. No uniform grid resolves this transition for smooth surfaces, so the nodes of a row
//! are uniform in the inverse hyperbolic sine of the angle from the critical angle, in units of the
//! roughness. Rows then have similar shapes and can be interpolated node by node.

use std::f32::consts::FRAC_PI_2;
use std::sync::OnceLock;

use glam::Vec3;

use crate::lobes::albedo_grid::{ROUGHNESS_ROWS, ggx_of_row, mean_over_visible_normals, roughness_row};
use crate::lobes::fresnel::{reflect, refract, refracted_cosine, schlick_weight};
use crate::lobes::ggx::Ggx;

/// Number of nodes in a row.
const ANGLE_STEPS: usize = 96;
/// Quadrature points per table entry.
const RADIAL_POINTS: u32 = 128;
const ANGULAR_POINTS: u32 = 48;
/// Width of the transition at the critical angle, divided by the roughness `alpha`.
const TRANSITION_WIDTH: f32 = 0.7;

/// Table by roughness and angle: the part of a perfect mirror's single-scatter albedo that a dielectric
/// transmits, and the albedo of a single refraction.
#[derive(Debug)]
pub(crate) struct InternalTransmittanceTable {
    /// Index of refraction of the far side relative to the near side, below 1.
    eta: f32,
    rows: [OnceLock<Box<Row>>; ROUGHNESS_ROWS],
}

/// Values for one roughness: coefficients of 1, f0 and f90 in Schlick's approximation.
#[derive(Debug)]
struct Row {
    transmittance: [[f32; 3]; ANGLE_STEPS],
    /// Albedo of a single refraction. It differs from the transmittance because other microfacets block refracted light.
    refraction: [[f32; 3]; ANGLE_STEPS],
    /// Cosine-weighted mean of the transmittance.
    mean: [f32; 3],
}

/// The transmittance at one roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InternalTransmittance<'a> {
    rows: [&'a Row; 2],
    fraction: f32,
    grid: AngleGrid,
}

/// Maps positions from 0 to 1 to angles of incidence; the angles are dense around the critical angle.
#[derive(Clone, Copy, Debug)]
struct AngleGrid {
    critical: f32,
    width: f32,
    /// Inverse hyperbolic sines that correspond to the positions 0 and 1.
    ends: [f32; 2],
}

impl AngleGrid {
    fn new(eta: f32, ggx: &Ggx) -> Self {
        let (critical, width) = (eta.min(1.0).asin(), TRANSITION_WIDTH * ggx.roughness().powi(2).max(1e-4));
        Self { critical, width, ends: [-critical, FRAC_PI_2 - critical].map(|angle| (angle / width).asinh()) }
    }

    fn position(&self, cosine: f32) -> f32 {
        let [first, last] = self.ends;
        (((cosine.clamp(0.0, 1.0).acos() - self.critical) / self.width).asinh() - first) / (last - first)
    }

    /// Angle of incidence at a position, and its derivative with respect to the position.
    fn angle(&self, position: f64) -> (f64, f64) {
        let [first, last] = self.ends.map(f64::from);
        let (at, width) = (first + (last - first) * position, f64::from(self.width));
        (f64::from(self.critical) + width * at.sinh(), (last - first) * width * at.cosh())
    }
}

impl InternalTransmittanceTable {
    /// Creates an empty table. `eta` is the index of refraction of the far side relative to the near side.
    pub fn new(eta: f32) -> Self {
        Self { eta, rows: [const { OnceLock::new() }; ROUGHNESS_ROWS] }
    }

    pub fn at_roughness(&self, ggx: &Ggx) -> InternalTransmittance<'_> {
        let (low, fraction) = roughness_row(ggx);
        let row = |i: usize| &**self.rows[i].get_or_init(|| Box::new(self.row(i)));
        InternalTransmittance { rows: [row(low), row(low + 1)], fraction, grid: AngleGrid::new(self.eta, ggx) }
    }

    fn row(&self, row: usize) -> Row {
        let ggx = ggx_of_row(row);
        let grid = AngleGrid::new(self.eta, &ggx);
        let (mut transmittance, mut refraction) = ([[0.0; 3]; ANGLE_STEPS], [[0.0; 3]; ANGLE_STEPS]);
        for node in 0..ANGLE_STEPS {
            let (angle, _) = grid.angle(node as f64 / (ANGLE_STEPS - 1) as f64);
            [transmittance[node], refraction[node]] = self.transmitted(&ggx, (angle.cos() as f32).max(1e-4));
        }
        Row {
            mean: [0, 1, 2].map(|term| cosine_weighted_mean(&grid, &transmittance.map(|value| value[term]))),
            transmittance,
            refraction,
        }
    }

    /// Fraction of light that a perfect mirror with these microfacets reflects once and a dielectric transmits, and the
    /// albedo of a single refraction.
    fn transmitted(&self, ggx: &Ggx, cosine: f32) -> [[f32; 3]; 2] {
        let terms = |visible: f32, f0: f32| [visible, -visible * f0, -visible * (1.0 - f0)];
        if ggx.effectively_smooth() {
            return [refracted_cosine(cosine, self.eta).map_or([0.0; 3], |other| terms(1.0, schlick_weight(other))); 2];
        }
        let of = |v: Vec3, h: Vec3| {
            let Some(other) = refracted_cosine(v.dot(h), self.eta) else {
                return [0.0; 6];
            };
            let up = reflect(v, h).map_or(0.0, |l| ggx.g_given_g1(v, l));
            let down = refract(v, h, self.eta).map_or(0.0, |l| ggx.g_given_g1(v, Vec3::new(l.x, l.y, -l.z)));
            let f0 = schlick_weight(other);
            let ([a, b, c], [d, e, f]) = (terms(up, f0), terms(down, f0));
            [a, b, c, d, e, f]
        };
        let [a, b, c, d, e, f] = mean_over_visible_normals(ggx, cosine, [RADIAL_POINTS, ANGULAR_POINTS], of);
        [[a, b, c], [d, e, f]]
    }
}

/// The cosine-weighted mean over the hemisphere of a function that is linear between nodes.
fn cosine_weighted_mean(grid: &AngleGrid, nodes: &[f32; ANGLE_STEPS]) -> f32 {
    let offset = 0.15f64.sqrt();
    let points = [(0.5 - offset, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + offset, 5.0 / 18.0)];
    let step = 1.0 / (ANGLE_STEPS - 1) as f64;
    let cell = |(i, pair): (usize, &[f32])| {
        let (low, high) = (f64::from(pair[0]), f64::from(pair[1]));
        let part = |(at, weight): (f64, f64)| {
            let (angle, derivative) = grid.angle((i as f64 + at) * step);
            weight * (low + (high - low) * at) * (2.0 * angle).sin() * derivative
        };
        points.map(part).iter().sum::<f64>() * step
    };
    nodes.windows(2).enumerate().map(cell).sum::<f64>() as f32
}

impl InternalTransmittance<'_> {
    /// The fraction of light at a cosine that a perfect mirror with the same microfacets reflects once and
    /// this interface transmits.
    pub fn at(&self, cosine: f32, f0_f90: (Vec3, Vec3)) -> Vec3 {
        self.interpolate_at(cosine, f0_f90, |row| &row.transmittance)
    }

    /// Albedo of a single refraction, for light at a cosine.
    pub fn refraction_at(&self, cosine: f32, f0_f90: (Vec3, Vec3)) -> Vec3 {
        self.interpolate_at(cosine, f0_f90, |row| &row.refraction)
    }

    fn interpolate_at(
        &self,
        cosine: f32,
        f0_f90: (Vec3, Vec3),
        nodes: impl Fn(&Row) -> &[[f32; 3]; ANGLE_STEPS],
    ) -> Vec3 {
        let position = self.grid.position(cosine) * (ANGLE_STEPS - 1) as f32;
        let first = (position as usize).min(ANGLE_STEPS - 2);
        let part = position - first as f32;
        self.interpolate(f0_f90, |row, term| {
            let (low, high) = (nodes(row)[first][term], nodes(row)[first + 1][term]);
            low + (high - low) * part
        })
    }

    /// The cosine-weighted mean of [`InternalTransmittance::at`].
    pub fn mean(&self, f0_f90: (Vec3, Vec3)) -> Vec3 {
        self.interpolate(f0_f90, |row, term| row.mean[term])
    }

    fn interpolate(&self, (f0, f90): (Vec3, Vec3), of: impl Fn(&Row, usize) -> f32) -> Vec3 {
        let [low, high] = self.rows;
        let term = |term| {
            let low = of(low, term);
            low + (of(high, term) - low) * self.fraction
        };
        Vec3::splat(term(0)) + f0 * term(1) + f90 * term(2)
    }
}
