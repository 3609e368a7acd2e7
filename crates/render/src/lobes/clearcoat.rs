//! A clear coat with an index of refraction of 1.5 on top of the other layers (`KHR_materials_clearcoat`).
//!
//! The coat dims the layers below by its albedo for the viewing direction, as in Cycles and glTF. This conserves energy
//! for any normals of coat and base, but is not reciprocal.

use glam::Vec3;

use crate::lobes::albedo_tables::{Albedo, AlbedoRow, AlbedoTables};
use crate::lobes::fresnel::schlick;
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::shading_frame::ShadingFrame;

/// An isotropic coat that covers a fraction `weight` of the surface and has its own normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clearcoat {
    pub weight: f32,
    pub ggx: Ggx,
    pub frame: ShadingFrame,
}

/// Sampled direction into which a coat reflects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClearcoatSample {
    pub is_valid: bool,
    /// Unit direction towards the light, in world coordinates.
    pub wi: Vec3,
    /// True for a smooth coat, whose samples have `weight` but no density.
    pub is_specular: bool,
    /// Reflectance of a smooth coat divided by the probability of sampling the coat.
    pub weight: f32,
}

/// Reflectance at normal and at grazing incidence, for an index of refraction of 1.5.
const F0_F90: (Vec3, Vec3) = (Vec3::splat(0.04), Vec3::ONE);

impl Clearcoat {
    /// Direction towards the viewer in the coat's local frame.
    #[inline(always)]
    pub fn wo(&self) -> Vec3 {
        self.frame.to_local(self.frame.wo)
    }

    /// Directional albedo of the coat at a cosine.
    #[inline(always)]
    pub fn albedo(&self, tables: &AlbedoTables, cosine: f32) -> f32 {
        let row = AlbedoRow::new(&self.ggx);
        let (albedo, [mean, _]) = (row.albedo_at(tables, cosine.max(0.0)), row.mean_albedo(tables));
        self.weight * Albedo::new(F0_F90, albedo, mean).single_scatter.x
    }

    /// Reflectance times the cosine of the world direction `wi`, equal in all colours, and the density of sampling
    /// `wi`. `wo` is in the coat's local frame.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let wi = self.frame.to_local(wi);
        let facets = MicrofacetEval::reflection(&self.ggx, wo, wi);
        let (f0, f90) = F0_F90;
        let value = schlick(f0, f90, facets.cosine).x * facets.weight * self.weight;
        let is_lit = !self.ggx.effectively_smooth() & (wi.z > 0.0) & (wo.z > 0.0);
        if is_lit { (value, facets.pdf) } else { (0.0, 0.0) }
    }

    /// Samples a direction. The coat is sampled with `probability`; `wo` is in the coat's local frame.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, random: [f32; 2], probability: f32) -> ClearcoatSample {
        let is_specular = self.ggx.effectively_smooth();
        let wm = self.ggx.sample_wm(wo, random);
        let reflected = 2.0 * wo.dot(wm) * wm - wo;
        let wi = if is_specular { Vec3::new(-wo.x, -wo.y, wo.z) } else { reflected };
        let direction = self.frame.to_world(wi);
        let is_above = self.frame.geometric.dot(direction) > 0.0;
        let (f0, f90) = F0_F90;
        ClearcoatSample {
            is_valid: if is_specular { is_above } else { wi.z > 0.0 },
            wi: direction,
            is_specular,
            weight: schlick(f0, f90, wo.z).x * (self.weight / probability),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::tests::{over_the_hemisphere, seen_from};
    use crate::lobes::albedo_tables::albedo_tables;

    #[test]
    fn albedo_equals_the_integrated_reflectance() {
        // Layers below receive the light that the coat does not reflect.
        for (roughness, cosine) in [(0.5f32, 0.9f32), (0.5, 0.5), (0.8, 0.7), (0.8, 0.3)] {
            let view = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let coat = Clearcoat { weight: 0.6, ggx: Ggx::isotropic(roughness), frame: seen_from(view) };
            let sent = over_the_hemisphere(|light| coat.eval(coat.wo(), light).0);
            let ratio = sent / f64::from(coat.albedo(albedo_tables(), cosine));
            assert!((ratio - 1.0).abs() < 4e-3, "{roughness}, {cosine}: {ratio}");
        }
    }
}
