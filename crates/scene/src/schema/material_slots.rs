//! Changes of the materials of an object's slots.

use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::AssetLoader;
use crate::notice::Notice;
use crate::schema::build_failure::BuildFailure;
use crate::schema::build_object::{GEOMETRY, PLACEMENT, SHAPES};
use crate::schema::keys::{Keys, by_key};
use crate::schema::spec::object::{KEYS, ObjectSpec};
use crate::texture::Texture;

/// Maximum number of slots that an error lists.
const MAX_LISTED: usize = 20;

/// Images that a description adds to a world, and the notices about these images.
type AddedTextures = (Vec<Texture>, Vec<Notice>);

impl ObjectSpec {
    /// Changes the materials of an object's slots as described: all materials by the object's own keys, then the
    /// materials of single slots by `slots`. The result is the images of the description, whose indices in the world
    /// start at `next`.
    ///
    /// # Errors
    /// Errors of files, of keys, and of slots that do not exist.
    pub(super) fn change_materials<F: AssetLoader>(
        &self,
        materials: &mut [Material],
        mesh: &Mesh,
        next: usize,
        keys: &Keys<KEYS>,
        files: &mut F,
    ) -> Result<AddedTextures, BuildFailure<F::Error>> {
        let (mut textures, bindings, mut notices) = self.read_textures(mesh, next, files)?;
        self.apply_material_all(materials, &bindings, keys)?;
        let mut changed: Vec<(usize, &str)> = Vec::new();
        for (slot, spec) in self.slots.iter().flatten() {
            let in_slot = |failure: BuildFailure<F::Error>| failure.in_context(&format!("slots.{slot}"));
            let numbers = find_slots(slot, materials).map_err(|error| in_slot(error.into()))?;
            if let Some((number, other)) = changed.iter().find(|(number, _)| numbers.contains(number)) {
                let message = format!("slot {number} is also changed by {other:?}; merge both tables");
                return Err(in_slot(SceneError::schema(ErrorCode::ConflictingValues, "", message).into()));
            }
            let mut chosen: Vec<Material> = numbers.iter().map(|&number| materials[number].clone()).collect();
            let first = next + textures.len();
            let (more, noted) = spec.change_slots(&mut chosen, mesh, first, files).map_err(in_slot)?;
            textures.extend(more);
            notices.extend(noted);
            for (number, material) in numbers.into_iter().zip(chosen) {
                materials[number] = material;
                changed.push((number, slot));
            }
        }
        Ok((textures, notices))
    }

    /// Changes the materials of some slots; only keys of materials are allowed.
    fn change_slots<F: AssetLoader>(
        &self,
        materials: &mut [Material],
        mesh: &Mesh,
        next: usize,
        files: &mut F,
    ) -> Result<AddedTextures, BuildFailure<F::Error>> {
        let keys = self.keys();
        let reason = "belongs to the whole object; a slot accepts only keys of materials";
        Keys(by_key! { self, is_some: name, category, visible, shadow_catcher, lidar })
            .refuse(&["name", "category", "visible", "shadow_catcher", "lidar"], reason)?;
        for others in [&SHAPES[..], &GEOMETRY, &PLACEMENT, &["upright", "slots"]] {
            keys.refuse(others, reason)?;
        }
        self.check_material(&keys, true)?;
        self.change_materials(materials, mesh, next, &keys, files)
    }
}

/// The slot with this number, or the numbers of the slots with this material name.
fn find_slots(slot: &str, materials: &[Material]) -> Result<Vec<usize>> {
    let named: Vec<usize> = (0..materials.len()).filter(|&i| !slot.is_empty() && materials[i].name == slot).collect();
    match slot.parse::<usize>() {
        Ok(number) if number < materials.len() => Ok(vec![number]),
        _ if !named.is_empty() => Ok(named),
        _ => {
            let names = materials.iter().map(|material| material.name.as_str());
            let listed: Vec<String> =
                names.clone().take(MAX_LISTED).enumerate().map(|(i, name)| format!("{i} {name:?}")).collect();
            let message = format!(
                "no material slot has this name or number{}; the object has {}: {}{}",
                suggestion(slot, names),
                counted(materials.len(), "slot"),
                listed.join(", "),
                if materials.len() > MAX_LISTED { ", ..." } else { "" },
            );
            Err(SceneError::schema(ErrorCode::UnknownName, "", message))
        }
    }
}
