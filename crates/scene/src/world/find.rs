//! Parts of a world by their names.

use crate::camera::NamedCamera;
use crate::error::{Result, SceneError, suggestion};
use crate::world::World;

impl World {
    /// The camera of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_camera(&self, name: &str) -> Result<&NamedCamera> {
        self.cameras.iter().find(|camera| camera.name == name).ok_or_else(|| {
            let names = self.cameras.iter().map(|camera| camera.name.as_str());
            let count = self.cameras.len();
            SceneError::unknown_name(format!("no camera {name:?} among {count}{}", suggestion(name, names)))
        })
    }

    /// The id of the object of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_object(&self, name: &str) -> Result<usize> {
        self.objects.iter().position(|object| object.name == name).ok_or_else(|| {
            let names = self.objects.iter().map(|object| object.name.as_str());
            let count = self.objects.len();
            SceneError::unknown_name(format!("no object {name:?} among {count}{}", suggestion(name, names)))
        })
    }
}
