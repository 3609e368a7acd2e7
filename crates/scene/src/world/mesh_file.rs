//! A world as the contents of a mesh file.

use crate::model::{MeshFile, MeshPart};
use crate::world::{Object, World};

impl MeshFile {
    /// The objects of a world as parts, where they are; its lights and cameras have no place in a model.
    pub fn from_world(world: World) -> Self {
        let part = |object: &Object| MeshPart {
            name: object.name.clone(),
            mesh: world.meshes[object.mesh].transformed(object.world_from_mesh),
            materials: object.materials.clone(),
        };
        Self {
            parts: world.objects.iter().filter(|object| object.visible).map(part).collect(),
            textures: world.textures.iter().map(|t| (**t).clone()).collect(),
            materials: world.materials,
            notices: world.notices,
            up: Some(world.up),
        }
    }
}
