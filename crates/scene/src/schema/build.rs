//! From what people wrote to the world it means.

use crate::error::SceneError;
use crate::model::Files;
use crate::schema::{ObjectSpec, WorldFile};
use crate::world::World;

impl WorldFile {
    /// The world it describes. `files` reads the meshes and textures it names.
    ///
    /// # Errors
    /// [`SceneError::Schema`] with the path of the key at fault, and whatever `files` says.
    pub fn build<F: Files>(self, _files: &mut F) -> Result<World, F::Error> {
        Err(SceneError::World("not built yet".into()).into())
    }
}

impl ObjectSpec {
    /// Adds the object it describes to a world, with its mesh and material, and returns its id.
    ///
    /// # Errors
    /// [`SceneError`] where shape, transform or material make no sense, and whatever `files` says.
    pub fn build<F: Files>(self, _world: &mut World, _files: &mut F) -> Result<usize, F::Error> {
        Err(SceneError::World("not built yet".into()).into())
    }
}
