//! Validation of a world before it is prepared.

use raycam_scene::{MaterialModel, Object, World, counted};

use crate::error::RenderError;

/// Checks that every index is in range and that materials and poses are valid. Meshes, textures and lights are
/// validated when they are first prepared.
pub(crate) fn validate(world: &World) -> Result<(), RenderError> {
    let fail = |message: String| Err(RenderError::world(message));
    let invalid = |error: raycam_scene::SceneError| RenderError::world(error);
    for (i, material) in world.materials.iter().enumerate() {
        material.validate().map_err(invalid)?;
        if let Some(slot) = material.texture_slots().into_iter().find(|slot| slot.texture >= world.textures.len()) {
            return fail(format!(
                "material {i} refers to texture {}, but the world has {}",
                slot.texture,
                counted(world.textures.len(), "texture")
            ));
        }
    }
    for Object { name, mesh: index, materials, world_from_mesh, .. } in &world.objects {
        let Some(mesh) = world.meshes.get(*index) else {
            return fail(format!(
                "object {name:?} refers to mesh {index}, but the world has {}",
                counted(world.meshes.len(), "mesh")
            ));
        };
        let slots = mesh.slot_count().max(1);
        if materials.len() < slots {
            let given = materials.len();
            return fail(format!("object {name:?} has {}; its mesh requires {slots}", counted(given, "material")));
        }
        if let Some(material) = materials.iter().find(|&&material| material >= world.materials.len()) {
            let count = world.materials.len();
            return fail(format!(
                "object {name:?} refers to material {material}, but the world has {}",
                counted(count, "material")
            ));
        }
        let is_boundary = |&&material: &&usize| world.materials[material].model == MaterialModel::Boundary;
        let borders = materials.iter().filter(is_boundary).count();
        if borders != 0 && borders != materials.len() {
            return fail(format!(
                "object {name:?}: {borders} of its {} materials have the type \"boundary\"; use this type for all \
                 materials of an object, or for none",
                materials.len()
            ));
        }
        if !(world_from_mesh.is_finite() && world_from_mesh.inverse().is_finite()) {
            return fail(format!(
                "object {name:?} has the transform {world_from_mesh:?}; expected an invertible transform"
            ));
        }
    }
    Ok(())
}
