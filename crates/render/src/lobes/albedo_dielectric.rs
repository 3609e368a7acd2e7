//! Albedo of rough dielectric interfaces, and the energy that single scattering loses.
//!
//! Tables over cosine and roughness for both sides of an index of refraction. A row is computed by quadrature when its
//! roughness is first used.

use std::sync::OnceLock;

use glam::Vec3;

use crate::lobes::albedo_grid::{
    COSINE_STEPS, ROUGHNESS_ROWS, cosine_of_column, ggx_of_row, hemisphere_mean, mean_over_visible_normals,
    roughness_row, table_position,
};
use crate::lobes::albedo_internal::{InternalTransmittance, InternalTransmittanceTable};
use crate::lobes::fresnel::{Fresnel, reflect, refract, refracted_cosine, schlick_weight};
use crate::lobes::ggx::Ggx;

/// Quadrature points per table entry.
const RADIAL_POINTS: u32 = 128;
const ANGULAR_POINTS: u32 = 48;

/// Reflectance formula of an interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FresnelModel {
    /// Fresnel's equations.
    Exact,
    /// Schlick's approximation, for any f0 and f90.
    Schlick,
}

/// Albedo tables of an interface with one index of refraction, by roughness.
#[derive(Debug)]
pub(crate) struct DielectricAlbedo {
    ior: f32,
    fresnel_model: FresnelModel,
    rows: [OnceLock<Box<DielectricAlbedoRow>>; ROUGHNESS_ROWS],
    /// Transmittance of the interface for light from the denser side.
    internal_transmittance: InternalTransmittanceTable,
}

/// Albedo at one roughness, for light from outside and from inside.
#[derive(Debug)]
struct DielectricAlbedoRow([SideAlbedo; 2]);

/// Albedos and mean loss for light from one side: coefficients of 1, f0 and f90, because every albedo is linear in f0
/// and f90.
#[derive(Debug)]
struct SideAlbedo {
    /// For each cosine: albedo of a single reflection and of a single refraction.
    albedo: [[[f32; 3]; 2]; COSINE_STEPS],
    /// Cosine-weighted mean of the fraction of light that is neither reflected nor refracted.
    mean_loss: [f32; 3],
}

/// Albedo and energy loss at one roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnergyLoss<'a> {
    rows: [&'a DielectricAlbedoRow; 2],
    fraction: f32,
    fresnel_model: FresnelModel,
}

impl DielectricAlbedo {
    /// Creates empty tables. `ior` is the index of refraction of the inside relative to the outside.
    pub fn new(ior: f32, curve: FresnelModel) -> Self {
        let internal_transmittance = InternalTransmittanceTable::new(ior.min(1.0 / ior));
        Self { ior, fresnel_model: curve, rows: [const { OnceLock::new() }; ROUGHNESS_ROWS], internal_transmittance }
    }

    /// True if this table belongs to an interface with this relative index of refraction.
    pub fn matches_eta(&self, eta: f32) -> bool {
        eta == self.ior || eta == 1.0 / self.ior
    }

    pub(crate) fn at_roughness(&self, ggx: &Ggx) -> EnergyLoss<'_> {
        let (low, between) = roughness_row(ggx);
        let row = |i: usize| &**self.rows[i].get_or_init(|| Box::new(self.row(i)));
        EnergyLoss { rows: [row(low), row(low + 1)], fraction: between, fresnel_model: self.fresnel_model }
    }

    /// Transmittance of the interface at one roughness, for light from the denser side.
    pub(crate) fn internal_transmittance(&self, ggx: &Ggx) -> InternalTransmittance<'_> {
        self.internal_transmittance.at_roughness(ggx)
    }

    fn row(&self, row: usize) -> DielectricAlbedoRow {
        let ggx = ggx_of_row(row);
        DielectricAlbedoRow([self.ior, 1.0 / self.ior].map(|eta| {
            let mut kept = [[[0.0; 3]; 2]; COSINE_STEPS];
            for (column, kept) in kept.iter_mut().enumerate() {
                *kept = self.side_albedo(&ggx, eta, cosine_of_column(column));
            }
            let [reflected, refracted] =
                [0, 1].map(|part| [0, 1, 2].map(|term| hemisphere_mean(&kept.map(|parts| parts[part][term]))));
            let kept_mean = |term: usize| reflected[term] + refracted[term];
            SideAlbedo { mean_loss: [1.0 - kept_mean(0), -kept_mean(1), -kept_mean(2)], albedo: kept }
        }))
    }

    /// Albedos of a single reflection and of a single refraction at a cosine, as coefficients of 1, f0 and f90.
    fn side_albedo(&self, ggx: &Ggx, eta: f32, cosine: f32) -> [[f32; 3]; 2] {
        if ggx.effectively_smooth() {
            return self.facet_albedo(cosine, eta, 1.0, 1.0);
        }
        let kept = mean_over_visible_normals(ggx, cosine, [RADIAL_POINTS, ANGULAR_POINTS], |v, h| {
            let up = reflect(v, h).map_or(0.0, |l| ggx.g_given_g1(v, l));
            let down = refract(v, h, eta).map_or(0.0, |l| ggx.g_given_g1(v, Vec3::new(l.x, l.y, -l.z)));
            let [[a, b, c], [d, e, f]] = self.facet_albedo(v.dot(h), eta, up, down);
            [a, b, c, d, e, f]
        });
        let [a, b, c, d, e, f] = kept;
        [[a, b, c], [d, e, f]]
    }

    /// Reflectance and transmittance of a microfacet, as coefficients of 1, f0 and f90. `up` is the fraction
    /// of the reflected light that leaves the surface, `down` the fraction of the refracted light.
    fn facet_albedo(&self, cosine: f32, eta: f32, up: f32, down: f32) -> [[f32; 3]; 2] {
        let Some(other) = refracted_cosine(cosine, eta) else {
            return [[up, 0.0, 0.0], [0.0; 3]];
        };
        match self.fresnel_model {
            FresnelModel::Exact => {
                let reflected = Fresnel::Dielectric(eta).reflectance(cosine).x;
                let refracted = 1.0 - reflected;
                [[up * reflected, 0.0, 0.0], [down * refracted, 0.0, 0.0]]
            }
            FresnelModel::Schlick => {
                let f0 = schlick_weight(if eta < 1.0 { other } else { cosine });
                let f90 = 1.0 - f0;
                [[0.0, up * f0, up * f90], [down, -down * f0, -down * f90]]
            }
        }
    }
}

impl EnergyLoss<'_> {
    /// The albedo of a single reflection and of a single refraction, for light from one side at a cosine.
    #[inline(always)]
    pub fn albedo(&self, inside: bool, cosine: f32, ends: (Vec3, Vec3)) -> [Vec3; 2] {
        let (first, part) = table_position::<COSINE_STEPS>(cosine);
        // `map` is not used, because the compiler may not inline it.
        let of = |which: usize| {
            self.interpolate(ends, |row, term| {
                let kept = &row.0[usize::from(inside)].albedo;
                let (low, high) = (kept[first][which][term], kept[first + 1][which][term]);
                low + (high - low) * part
            })
        };
        [of(0), of(1)]
    }

    /// The cosine-weighted mean of the fraction of light from one side that single scattering loses.
    #[inline(always)]
    pub fn mean_loss(&self, inside: bool, ends: (Vec3, Vec3)) -> Vec3 {
        self.interpolate(ends, |row, term| row.0[usize::from(inside)].mean_loss[term])
    }

    #[inline(always)]
    fn interpolate(&self, (f0, f90): (Vec3, Vec3), of: impl Fn(&DielectricAlbedoRow, usize) -> f32) -> Vec3 {
        let [low, high] = self.rows;
        let term = |term| {
            let low = of(low, term);
            low + (of(high, term) - low) * self.fraction
        };
        match self.fresnel_model {
            // The coefficients of f0 and f90 are zero.
            FresnelModel::Exact => Vec3::splat(term(0)),
            FresnelModel::Schlick => Vec3::splat(term(0)) + f0 * term(1) + f90 * term(2),
        }
    }
}
