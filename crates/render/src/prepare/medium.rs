//! Coefficients of a homogeneous medium inside of a material.

use glam::Vec3;
use raycam_scene::Material;

use crate::lobes::classify::interior_absorption;

/// A homogeneous medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    /// Extinction of each colour, per metre.
    pub extinction: Vec3,
    /// Fraction of the extinguished light that is scattered.
    pub albedo: Vec3,
    /// Mean cosine of scattering angles.
    pub g: f32,
}

impl Medium {
    /// The medium inside of a material; `None` if the medium neither absorbs nor scatters light.
    pub fn inside_of(material: &Material) -> Option<Self> {
        let absorption = interior_absorption(material)?;
        let (absorption, scattering, g) = match &material.medium {
            Some(medium) => (medium.absorption.into(), medium.scattering.into(), medium.g),
            None => (absorption, Vec3::ZERO, 0.0),
        };
        let extinction = absorption + scattering;
        let albedo = Vec3::select(extinction.cmpgt(Vec3::ZERO), scattering / extinction, Vec3::ZERO);
        (extinction != Vec3::ZERO).then_some(Self { extinction, albedo, g })
    }
}
