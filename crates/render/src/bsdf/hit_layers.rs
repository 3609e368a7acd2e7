//! Layers of the material at a hit, created according to the material's model.

use raycam_scene::MaterialModel;

use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::{conductor, dielectric, principled};

impl<'a> MaterialHit<'a> {
    /// Layer stack of the material at the hit; `None` if the material's model has no layers.
    #[inline]
    pub fn layer_stack(&self) -> Option<LayerStack<'a>> {
        let base = self.base_color();
        match &self.material.material.model {
            MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Boundary => None,
            MaterialModel::Metal(metal) => Some(conductor::layer_stack(metal, base)),
            MaterialModel::Glass(glass) => {
                let eta = dielectric::eta(glass, self);
                Some(dielectric::layer_stack(glass, eta, base, self.dielectric_albedo()))
            }
            MaterialModel::Principled(p) => Some(principled::layer_stack(p, self, base)),
        }
    }
}
