//! Which clear matter fills closed bodies: light from elsewhere meets their border, however it comes.

use glam::DVec3;
use raycam_scene::Alpha;

use crate::prepare::instance::PreparedInstance;
use crate::prepare::material::PreparedMaterial;

/// For each material a box, scene-local, around all bodies that it fills; `None` where it is not clear, or a mesh of it
/// leaves open where its inside ends, or lets light through by its opacity.
pub(crate) fn closed_dielectric_bounds(
    objects: &[PreparedInstance],
    materials: &[PreparedMaterial],
    origin: DVec3,
) -> Vec<Option<[DVec3; 2]>> {
    let mut bodies: Vec<_> = materials
        .iter()
        .map(|material| {
            let inside = material.absorption.is_some();
            inside.then_some([DVec3::INFINITY, DVec3::NEG_INFINITY])
        })
        .collect();
    let opaque = |&material: &usize| materials[material].material.alpha == Alpha::Opaque;
    for object in objects {
        for &material in &object.materials {
            if let Some([lower, upper]) = bodies[material] {
                let [l, u] = object.bounds();
                let around = [lower.min(l - origin), upper.max(u - origin)];
                let shut = object.materials.iter().all(opaque) && object.mesh.is_watertight();
                bodies[material] = shut.then_some(around);
            }
        }
    }
    bodies
}
