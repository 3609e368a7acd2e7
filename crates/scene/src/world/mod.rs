//! The world: meshes, materials, objects, lights and cameras, which refer to each other by index.

mod at_time;
mod bounds;
mod build;
pub mod category;
mod default_camera;
mod edit;
mod find;
mod lamp_body;
mod light_names;
mod mesh_file;
mod names;
mod open_media;
mod rigs;
pub(crate) mod statistics;
mod texture_paging;
mod unused;
mod validate;
mod variant;

use std::sync::Arc;

use glam::{DAffine3, DMat3};
use serde::{Deserialize, Serialize};

pub use self::at_time::ObjectMotion;
pub use self::light_names::{SURFACES, light_names};
pub use self::names::Names;
use crate::animation::NodeTree;
use crate::camera::sensor::{LidarSurface, NamedSensor};
use crate::camera::{NamedCamera, Rig};
use crate::light::{Light, LightTraits};
use crate::material::Material;
use crate::medium::fog::Fog;
use crate::mesh::Mesh;
use crate::notice::Notice;
use crate::render_options::RenderOptions;
use crate::texture::{Texture, TextureCache};
use crate::up::Up;
use crate::video::Video;

/// A placed mesh, called an instance in ground truth. Its id is its index in [`World::objects`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Unique within the world; derived from the shape if not given.
    pub name: String,
    /// A class for data sets.
    pub category: Option<String>,
    /// Index into the world's meshes; several objects may share a mesh.
    pub mesh: usize,
    /// Indices into the world's materials, one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
    /// Any invertible affine transform, including mirroring.
    pub world_from_mesh: DAffine3,
    /// Scale (and shear) in `world_from_mesh = translation * rotation * scale_shear`, which keyframes do not change.
    pub scale_shear: DMat3,
    /// False for an object that is excluded from images, shadows, light and queries; its index stays.
    #[serde(default = "visible")]
    pub visible: bool,
    /// Kinds of rays to which the object is visible, if `visible` is true.
    #[serde(default, skip_serializing_if = "RayVisibility::is_everywhere")]
    pub ray_visibility: RayVisibility,
    /// True for a shadow catcher: compositions show only its shadows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shadow_catcher: bool,
    /// Properties of the surface for lidars, if they are not derived from the materials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lidar: Option<LidarSurface>,
    /// Index of the light whose body the object is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamp: Option<usize>,
}

fn visible() -> bool {
    true
}

/// The kinds of rays to which an object is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RayVisibility {
    /// True if images show the object directly: in colours, ids and all other ground truth.
    pub camera: bool,
    /// True if the object casts shadows: it occludes lights.
    pub shadow: bool,
    /// True if the object is visible to rays that surfaces and media scatter: in mirrors, behind glass, and as
    /// indirect light.
    pub reflection: bool,
}

impl Default for RayVisibility {
    fn default() -> Self {
        Self { camera: true, shadow: true, reflection: true }
    }
}

impl RayVisibility {
    /// True if the object is visible to all kinds of rays.
    pub fn is_everywhere(&self) -> bool {
        *self == Self::default()
    }
}

impl Object {
    /// Creates an object placed by any affine transform, whose whole linear part is its scale and shear.
    pub fn new(name: impl Into<String>, mesh: usize, materials: Vec<usize>, world_from_mesh: DAffine3) -> Self {
        Self {
            name: name.into(),
            category: None,
            mesh,
            materials,
            world_from_mesh,
            scale_shear: world_from_mesh.matrix3,
            visible: true,
            ray_visibility: RayVisibility::default(),
            shadow_catcher: false,
            lidar: None,
            lamp: None,
        }
    }
}

/// Meshes, materials, lights and cameras, which refer to each other by index. Cloning is fast, because geometry and
/// images are shared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Axis that points up.
    pub up: Up,
    /// Shared geometry.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shared textures.
    #[serde(with = "crate::texture::serde_shared")]
    pub textures: Vec<Arc<Texture>>,
    /// Cache that limits the memory of images, if the memory is limited; the cache is not part of the world's data.
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
    /// Names, visibilities and bodies of the lights, by index; lights beyond the end of this list have the defaults.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light_traits: Vec<LightTraits>,
    /// Fog outside of objects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fog: Option<Fog>,
    /// True if a world with emissive surfaces but without other lights still gets default lights, as in glTF, whose
    /// viewers light every scene by an environment.
    pub emission_keeps_default_lights: bool,
    /// Named cameras; the first is the default.
    pub cameras: Vec<NamedCamera>,
    /// Rigs; their cameras are also in `cameras`.
    pub rigs: Vec<Rig>,
    /// Sensors that are neither cameras nor on a rig.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<NamedSensor>,
    /// Render options of the world.
    pub render: RenderOptions,
    /// Video that `raycam video` renders.
    pub video: Option<Video>,
    /// Nodes that animations move.
    pub node_tree: Option<Arc<NodeTree>>,
    /// Material variants.
    pub variants: Vec<Variant>,
    /// Time of the world, if the world was moved to a time; the motion that a camera's shutter records starts at this
    /// time.
    pub time: Option<WorldTime>,
    /// Notices of the readers about everything that was skipped, repaired or counted.
    pub notices: Vec<Notice>,
}

/// A variant, which assigns other materials to some objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// The variant's name.
    pub name: String,
    /// Object, material slot and the new material.
    pub materials: Vec<(usize, usize, usize)>,
}

/// Time of a world, in seconds: of its video, and of one of its animations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WorldTime {
    /// Time in seconds.
    pub time: f64,
    /// Index of the animation; default: the first animation, if the world has any.
    pub animation: Option<usize>,
}
