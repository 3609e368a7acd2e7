//! Meshes: their primitives as one mesh with a material slot for each.

use std::collections::HashMap;
use std::sync::Arc;

use raycam_scene::animation::Shape;
use raycam_scene::{Material, Mesh, Model, Part};

use super::Builder;
use crate::error::FormatError;
use crate::gltf::skin_morph::Deformation;

/// What has been read so far, by index in the document.
#[derive(Default)]
pub(super) struct Meshes {
    known: HashMap<usize, Option<Placeable>>,
}

/// A mesh of the world and the materials of its slots.
#[derive(Clone)]
pub(super) struct Placeable {
    pub(super) mesh: usize,
    pub(super) materials: Vec<usize>,
    /// The primitive of the document of each material slot's first use, for variants.
    pub(super) primitives: Vec<usize>,
    /// What bends, where it does.
    pub(super) shape: Option<Arc<Shape>>,
}

impl Builder<'_, '_> {
    /// A mesh that `place` refers to; `None` where it has no triangles.
    pub(super) fn mesh(
        &mut self,
        place: &str,
        index: usize,
    ) -> Result<Option<Placeable>, FormatError> {
        if let Some(known) = self.meshes.known.get(&index) {
            return Ok(known.clone());
        }
        let document = self.document;
        let json = document.get(&document.root.meshes, index, place)?;
        if json.primitives.is_empty() {
            let message = format!("meshes[{index}].primitives: empty (EMPTY_ENTITY)");
            return Err(document.fault(message));
        }
        let (mut parts, mut bends, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
        for (i, primitive) in json.primitives.iter().enumerate() {
            let place = format!("meshes[{index}].primitives[{i}]");
            let part = document.part(&place, primitive, self.folder, &mut self.ledger)?;
            if let Some(part) = part {
                let material = self.material_index(&place, part.material)?;
                bends.push((part.mesh.vertices.len(), part.deformation));
                primitives.push(i);
                parts.push((part.mesh, material));
            }
        }
        let place = format!("meshes[{index}]");
        let placeable = match one(parts).map_err(|error| document.scene(&place, error))? {
            Some((mesh, materials)) => {
                mesh.validate()
                    .map_err(|error| document.scene(&place, error))?;
                let mesh = self.world.add_mesh(mesh);
                let shared = self.world.meshes[mesh].clone();
                let bends = Deformation::joined(&bends);
                Some(Placeable {
                    mesh,
                    materials,
                    primitives,
                    shape: bends.map(|bends| Arc::new(bends.shape(shared))),
                })
            }
            None => None,
        };
        self.meshes.known.insert(index, placeable.clone());
        Ok(placeable)
    }
}

/// All parts, each a mesh and its material, as one mesh with the materials of its slots.
fn one(
    mut parts: Vec<(Mesh, usize)>,
) -> Result<Option<(Mesh, Vec<usize>)>, raycam_scene::SceneError> {
    if parts.len() < 2 {
        return Ok(parts.pop().map(|(mesh, material)| (mesh, vec![material])));
    }
    // A slot for each primitive, even where materials are the same: variants may tell them apart.
    let materials: Vec<usize> = parts.iter().map(|(_, material)| *material).collect();
    let part = |(slot, (mesh, _)): (usize, (Mesh, usize))| Part {
        name: String::new(),
        mesh,
        materials: vec![slot],
    };
    let model = Model {
        parts: parts.into_iter().enumerate().map(part).collect(),
        // Only their number counts.
        materials: vec![Material::default(); materials.len()],
        ..Model::default()
    };
    let (mesh, _) = model.merged()?;
    Ok(Some((mesh, materials)))
}
