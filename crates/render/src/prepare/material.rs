//! Materials with precomputed data.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use raycam_scene::{Alpha, Material};

use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::classify::{BatchKind, dielectric_tables, interior_absorption, is_straight, reflects_only};
use crate::lobes::phong_lobe::PhongLobe;
use crate::prepare::medium::Medium;

/// A material, and the data that depends only on the material.
#[derive(Clone, Debug)]
pub(crate) struct PreparedMaterial {
    pub material: Material,
    /// The specular lobe, if present.
    pub phong_lobe: Option<Arc<PhongLobe>>,
    /// Kind of the batched BSDF that evaluates the material's hits.
    pub kind: BatchKind,
    /// True if light passes straight through the material's surface: a smooth wall without an interior.
    pub is_straight: bool,
    /// True if the material transmits no light: light passes its surface only where the opacity is below 1.
    pub reflects_only: bool,
    /// The medium inside, in worlds with media.
    pub medium: Option<Medium>,
    /// Absorption per metre of the material's interior, if it has an interior.
    pub absorption: Option<Vec3>,
    /// Albedo tables of the material's interface, if the interface refracts.
    pub dielectric_tables: Arc<[DielectricAlbedo]>,
}

impl PreparedMaterial {
    /// True if the material is a pure Lambertian reflector, whose samples may be guided.
    pub fn is_diffuse(&self) -> bool {
        matches!(self.kind, BatchKind::Diffuse(_))
    }

    /// True if shadow rays may pass the material's surface.
    pub fn is_transparent(&self) -> bool {
        self.material.alpha != Alpha::Opaque || self.is_straight
    }
}

/// Prepares all materials. Equal Phong lobes are shared, as is the data of `known` materials with the same index.
pub(crate) fn prepare_materials(
    materials: &[Material],
    known: &Arc<Vec<PreparedMaterial>>,
) -> Arc<Vec<PreparedMaterial>> {
    if materials.iter().eq(known.iter().map(|known| &known.material)) {
        return known.clone();
    }
    let lobes = known.iter().filter_map(|known| known.phong_lobe.clone());
    let mut lobes: HashMap<u32, Arc<PhongLobe>> = lobes.map(|lobe| (lobe.exponent().to_bits(), lobe)).collect();
    let mut lobe = |material: &Material| {
        let shininess = PhongLobe::shininess(&material.model)?;
        let known = lobes.entry(shininess.to_bits());
        Some(known.or_insert_with(|| Arc::new(PhongLobe::new(shininess))).clone())
    };
    let prepared = materials.iter().enumerate().map(|(number, material)| match known.get(number) {
        Some(known) if known.material == *material => known.clone(),
        _ => PreparedMaterial {
            material: material.clone(),
            phong_lobe: lobe(material),
            kind: BatchKind::from_material(material),
            is_straight: is_straight(material),
            reflects_only: reflects_only(material),
            medium: Medium::inside_of(material),
            absorption: interior_absorption(material),
            dielectric_tables: dielectric_tables(material).into(),
        },
    });
    Arc::new(prepared.collect())
}
