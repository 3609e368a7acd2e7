//! The world: everything there is, by index.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::error::SceneError;
use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::schema::RenderSpec;
use crate::texture::Texture;
use crate::video::Video;

/// Which axis points up. It matters to roll/pitch/yaw, orbits and the sky; vertices are never turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// z up, as in robotics and most CAD.
    #[default]
    Z,
    /// y up, as in glTF.
    Y,
}

/// A placed mesh: what the ground truth calls an instance. Its id is its index in [`World::objects`].
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Unique within the world; made from the shape where none was given.
    pub name: String,
    /// A class for data sets.
    pub category: Option<String>,
    /// Index into the world's meshes; several objects may share one.
    pub mesh: usize,
    /// Indices into the world's materials, one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
    /// Any invertible affine transform, mirroring included.
    pub world_from_mesh: DAffine3,
    /// The scale (and shear) in `world_from_mesh = translation * rotation * shape`: what keyframes leave as it is.
    pub shape: DMat3,
}

impl Object {
    /// An object placed by any affine transform, all of whose linear part is its shape.
    pub fn new(
        name: impl Into<String>,
        mesh: usize,
        materials: Vec<usize>,
        world_from_mesh: DAffine3,
    ) -> Self {
        Self {
            name: name.into(),
            category: None,
            mesh,
            materials,
            world_from_mesh,
            shape: world_from_mesh.matrix3,
        }
    }
}

/// A camera with the name it is asked for by.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// Unique within the world.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// Meshes, materials, lights and cameras, joined by index. Cloning is cheap: geometry and images are shared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Which way is up.
    pub up: Up,
    /// Shared geometry.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shared images.
    pub textures: Vec<Arc<Texture>>,
    /// Shared materials.
    pub materials: Vec<Material>,
    /// Placed meshes.
    pub objects: Vec<Object>,
    /// All lights.
    pub lights: Vec<Light>,
    /// Named cameras, the default one first.
    pub cameras: Vec<NamedCamera>,
    /// How it wants to be rendered.
    pub render: RenderSpec,
    /// What `raycam video` makes of it.
    pub video: Option<Video>,
    /// What reading it had to say: skipped, repaired, counted. Never silent.
    pub notices: Vec<String>,
}

impl World {
    /// Adds a mesh to be placed by objects and returns its index.
    pub fn add_mesh(&mut self, mesh: Mesh) -> usize {
        self.meshes.push(Arc::new(mesh));
        self.meshes.len() - 1
    }

    /// Adds an object and returns its id. A name that is taken gets a number; an empty one becomes `object`.
    ///
    /// # Errors
    /// [`SceneError::World`] where an index is out of range, the transform is singular or not finite, or there are
    /// fewer materials than slots.
    pub fn add_object(&mut self, object: Object) -> Result<usize, SceneError> {
        self.objects.push(object);
        Ok(self.objects.len() - 1)
    }

    /// Adds a light and returns its index.
    ///
    /// # Errors
    /// Those of [`Light::validate`].
    pub fn add_light(&mut self, light: Light) -> Result<usize, SceneError> {
        light.validate()?;
        self.lights.push(light);
        Ok(self.lights.len() - 1)
    }

    /// Adds a camera under a name, made unique, and returns its index.
    pub fn add_camera(&mut self, name: &str, camera: Camera) -> usize {
        self.cameras.push(NamedCamera {
            name: name.into(),
            camera,
        });
        self.cameras.len() - 1
    }

    /// The smallest and largest corner of all objects in the world; `None` when there is nothing.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        None
    }

    /// The first camera, or one that frames everything from the front left above. `size` is for the latter.
    ///
    /// # Errors
    /// [`SceneError`] where there is neither a camera nor anything to frame, or the size is out of range.
    pub fn default_camera(&self, _size: [u32; 2]) -> Result<Camera, SceneError> {
        Err(SceneError::World("not built yet".into()))
    }

    /// The camera of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_camera(&self, name: &str) -> Result<&NamedCamera, SceneError> {
        self.cameras
            .iter()
            .find(|camera| camera.name == name)
            .ok_or_else(|| SceneError::World(format!("no camera {name:?}")))
    }

    /// Gives a world without lights a white sky and a notice that says so; whether it did.
    pub fn add_default_light(&mut self) -> bool {
        if !self.lights.is_empty() {
            return false;
        }
        self.lights.push(Light::Sky { radiance: [1.0; 3] });
        self.notices
            .push("no lights: lit by a white sky of radiance 1".into());
        true
    }

    /// What it holds, in numbers.
    pub fn counts(&self) -> Counts {
        Counts::default()
    }
}

/// What a world holds, in numbers. Triangles count once per object that shows them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Shared meshes.
    pub meshes: usize,
    /// Placed meshes.
    pub objects: usize,
    /// Triangles of all meshes, each mesh once.
    pub mesh_triangles: usize,
    /// Triangles of all objects.
    pub object_triangles: usize,
    /// Triangles without area, each mesh once: kept, never hit.
    pub degenerate_triangles: usize,
    /// Vertices of all meshes, each mesh once.
    pub vertices: usize,
    /// Materials.
    pub materials: usize,
    /// Images.
    pub textures: usize,
    /// Lights.
    pub lights: usize,
    /// Cameras.
    pub cameras: usize,
}
