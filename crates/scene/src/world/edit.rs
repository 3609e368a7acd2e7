//! Changes of a world's parts in place. Each change is validated before it is applied.

use glam::DAffine3;

use crate::camera::Camera;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::light::{Light, LightTraits};
use crate::notice::{Notice, NoticeCode};
use crate::world::World;
use crate::world::light_names::SURFACES;
use crate::world::names::Names;

impl World {
    /// Removes an object and its unshared parts. The indices of later objects decrease by one; videos, animations and
    /// variants are updated.
    ///
    /// # Errors
    /// [`SceneError::World`] if the object does not exist.
    pub fn remove_object(&mut self, id: usize) -> Result<()> {
        self.check_object(id)?;
        let before = self.parts_in_use();
        if let Some(light) = self.objects.remove(id).lamp
            && let Some(traits) = self.light_traits.get_mut(light)
        {
            traits.has_body = false;
            self.trim_light_traits();
        }
        self.names = Names::from_used(self.objects.iter().map(|object| &object.name[..]));
        let follows = |object: &mut usize| follow(object, id);
        if let Some(video) = &mut self.video {
            video.objects.retain_mut(|(object, _)| follows(object));
        }
        for variant in &mut self.variants {
            variant.materials.retain_mut(|(object, _, _)| follows(object));
        }
        self.change_tree(|tree| tree.objects.retain_mut(|mount| follows(&mut mount.object)));
        self.remove_unused(&before);
        Ok(())
    }

    /// Places an object. In a world at a time, the object stays there: animations no longer move it.
    ///
    /// # Errors
    /// [`SceneError::World`] if the object does not exist, or if the transform flattens it or is not finite.
    pub fn place_object(&mut self, id: usize, world_from_mesh: DAffine3) -> Result<()> {
        self.check_object(id)?;
        if !(world_from_mesh.is_finite() && world_from_mesh.inverse().is_finite()) {
            return Err(SceneError::world(format!(
                "object {:?} has the transform {world_from_mesh:?}; expected finite numbers and an invertible \
                 transform",
                self.objects[id].name
            )));
        }
        let object = &mut self.objects[id];
        (object.world_from_mesh, object.scale_shear) = (world_from_mesh, world_from_mesh.matrix3);
        self.release_object(id);
        Ok(())
    }

    /// Detaches a placed object from the nodes that would move it back and, in a world at a time, also from its
    /// keyframes.
    pub(crate) fn release_object(&mut self, id: usize) {
        let is_moment = self.time.is_some();
        if let Some(video) = self.video.as_mut().filter(|_| is_moment) {
            video.objects.retain(|(object, _)| *object != id);
        }
        let Some(tree) = &self.node_tree else { return };
        let mounted = tree.objects.iter().any(|mount| mount.object == id);
        if mounted && !is_moment && tree.moves_object(id) {
            self.notices.push(Notice::new(
                NoticeCode::DetachedPart,
                format!(
                    "object {:?} is animated: the new placement applies at rest, but world.at(time) \
                 uses the file's animation",
                    self.objects[id].name
                ),
            ));
        } else if mounted {
            self.change_tree(|tree| tree.objects.retain(|mount| mount.object != id));
        }
    }

    /// Replaces a light and detaches it from its node.
    ///
    /// # Errors
    /// [`SceneError::World`] if the light does not exist, and the errors of [`Light::validate`].
    pub fn set_light(&mut self, number: usize, mut light: Light) -> Result<()> {
        self.check_light(number)?;
        light.validate()?;
        light.check_sun_height(self.up)?;
        self.notices.extend(light.clamp_negative_texels());
        self.lights[number] = light;
        self.change_tree(|tree| tree.lights.retain(|mount| mount.light != number));
        Ok(())
    }

    /// Sets the name and the visibility of a light, and adds or removes its body.
    ///
    /// # Errors
    /// [`SceneError::World`] if the light does not exist, for a name that another light has, and for the body of a
    /// light without a size.
    pub fn set_light_traits(&mut self, number: usize, traits: LightTraits) -> Result<()> {
        self.check_light(number)?;
        if let Some(name) = &traits.name {
            let mut others = self.light_traits.iter().enumerate().filter(|(other, _)| *other != number);
            if name == SURFACES || others.any(|(_, other)| other.name.as_ref() == Some(name)) {
                let owner = if name == SURFACES { "all emissive surfaces" } else { "another light" };
                return Err(SceneError::light(format!(
                    "light channels already use the name {name:?} for {owner}; use a different name"
                )));
            }
        }
        if traits.has_body {
            Self::check_lamp_body(&self.lights[number])?;
        }
        if traits != self.traits_of_light(number) {
            self.light_traits.resize(self.light_traits.len().max(number + 1), LightTraits::default());
            self.light_traits[number] = traits;
        }
        self.trim_light_traits();
        self.update_lamp_body(number)
    }

    /// Removes default traits at the end of the list, because lights without an entry have these traits anyway.
    fn trim_light_traits(&mut self) {
        while self.light_traits.last().is_some_and(|last| *last == LightTraits::default()) {
            self.light_traits.pop();
        }
    }

    /// Name, visibility and body of a light.
    pub fn traits_of_light(&self, number: usize) -> LightTraits {
        self.light_traits.get(number).cloned().unwrap_or_default()
    }

    /// Removes a light and its body. The indices of later lights decrease by one.
    ///
    /// # Errors
    /// [`SceneError::World`] if the light does not exist.
    pub fn remove_light(&mut self, number: usize) -> Result<()> {
        self.check_light(number)?;
        if let Some(body) = self.lamp_body(number) {
            self.remove_object(body)?;
        }
        self.objects.iter_mut().filter_map(|object| object.lamp.as_mut()).for_each(|lamp| {
            follow(lamp, number);
        });
        self.lights.remove(number);
        if number < self.light_traits.len() {
            self.light_traits.remove(number);
        }
        self.change_tree(|tree| tree.lights.retain_mut(|mount| follow(&mut mount.light, number)));
        Ok(())
    }

    /// Replaces a camera and detaches it from its node and, in a world at a time, also from its keyframes.
    ///
    /// # Errors
    /// [`SceneError::World`] if the camera does not exist or belongs to a rig.
    pub fn set_camera(&mut self, name: &str, camera: Camera) -> Result<()> {
        let number = self.own_camera(name)?;
        self.cameras[number].camera = camera;
        let is_moment = self.time.is_some();
        if let Some(video) = self.video.as_mut().filter(|_| is_moment) {
            video.cameras.retain(|(other, _)| *other != number);
        }
        self.change_tree(|tree| tree.cameras.retain(|mount| mount.camera != number));
        Ok(())
    }

    /// Removes a camera.
    ///
    /// # Errors
    /// [`SceneError::World`] if the camera does not exist or belongs to a rig.
    pub fn remove_camera(&mut self, name: &str) -> Result<()> {
        let number = self.own_camera(name)?;
        self.cameras.remove(number);
        if let Some(video) = &mut self.video {
            video.cameras.retain_mut(|(camera, _)| follow(camera, number));
        }
        self.change_tree(|tree| tree.cameras.retain_mut(|mount| follow(&mut mount.camera, number)));
        Ok(())
    }

    /// Index of a camera that does not belong to a rig.
    pub(crate) fn own_camera(&self, name: &str) -> Result<usize> {
        self.find_camera(name)?;
        for rig in &self.rigs {
            let of_rig = name.strip_prefix(rig.name()).is_some_and(|rest| rest.starts_with('/'));
            if of_rig && rig.cameras()?.iter().any(|own| name == format!("{}/{}", rig.name(), own.name)) {
                return Err(SceneError::world(format!(
                    "camera {name:?} belongs to the rig {:?}, which moves as a whole; replace the rig with add_rig, \
                     or add the camera under another name with add_camera",
                    rig.name()
                )));
            }
        }
        Ok(self.cameras.iter().position(|camera| camera.name == name).unwrap_or_default())
    }

    /// Checks that an object with this index exists.
    ///
    /// # Errors
    /// [`SceneError::World`] if it does not exist.
    pub fn check_object(&self, id: usize) -> Result<()> {
        check_number("object", "the world", id, self.objects.len())
    }

    /// Checks that an object with this index exists, and that it has a material slot with the index `slot`.
    ///
    /// # Errors
    /// [`SceneError::World`] if the object or the slot does not exist.
    pub fn check_slot(&self, id: usize, slot: usize) -> Result<()> {
        self.check_object(id)?;
        check_number("material slot", "the object", slot, self.objects[id].materials.len())
    }

    /// Checks that a light with this index exists.
    ///
    /// # Errors
    /// [`SceneError::World`] if it does not exist.
    pub fn check_light(&self, number: usize) -> Result<()> {
        check_number("light", "the world", number, self.lights.len())
    }
}

fn check_number(what: &str, owner: &str, number: usize, count: usize) -> Result<()> {
    if number < count {
        return Ok(());
    }
    let known = match count {
        0 => format!("{owner} has none"),
        1 => format!("{owner} has one, with index 0"),
        _ => format!("{owner} has {count}, with indices 0 to {}", count - 1),
    };
    Err(SceneError::World(ErrorCode::IndexOutOfRange.message(format!("{what} {number} does not exist; {known}"))))
}

/// Decrements an index above the removed index; returns false for the removed index.
fn follow(index: &mut usize, removed: usize) -> bool {
    let stays = *index != removed;
    *index -= usize::from(*index > removed);
    stays
}
