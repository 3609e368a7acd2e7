//! Changes of the materials of an object's slots.

use std::collections::HashMap;

use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::AssetLoader;
use crate::notice::Notice;
use crate::schema::build_failure::BuildFailure;
use crate::schema::keys::{Keys, by_key};
use crate::schema::object_keys::{GEOMETRY, PLACEMENT, SHAPES, WHOLE_OBJECT};
use crate::schema::spec::object::{KEYS, ObjectSpec};
use crate::texture::Texture;

/// Images that a description adds to a world, and the notices about these images.
type AddedTextures = (Vec<Texture>, Vec<Notice>);

impl ObjectSpec {
    /// Changes the materials of an object's slots as described: all materials by the object's own keys, then the
    /// materials of single slots by `slots`. The result contains the images of the description, whose indices in the
    /// world start at `next`, and notices.
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
        let Some(slots) = &self.slots else { return Ok((textures, notices)) };
        let names: Vec<String> = materials.iter().map(|material| material.name.clone()).collect();
        let by_name = slots_by_name(&names);
        let mut changed_by: Vec<Option<&str>> = vec![None; materials.len()];
        for (key, spec) in slots {
            let in_slot = |failure: BuildFailure<F::Error>| failure.in_context(&format!("slots.{key}"));
            let numbers = find_slots(key, &names, &by_name).map_err(|error| in_slot(error.into()))?;
            for &number in &numbers {
                if let Some(other) = changed_by[number].replace(key) {
                    let message = format!("slot {number} is also changed by slots.{other}; merge both tables");
                    return Err(in_slot(SceneError::schema(ErrorCode::ConflictingValues, "", message).into()));
                }
            }
            let mut chosen: Vec<Material> = numbers.iter().map(|&number| materials[number].clone()).collect();
            let first = next + textures.len();
            let (more, noted) = spec.change_slots(&mut chosen, mesh, first, files).map_err(in_slot)?;
            textures.extend(more);
            notices.extend(noted);
            for (number, material) in numbers.into_iter().zip(chosen) {
                materials[number] = material;
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
            .refuse(&WHOLE_OBJECT, reason)?;
        for others in [&SHAPES[..], &GEOMETRY, &PLACEMENT, &["upright", "slots"]] {
            keys.refuse(others, reason)?;
        }
        self.check_material(&keys, true)?;
        self.change_materials(materials, mesh, next, &keys, files)
    }
}

/// The numbers of the slots with each material name.
fn slots_by_name(names: &[String]) -> HashMap<&str, Vec<usize>> {
    let mut found: HashMap<&str, Vec<usize>> = HashMap::new();
    for (number, name) in names.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
        found.entry(name).or_default().push(number);
    }
    found
}

/// The slot with the number `key`; if no slot has this number, all slots whose material has the name `key`.
fn find_slots(key: &str, names: &[String], by_name: &HashMap<&str, Vec<usize>>) -> Result<Vec<usize>> {
    let number = key.parse::<usize>().ok().filter(|&number| number < names.len());
    if let Some(found) = number.map(|number| vec![number]).or_else(|| by_name.get(key).cloned()) {
        return Ok(found);
    }
    let known = names.iter().map(String::as_str).filter(|name| !name.is_empty());
    let named = match by_name.is_empty() {
        true => String::new(),
        false => format!(" or a material's name{}", suggestion(key, known)),
    };
    let numbers = match names.len() {
        0 | 1 => "0".to_owned(),
        count => format!("a number from 0 to {}", count - 1),
    };
    let message = format!("the object has {}; expected {numbers}{named}", counted(names.len(), "material slot"));
    Err(SceneError::schema(ErrorCode::UnknownName, "", message))
}
