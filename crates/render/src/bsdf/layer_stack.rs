//! Layers of a material at a surface point; they do not depend on the viewing direction.

use glam::Vec3;

use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;
use crate::lobes::sheen::Sheen;

/// Layers of a material at a surface point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerStack<'a> {
    /// Reflectance of the interface.
    pub fresnel: Fresnel,
    /// Reflectance by which the interface dims the layers below.
    pub base_fresnel: Fresnel,
    pub ggx: Ggx,
    /// Albedo and transmittance of the diffuse base.
    pub diffuse: Vec3,
    pub diffuse_transmission: Vec3,
    /// Colour of refracted light.
    pub transmission: Vec3,
    /// Index of refraction of the far side relative to the viewer's side; 1 for thin walls.
    pub eta: f32,
    /// Albedo table of the interface of a rough solid.
    pub dielectric_albedo: Option<&'a DielectricAlbedo>,
    pub coat: Option<Clearcoat>,
    pub sheen: Option<Sheen>,
}

impl LayerStack<'_> {
    /// True for an interface without any other layer.
    pub fn is_interface_only(&self) -> bool {
        self.diffuse == Vec3::ZERO
            && self.diffuse_transmission == Vec3::ZERO
            && self.coat.is_none()
            && self.sheen.is_none()
    }
}
