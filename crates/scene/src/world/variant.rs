//! Material variants of a world.

use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::world::World;

impl World {
    /// Returns the world with the materials of one of its variants.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn with_variant(&self, name: &str) -> Result<World> {
        let Some(variant) = self.variants.iter().find(|variant| variant.name == name) else {
            let names = self.variants.iter().map(|variant| &variant.name[..]);
            let count = counted(self.variants.len(), "variant");
            let near = suggestion(name, names);
            return Err(SceneError::unknown_name(format!("no variant named {name:?}; the world has {count}{near}")));
        };
        let mut world = self.clone();
        for &(object, slot, material) in &variant.materials {
            let object = world.objects.get_mut(object);
            if let Some(own) = object.and_then(|object| object.materials.get_mut(slot)) {
                *own = material;
            }
        }
        Ok(world)
    }
}
