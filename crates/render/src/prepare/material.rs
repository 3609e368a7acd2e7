//! Materials with what is worth computing once.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use raycam_scene::Material;

use crate::bsdf::{Interface, Lobe, inside, interfaces, is_clear, is_frosted, is_glossy, plain};

#[derive(Debug)]
pub(crate) struct PreparedMaterial {
    pub material: Material,
    /// The specular lobe, where there is one.
    pub lobe: Option<Arc<Lobe>>,
    /// What [`plain`] says.
    pub plain: Option<f32>,
    /// What [`is_clear`] says.
    pub clear: bool,
    /// What [`is_glossy`] says.
    pub glossy: bool,
    /// What [`is_frosted`] says.
    pub frosted: bool,
    /// What [`inside`] says.
    pub inside: Option<Vec3>,
    /// What roughness loses where it refracts.
    pub interfaces: Vec<Interface>,
}

pub(crate) fn prepare_materials(materials: &[Material]) -> Vec<PreparedMaterial> {
    let mut lobes: HashMap<u32, Arc<Lobe>> = HashMap::new();
    let mut lobe = |material: &Material| {
        let shininess = Lobe::shininess(&material.reflectance)?;
        let known = lobes.entry(shininess.to_bits());
        Some(
            known
                .or_insert_with(|| Arc::new(Lobe::new(shininess)))
                .clone(),
        )
    };
    materials
        .iter()
        .map(|material| PreparedMaterial {
            material: material.clone(),
            lobe: lobe(material),
            plain: plain(material),
            clear: is_clear(material),
            glossy: is_glossy(material),
            frosted: is_frosted(material),
            inside: inside(material),
            interfaces: interfaces(material),
        })
        .collect()
}
