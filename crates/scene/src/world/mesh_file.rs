//! A world as the contents of a mesh file.

use crate::model::{MeshFile, MeshPart};
use crate::world::{Object, World};

impl MeshFile {
    /// Returns the objects of a world as parts at their positions; a mesh file cannot contain lights and cameras.
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
