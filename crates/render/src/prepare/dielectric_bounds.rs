//! Bounds of closed dielectric bodies. Light from outside must cross the body's surface.

use glam::DVec3;
use raycam_scene::Alpha;

use crate::prepare::instance::PreparedInstance;
use crate::prepare::material::PreparedMaterial;

/// For each material: the scene-local box of all bodies that it fills; `None` if the material has no interior, or fills
/// a mesh that is open or not opaque.
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
    for object in objects.iter().filter(|object| object.is_visible || object.is_boundary) {
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
