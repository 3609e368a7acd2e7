//! The world: everything there is, by index.

use std::sync::Arc;

use glam::DAffine3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
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
    /// What `raycam video` makes of it.
    pub video: Option<Video>,
    /// What reading it had to say: skipped, repaired, counted. Never silent.
    pub notices: Vec<String>,
}
