//! The world: everything there is, by index.

mod at_time;
mod bounds;
mod build;
pub mod category;
mod default_camera;
mod edit;
mod find;
mod mesh_file;
mod names;
mod rigs;
pub(crate) mod statistics;
mod texture_paging;
mod unused;
mod validate;
mod variant;

use std::sync::Arc;

use glam::{DAffine3, DMat3};
use serde::{Deserialize, Serialize};

pub use self::names::Names;
use crate::animation::NodeTree;
use crate::camera::{NamedCamera, Rig};
use crate::light::Light;
use crate::material::Material;
use crate::medium::fog::Fog;
use crate::mesh::Mesh;
use crate::notice::Notice;
use crate::render_options::RenderOptions;
use crate::texture::{Texture, TextureCache};
use crate::up::Up;
use crate::video::Video;

/// A placed mesh: what the ground truth calls an instance. Its id is its index in [`World::objects`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Unique within the world; derived from the shape if not given.
    pub name: String,
    /// A class for data sets.
    pub category: Option<String>,
    /// Index into the world's meshes; several objects may share one.
    pub mesh: usize,
    /// Indices into the world's materials, one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
    /// Any invertible affine transform, mirroring included.
    pub world_from_mesh: DAffine3,
    /// The scale (and shear) in `world_from_mesh = translation * rotation * scale_shear`: what keyframes leave as it
    /// is.
    pub scale_shear: DMat3,
    /// False for an object that is excluded from images, shadows, light and queries; its index stays.
    #[serde(default = "visible")]
    pub visible: bool,
    /// True for a shadow catcher: compositions show only its shadows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shadow_catcher: bool,
}

fn visible() -> bool {
    true
}

impl Object {
    /// An object placed by any affine transform, all of whose linear part is its shape.
    pub fn new(name: impl Into<String>, mesh: usize, materials: Vec<usize>, world_from_mesh: DAffine3) -> Self {
        Self {
            name: name.into(),
            category: None,
            mesh,
            materials,
            world_from_mesh,
            scale_shear: world_from_mesh.matrix3,
            visible: true,
            shadow_catcher: false,
        }
    }
}

/// Meshes, materials, lights and cameras, joined by index. Cloning is cheap: geometry and images are shared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Which way is up.
    pub up: Up,
    /// Shared geometry.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shared images.
    #[serde(with = "crate::texture::serde_shared")]
    pub textures: Vec<Arc<Texture>>,
    /// The cache that bounds the memory of images, if one does; not part of the data.
    #[serde(skip)]
    pub texture_cache: Option<Arc<TextureCache>>,
    /// Shared materials.
    pub materials: Vec<Material>,
    /// Placed meshes.
    pub objects: Vec<Object>,
    /// The objects' names.
    pub names: Names,
    /// All lights.
    pub lights: Vec<Light>,
    /// Fog outside of objects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fog: Option<Fog>,
    /// True if emissive surfaces do not replace default lights: a world without other lights gets some all the same. So
    /// it is in glTF, whose viewers light everything by an environment of their own.
    pub emission_keeps_default_lights: bool,
    /// Named cameras, the default one first.
    pub cameras: Vec<NamedCamera>,
    /// Rigs, whose cameras are among the others.
    pub rigs: Vec<Rig>,
    /// Render options of the world.
    pub render: RenderOptions,
    /// The video that `raycam video` makes of it.
    pub video: Option<Video>,
    /// The nodes that animations move.
    pub node_tree: Option<Arc<NodeTree>>,
    /// Looks to choose from.
    pub variants: Vec<Variant>,
    /// When it is, if it was moved to a time: a camera's shutter sees it move on from there.
    pub time: Option<WorldTime>,
    /// Notices of its readers: skipped, repaired, counted. Never silent.
    pub notices: Vec<Notice>,
}

/// A look: other materials for some objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// Object, material slot and the material it gets.
    pub materials: Vec<(usize, usize, usize)>,
}

/// A time of a world, in seconds: of its video, and of one of its animations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WorldTime {
    /// In seconds.
    pub time: f64,
    /// By number; the first where there are any.
    pub animation: Option<usize>,
}
