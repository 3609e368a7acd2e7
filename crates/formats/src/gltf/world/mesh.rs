//! Imported meshes: their primitives as one mesh with a material slot for each.

use std::sync::Arc;

use raycam_scene::{ErrorCode, Material, Mesh, MeshFile, MeshPart};

use crate::error::Result;
use crate::gltf::mesh::primitive::PrimitiveReader;
use crate::gltf::mesh::skin_morph::SkinMorph;
use crate::gltf::world::builder::{Builder, ImportedMesh};

impl Builder<'_, '_> {
    /// Returns the mesh with this index, which is written at the position `place` of the document; `None` if
    /// the mesh has no triangles.
    pub(crate) fn mesh(&mut self, place: &str, index: usize) -> Result<Option<ImportedMesh>> {
        if let Some(known) = self.meshes.known.get(&index) {
            return Ok(known.clone());
        }
        let document = self.document;
        let json = document.get(&document.root.meshes, index, place, "meshes")?;
        if json.primitives.is_empty() {
            return Err(
                document.fault(ErrorCode::MissingValue, format!("meshes[{index}].primitives: empty (EMPTY_ENTITY)"))
            );
        }
        let (mut parts, mut bends, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
        for (i, primitive) in json.primitives.iter().enumerate() {
            let place = format!("meshes[{index}].primitives[{i}]");
            let part = PrimitiveReader {
                document,
                place: &place,
                primitive,
                assets: self.assets,
                diagnostics: &mut self.diagnostics,
            }
            .read()?;
            if let Some(part) = part {
                let material = self.material_index(&place, part.material);
                let material = self.or_omitted(&format!("{place}.material"), "the material", material)?;
                let material = material.map_or_else(|| self.material_index(&place, None), Ok)?;
                bends.push((part.mesh.vertices.len(), part.skin_morph));
                primitives.push(i);
                parts.push((part.mesh, material));
            }
        }
        let place = format!("meshes[{index}]");
        let imported = match merge_primitives(parts).map_err(|error| document.scene(&place, error))? {
            Some((mesh, materials)) => {
                mesh.validate().map_err(|error| document.scene(&place, error))?;
                let mesh = self.world.add_mesh(mesh);
                let shared = self.world.meshes[mesh].clone();
                let bends = SkinMorph::concat(&bends);
                Some(ImportedMesh {
                    mesh,
                    materials,
                    primitives,
                    shape: bends.map(|bends| Arc::new(bends.shape(shared))),
                })
            }
            None => None,
        };
        self.meshes.known.insert(index, imported.clone());
        Ok(imported)
    }
}

/// Joins all parts, each a mesh and its material, into one mesh with the materials of its slots.
fn merge_primitives(mut parts: Vec<(Mesh, usize)>) -> Result<Option<(Mesh, Vec<usize>)>, raycam_scene::SceneError> {
    if parts.len() < 2 {
        return Ok(parts.pop().map(|(mesh, material)| (mesh, vec![material])));
    }
    // Each primitive has its own slot, even if materials are equal, because variants may assign different materials.
    let materials: Vec<usize> = parts.iter().map(|(_, material)| *material).collect();
    let part =
        |(slot, (mesh, _)): (usize, (Mesh, usize))| MeshPart { name: String::new(), mesh, materials: vec![slot] };
    let model = MeshFile {
        parts: parts.into_iter().enumerate().map(part).collect(),
        // `as_single_mesh` needs only the number of materials, so defaults are sufficient.
        materials: vec![Material::default(); materials.len()],
        ..MeshFile::default()
    };
    let (mesh, _) = model.as_single_mesh()?;
    Ok(Some((mesh, materials)))
}
