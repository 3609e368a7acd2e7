//! Validation of a world that was read as data.

use crate::animation::{AnimatedMaterial, NodeCamera, NodeLight, NodeObject, NodeTree, Skin};
use crate::camera::sensor::NamedSensor;
use crate::error::{Result, SceneError};
use crate::world::World;

impl World {
    /// Builds the world again with the methods that add parts, so that every part is valid and every index exists.
    ///
    /// # Errors
    /// The errors of the methods that add parts.
    pub fn validated(mut self) -> Result<World> {
        for mesh in &self.meshes {
            mesh.validate()?;
        }
        for texture in &self.textures {
            texture.validate()?;
        }
        // The notices of this second build are discarded, because they were reported when the world was first built.
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
        if let Some(fog) = &self.fog {
            fog.validate()?;
        }
        self.render.validate()?;
        if let Some(video) = &self.video {
            video.validate(self.objects.len(), self.rigs.len(), self.cameras.len())?;
        }
        for rig in &self.rigs {
            rig.cameras()?;
            rig.sensors().iter().try_for_each(NamedSensor::validate)?;
        }
        self.sensors.iter().try_for_each(NamedSensor::validate)?;
        if let Some(rig) = &self.node_tree {
            rig.validate(&self)?;
        }
        self.names = names; // The original names are restored, because their next numbers may be higher.
        self.notices = notices;
        Ok(self)
    }
}

impl NodeTree {
    /// Checks that every index exists in a world.
    ///
    /// # Errors
    /// [`SceneError::World`] if an index does not exist.
    pub(crate) fn validate(&self, world: &World) -> Result<()> {
        let nodes = self.nodes.len();
        let node = |node: usize| node < nodes;
        let in_skin =
            |skin: &Skin| skin.joints.iter().all(|&joint| node(joint)) && skin.joints.len() == skin.inverse_bind.len();
        let mounted = |mount: &NodeObject| {
            mount.object < world.objects.len()
                && node(mount.node)
                && mount.mesh < world.meshes.len()
                && mount.skin.is_none_or(|skin| skin < self.skins.len())
        };
        let light = |mount: &NodeLight| mount.light < world.lights.len() && node(mount.node);
        let camera = |mount: &NodeCamera| mount.camera < world.cameras.len() && node(mount.node);
        let moving = |moving: &AnimatedMaterial| moving.material < world.materials.len();
        let shows_nothing = self.animations.is_empty() || self.hidden_mesh < world.meshes.len();
        let good = self.order.iter().all(|&i| node(i))
            && self.nodes.iter().all(|n| n.parent.is_none_or(node))
            && self.skins.iter().all(in_skin)
            && self.objects.iter().all(mounted)
            && self.lights.iter().all(light)
            && self.cameras.iter().all(camera)
            && self.materials.iter().all(moving)
            && shows_nothing;
        if good {
            return Ok(());
        }
        let message = "an animation moves a part that the world does not have";
        Err(SceneError::world(message))
    }
}
