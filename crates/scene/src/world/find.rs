//! Parts of a world by name.

use crate::camera::NamedCamera;
use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::world::World;

impl World {
    /// Returns the camera with this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_camera(&self, name: &str) -> Result<&NamedCamera> {
        self.cameras.iter().find(|camera| camera.name == name).ok_or_else(|| {
            let names = self.cameras.iter().map(|camera| camera.name.as_str());
            let count = counted(self.cameras.len(), "camera");
            SceneError::unknown_name(format!(
                "no camera named {name:?}; the world has {count}{}",
                suggestion(name, names)
            ))
        })
    }

    /// Returns the id of the object with this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_object(&self, name: &str) -> Result<usize> {
        self.objects.iter().position(|object| object.name == name).ok_or_else(|| {
            let names = self.objects.iter().map(|object| object.name.as_str());
            let count = counted(self.objects.len(), "object");
            SceneError::unknown_name(format!(
                "no object named {name:?}; the world has {count}{}",
                suggestion(name, names)
            ))
        })
    }
}
