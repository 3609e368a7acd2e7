//! Removal of unused parts.

use std::sync::Arc;

use crate::animation::{AnimationTarget, NodeTree};
use crate::world::World;

/// Parts of a world that were in use before a change.
#[derive(Debug, Default)]
pub(crate) struct PartsInUse {
    meshes: Vec<bool>,
    materials: Vec<bool>,
    textures: Vec<bool>,
}

impl World {
    /// Returns the parts that are in use now.
    pub(crate) fn parts_in_use(&self) -> PartsInUse {
        let mut used = PartsInUse {
            meshes: vec![false; self.meshes.len()],
            materials: vec![false; self.materials.len()],
            textures: vec![false; self.textures.len()],
        };
        let mark = |list: &mut Vec<bool>, index: usize| {
            if let Some(used) = list.get_mut(index) {
                *used = true;
            }
        };
        for object in &self.objects {
            mark(&mut used.meshes, object.mesh);
            object.materials.iter().for_each(|&material| mark(&mut used.materials, material));
        }
        for (_, _, material) in self.variants.iter().flat_map(|variant| &variant.materials) {
            mark(&mut used.materials, *material);
        }
        if let Some(tree) = &self.node_tree {
            mark(&mut used.meshes, tree.hidden_mesh);
            tree.objects.iter().for_each(|mount| mark(&mut used.meshes, mount.mesh));
            tree.materials.iter().for_each(|moving| mark(&mut used.materials, moving.material));
        }
        let materials = self.materials.iter().enumerate().filter(|(i, _)| used.materials[*i]);
        for slot in materials.flat_map(|(_, material)| material.texture_slots()) {
            mark(&mut used.textures, slot.texture);
        }
        used
    }

    /// Removes parts that were in use `before` and are unused now. The indices of later parts decrease.
    pub(crate) fn remove_unused(&mut self, before: &PartsInUse) {
        let now = self.parts_in_use();
        let kept = |before: &[bool], now: &[bool]| -> Vec<bool> {
            let was_used = |i: usize| before.get(i).is_some_and(|&used| used);
            now.iter().enumerate().map(|(i, &used)| used || !was_used(i)).collect()
        };
        let meshes = kept(&before.meshes, &now.meshes);
        let materials = kept(&before.materials, &now.materials);
        let textures = kept(&before.textures, &now.textures);
        if let Some(number) = retain(&mut self.meshes, &meshes) {
            self.objects.iter_mut().for_each(|object| object.mesh = number[object.mesh]);
            self.change_tree(|tree| {
                tree.hidden_mesh = number.get(tree.hidden_mesh).copied().unwrap_or_default();
                tree.objects.iter_mut().for_each(|mount| mount.mesh = number[mount.mesh]);
            });
        }
        if let Some(number) = retain(&mut self.materials, &materials) {
            let renumber = |material: &mut usize| *material = number[*material];
            self.objects.iter_mut().flat_map(|object| &mut object.materials).for_each(renumber);
            let variants = self.variants.iter_mut().flat_map(|variant| &mut variant.materials);
            variants.for_each(|(_, _, material)| renumber(material));
            self.change_tree(|tree| {
                tree.materials.iter_mut().for_each(|moving| renumber(&mut moving.material));
                let channels = tree.animations.iter_mut().flat_map(|animation| &mut animation.channels);
                for channel in channels {
                    if let AnimationTarget::Material(material, _) = &mut channel.target
                        && *material < number.len()
                    {
                        renumber(material);
                    }
                }
            });
        }
        if let Some(number) = retain(&mut self.textures, &textures) {
            let slots = self.materials.iter_mut().flat_map(|material| material.texture_slots_mut());
            slots.for_each(|slot| slot.texture = number[slot.texture]);
            self.change_tree(|tree| {
                for moving in &mut tree.materials {
                    moving.base.texture_slots_mut().for_each(|slot| slot.texture = number[slot.texture]);
                }
            });
        }
    }

    /// Changes the node tree, if the world has one.
    pub(crate) fn change_tree(&mut self, change: impl FnOnce(&mut NodeTree)) {
        if let Some(tree) = &mut self.node_tree {
            change(Arc::make_mut(tree));
        }
    }
}

/// Removes the items that are not kept; returns the new index of each old item, or `None` if all are kept.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) -> Option<Vec<usize>> {
    if kept.iter().all(|&kept| kept) {
        return None;
    }
    let mut next = 0;
    let number = kept.iter().map(|&kept| {
        next += usize::from(kept);
        next - usize::from(kept)
    });
    let number = number.collect();
    let mut flags = kept.iter();
    items.retain(|_| flags.next().is_none_or(|&kept| kept));
    Some(number)
}
