//! Materials with precomputed data.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use raycam_scene::Material;

use crate::bsdf::specular::is_specular_material;
use crate::bsdf::{
    dielectric_tables, diffuse_only, interior_absorption, is_rough_reflective, is_rough_refractive,
};
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::phong_lobe::PhongLobe;

/// Material and the data that depends on it alone.
#[derive(Debug)]
pub(crate) struct PreparedMaterial {
    pub material: Material,
    /// The specular lobe, where there is one.
    pub phong_lobe: Option<Arc<PhongLobe>>,
    /// What [`diffuse_only`] says.
    pub diffuse_factor: Option<f32>,
    /// What [`is_specular_material`] says.
    pub clear: bool,
    /// What [`is_rough_reflective`] says.
    pub glossy: bool,
    /// What [`is_rough_refractive`] says.
    pub frosted: bool,
    /// What [`interior_absorption`] says.
    pub absorption: Option<Vec3>,
    /// What roughness loses where it refracts.
    pub dielectric_tables: Vec<DielectricAlbedo>,
}

/// Prepares all materials; equal Phong lobes are shared.
pub(crate) fn prepare_materials(materials: &[Material]) -> Vec<PreparedMaterial> {
    let mut lobes: HashMap<u32, Arc<PhongLobe>> = HashMap::new();
    let mut lobe = |material: &Material| {
        let shininess = PhongLobe::shininess(&material.model)?;
        let known = lobes.entry(shininess.to_bits());
        Some(
            known
                .or_insert_with(|| Arc::new(PhongLobe::new(shininess)))
                .clone(),
        )
    };
    materials
        .iter()
        .map(|material| PreparedMaterial {
            material: material.clone(),
            phong_lobe: lobe(material),
            diffuse_factor: diffuse_only(material),
            clear: is_specular_material(material),
            glossy: is_rough_reflective(material),
            frosted: is_rough_refractive(material),
            absorption: interior_absorption(material),
            dielectric_tables: dielectric_tables(material),
        })
        .collect()
}
