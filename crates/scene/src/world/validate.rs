//! Whether a world that was not built by its own methods could have been.

use crate::error::SceneError;
use crate::world::World;

impl World {
    /// Builds it again in their way, for worlds that come as data: every part is valid, and every index leads somewhere.
    ///
    /// # Errors
    /// What the methods that add its parts would have said.
    pub fn validated(mut self) -> Result<World, SceneError> {
        for mesh in &self.meshes {
            mesh.validate()?;
        }
        for texture in &self.textures {
            texture.validate()?;
        }
        // Notices were taken when it was first built.
        let notices = self.notices.clone();
        for material in std::mem::take(&mut self.materials) {
            self.add_material(material)?;
        }
        let names = std::mem::take(&mut self.names);
        for object in std::mem::take(&mut self.objects) {
            self.add_object(object)?;
        }
        for light in std::mem::take(&mut self.lights) {
            self.add_light(light)?;
        }
        self.render.validate()?;
        if let Some(video) = &self.video {
            video.validate(self.objects.len(), self.rigs.len())?;
        }
        for rig in &self.rigs {
            rig.cameras()?;
        }
        if let Some(rig) = &self.node_tree {
            rig.validate(&self)?;
        }
        self.names = names; // in which more numbers may be in use
        self.notices = notices;
        Ok(self)
    }
}
