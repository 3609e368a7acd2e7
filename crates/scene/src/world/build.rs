//! Adding parts to a world, with validation.

use std::sync::Arc;

use crate::camera::{Camera, NamedCamera};
use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::notice::{Notice, NoticeCode};
use crate::texture::Texture;
use crate::world::names::Names;
use crate::world::{Object, World};

impl World {
    /// Adds a mesh, which objects can place, and returns its index.
    pub fn add_mesh(&mut self, mesh: Mesh) -> usize {
        self.add_shared_mesh(Arc::new(mesh))
    }

    /// Same as [`World::add_mesh`], for a shared mesh.
    pub fn add_shared_mesh(&mut self, mesh: Arc<Mesh>) -> usize {
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    /// Adds a texture, which materials can use, and returns its index.
    pub fn add_texture(&mut self, texture: Texture) -> usize {
        self.textures.push(Arc::new(texture));
        self.textures.len() - 1
    }

    /// Adds a material and returns its index, with a notice if it reflects more light than arrives.
    ///
    /// # Errors
    /// Errors of [`Material::validate`]; a texture that does not exist.
    pub fn add_material(&mut self, material: Material) -> Result<usize> {
        material.validate()?;
        if let Some(slot) = material.texture_slots().into_iter().find(|slot| slot.texture >= self.textures.len()) {
            return Err(SceneError::World(ErrorCode::IndexOutOfRange.message(format!(
                "texture {} does not exist; the world has {}",
                slot.texture,
                counted(self.textures.len(), "texture")
            ))));
        }
        self.note_reflectance(&material);
        self.materials.push(material);
        Ok(self.materials.len() - 1)
    }

    /// Adds a notice if a material reflects more light than arrives.
    pub(crate) fn note_reflectance(&mut self, material: &Material) {
        if let Some(total) = material.reflectance_above_one() {
            let name = if material.name.is_empty() { String::new() } else { format!(" {:?}", material.name) };
            self.notices.push(Notice::new(
                NoticeCode::ReflectanceAboveOne,
                format!(
                    "material{name} reflects {total} times the arriving light (diffuse * color + specular); \
                     expected at most 1"
                ),
            ));
        }
    }

    /// Adds an object and returns its id. A number is appended to a name in use; an empty name becomes `object`.
    ///
    /// # Errors
    /// [`SceneError::World`] if an index is out of range, if the transform is singular or not finite, or if there are
    /// fewer materials than slots.
    pub fn add_object(&mut self, mut object: Object) -> Result<usize> {
        let fail = |message: String| Err(SceneError::world(message));
        let Some(mesh) = self.meshes.get(object.mesh) else {
            return fail(format!(
                "object {:?} refers to mesh {}, but the world has {}",
                object.name,
                object.mesh,
                counted(self.meshes.len(), "mesh")
            ));
        };
        if mesh.slot_count() > object.materials.len() {
            return fail(format!(
                "object {:?} has {}; its mesh uses {}",
                object.name,
                counted(object.materials.len(), "material"),
                counted(mesh.slot_count(), "slot")
            ));
        }
        if let Some(material) = object.materials.iter().find(|&&material| material >= self.materials.len()) {
            return fail(format!(
                "object {:?} refers to material {material}, but the world has {}",
                object.name,
                counted(self.materials.len(), "material")
            ));
        }
        let transform = object.world_from_mesh;
        if !transform.is_finite() {
            return fail(format!(
                "object {:?} has the transform {transform:?}; every number must be finite",
                object.name
            ));
        }
        if !transform.inverse().is_finite() {
            return fail(format!(
                "object {:?} has the transform {transform:?}, which is singular and flattens it; expected an \
                 invertible transform",
                object.name
            ));
        }
        object.name = self.names.unique(if object.name.is_empty() { "object" } else { &object.name });
        self.objects.push(object);
        self.note_open_medium(self.objects.len() - 1);
        Ok(self.objects.len() - 1)
    }

    /// Adds a light and returns its index.
    ///
    /// # Errors
    /// The errors of [`Light::validate`].
    pub fn add_light(&mut self, mut light: Light) -> Result<usize> {
        light.validate()?;
        light.check_sun_height(self.up)?;
        self.notices.extend(light.clamp_negative_texels());
        self.lights.push(light);
        Ok(self.lights.len() - 1)
    }

    /// Adds a camera under a name, made unique if necessary, and returns its index.
    pub fn add_camera(&mut self, name: &str, camera: Camera) -> usize {
        let mut names = Names::default();
        for camera in &self.cameras {
            names.unique(&camera.name);
        }
        self.cameras.push(NamedCamera { name: names.unique(name), camera });
        self.cameras.len() - 1
    }
}
